/* LF Algorithm 2 for the flat display with the linear diffuser, float32: baselines for lfssao's numba kernel.
 *
 * plain_c      one loop nest per texel and sample, as a C programmer writes the algorithm down.
 * avx512_c     the same by hand: sixteen texels at a time, masked gathers of the depth texture.
 * avx2_c       the same, eight at a time.
 *
 * All write the operations in lfssao's order; compiled with -ffp-contract=off they give its bits.
 */
#include <stdint.h>
#include <math.h>
#ifdef __AVX2__
#include <immintrin.h>
#endif

/* m: the sixteen numbers of the mapping, lfssao/kernels/mapping.py, CROSSED_SLITS: rows of four for X, Y, Z, then
 * z_m, z_o, u_0, v_0. positions: height x width x 3, world. offsets: n x 3, the samples after the rows' linear part
 * (done once a sample, as in lfssao). Texels without a surface are skipped in all three. */
void plain_c(int width, int height, int n, const float *depth, const float *positions, const float *offsets,
             const float *m, float *ao)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            const float *p = positions + 3 * ((int64_t)j * width + i);
            ao[(int64_t)j * width + i] = 0;
            if (!(depth[(int64_t)j * width + i] < INFINITY))
                continue;
            float px = ((m[0] * p[0] + m[1] * p[1]) + m[2] * p[2]) + m[3];
            float py = ((m[4] * p[0] + m[5] * p[1]) + m[6] * p[2]) + m[7];
            float pz = ((m[8] * p[0] + m[9] * p[1]) + m[10] * p[2]) + m[11];
            int count = 0;
            for (int s = 0; s < n; s++) {
                float x = px + offsets[3 * s], y = py + offsets[3 * s + 1], z = pz + offsets[3 * s + 2];
                float u = m[14] + x / (m[12] - z), v = m[15] + y / (m[13] - z);
                if (z < m[12] && z > m[13] && u >= 0 && u < width && v >= 0 && v < height)
                    count += depth[(int)v * width + (int)u] < z;
            }
            ao[(int64_t)j * width + i] = (float)count / (float)n;
        }
}

#ifdef __AVX512F__
void avx512_c(int width, int height, int n, const float *depth, const float *positions, const float *offsets,
              const float *m, float *ao)
{
    __m512 k[16];
    for (int q = 0; q < 16; q++)
        k[q] = _mm512_set1_ps(m[q]);
    const __m512 zero = _mm512_setzero_ps(), infinity = _mm512_set1_ps(INFINITY);
    const __m512 fw = _mm512_set1_ps((float)width), fh = _mm512_set1_ps((float)height);
    const __m512i w = _mm512_set1_epi32(width), one = _mm512_set1_epi32(1);
    const __m512i stride = _mm512_mullo_epi32(_mm512_set1_epi32(3), _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9,
                                              10, 11, 12, 13, 14, 15));
#pragma omp parallel for schedule(static)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i += 16) {
            const int left = width - i;
            const __mmask16 lanes = left >= 16 ? (__mmask16)0xffff : (__mmask16)((1u << left) - 1);
            float *out = ao + (int64_t)j * width + i;
            const __m512 here = _mm512_maskz_loadu_ps(lanes, depth + (int64_t)j * width + i);
            const __mmask16 seen = _mm512_mask_cmp_ps_mask(lanes, here, infinity, _CMP_LT_OQ);
            if (!seen) {
                _mm512_mask_storeu_ps(out, lanes, zero);
                continue;
            }
            const float *p = positions + 3 * ((int64_t)j * width + i);
            __m512 wx = _mm512_mask_i32gather_ps(zero, lanes, stride, p, 4);
            __m512 wy = _mm512_mask_i32gather_ps(zero, lanes, stride, p + 1, 4);
            __m512 wz = _mm512_mask_i32gather_ps(zero, lanes, stride, p + 2, 4);
#define ROW512(r) _mm512_add_ps(_mm512_add_ps(_mm512_add_ps(_mm512_mul_ps(k[4 * r], wx), \
                  _mm512_mul_ps(k[4 * r + 1], wy)), _mm512_mul_ps(k[4 * r + 2], wz)), k[4 * r + 3])
            __m512 px = ROW512(0), py = ROW512(1), pz = ROW512(2);
            __m512i count = _mm512_setzero_si512();
            for (int s = 0; s < n; s++) {
                __m512 x = _mm512_add_ps(px, _mm512_set1_ps(offsets[3 * s]));
                __m512 y = _mm512_add_ps(py, _mm512_set1_ps(offsets[3 * s + 1]));
                __m512 z = _mm512_add_ps(pz, _mm512_set1_ps(offsets[3 * s + 2]));
                __m512 u = _mm512_add_ps(k[14], _mm512_div_ps(x, _mm512_sub_ps(k[12], z)));
                __m512 v = _mm512_add_ps(k[15], _mm512_div_ps(y, _mm512_sub_ps(k[13], z)));
                __mmask16 in = _mm512_mask_cmp_ps_mask(seen, z, k[12], _CMP_LT_OQ);
                in = _mm512_mask_cmp_ps_mask(in, z, k[13], _CMP_GT_OQ);
                in = _mm512_mask_cmp_ps_mask(in, u, zero, _CMP_GE_OQ);
                in = _mm512_mask_cmp_ps_mask(in, u, fw, _CMP_LT_OQ);
                in = _mm512_mask_cmp_ps_mask(in, v, zero, _CMP_GE_OQ);
                in = _mm512_mask_cmp_ps_mask(in, v, fh, _CMP_LT_OQ);
                __m512i t = _mm512_add_epi32(_mm512_mullo_epi32(_mm512_cvttps_epi32(v), w), _mm512_cvttps_epi32(u));
                __m512 d = _mm512_mask_i32gather_ps(zero, in, t, depth, 4);
                __mmask16 hit = _mm512_mask_cmp_ps_mask(in, d, z, _CMP_LT_OQ);
                count = _mm512_mask_add_epi32(count, hit, count, one);
            }
            __m512 share = _mm512_div_ps(_mm512_cvtepi32_ps(count), _mm512_set1_ps((float)n));
            _mm512_mask_storeu_ps(out, lanes, share);
        }
}
#endif

#ifdef __AVX2__
void avx2_c(int width, int height, int n, const float *depth, const float *positions, const float *offsets,
            const float *m, float *ao)
{
    __m256 k[16];
    for (int q = 0; q < 16; q++)
        k[q] = _mm256_set1_ps(m[q]);
    const __m256 zero = _mm256_setzero_ps(), infinity = _mm256_set1_ps(INFINITY);
    const __m256 fw = _mm256_set1_ps((float)width), fh = _mm256_set1_ps((float)height);
    const __m256i w = _mm256_set1_epi32(width), lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    const __m256i stride = _mm256_mullo_epi32(_mm256_set1_epi32(3), lane);
#pragma omp parallel for schedule(static)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i += 8) {
            const __m256i lanes = _mm256_cmpgt_epi32(_mm256_set1_epi32(width - i), lane);
            float *out = ao + (int64_t)j * width + i;
            const __m256 here = _mm256_maskload_ps(depth + (int64_t)j * width + i, lanes);
            const __m256 on = _mm256_and_ps(_mm256_castsi256_ps(lanes), _mm256_cmp_ps(here, infinity, _CMP_LT_OQ));
            if (!_mm256_movemask_ps(on)) {
                _mm256_maskstore_ps(out, lanes, zero);
                continue;
            }
            const float *p = positions + 3 * ((int64_t)j * width + i);
            __m256 wx = _mm256_mask_i32gather_ps(zero, p, stride, on, 4);
            __m256 wy = _mm256_mask_i32gather_ps(zero, p + 1, stride, on, 4);
            __m256 wz = _mm256_mask_i32gather_ps(zero, p + 2, stride, on, 4);
#define ROW256(r) _mm256_add_ps(_mm256_add_ps(_mm256_add_ps(_mm256_mul_ps(k[4 * r], wx), \
                  _mm256_mul_ps(k[4 * r + 1], wy)), _mm256_mul_ps(k[4 * r + 2], wz)), k[4 * r + 3])
            __m256 px = ROW256(0), py = ROW256(1), pz = ROW256(2);
            __m256i count = _mm256_setzero_si256();
            for (int s = 0; s < n; s++) {
                __m256 x = _mm256_add_ps(px, _mm256_set1_ps(offsets[3 * s]));
                __m256 y = _mm256_add_ps(py, _mm256_set1_ps(offsets[3 * s + 1]));
                __m256 z = _mm256_add_ps(pz, _mm256_set1_ps(offsets[3 * s + 2]));
                __m256 u = _mm256_add_ps(k[14], _mm256_div_ps(x, _mm256_sub_ps(k[12], z)));
                __m256 v = _mm256_add_ps(k[15], _mm256_div_ps(y, _mm256_sub_ps(k[13], z)));
                __m256 in = _mm256_and_ps(on, _mm256_cmp_ps(z, k[12], _CMP_LT_OQ));
                in = _mm256_and_ps(in, _mm256_cmp_ps(z, k[13], _CMP_GT_OQ));
                in = _mm256_and_ps(in, _mm256_cmp_ps(u, zero, _CMP_GE_OQ));
                in = _mm256_and_ps(in, _mm256_cmp_ps(u, fw, _CMP_LT_OQ));
                in = _mm256_and_ps(in, _mm256_cmp_ps(v, zero, _CMP_GE_OQ));
                in = _mm256_and_ps(in, _mm256_cmp_ps(v, fh, _CMP_LT_OQ));
                __m256i t = _mm256_add_epi32(_mm256_mullo_epi32(_mm256_cvttps_epi32(v), w), _mm256_cvttps_epi32(u));
                __m256 d = _mm256_mask_i32gather_ps(zero, depth, t, in, 4);
                __m256 hit = _mm256_and_ps(in, _mm256_cmp_ps(d, z, _CMP_LT_OQ));
                count = _mm256_sub_epi32(count, _mm256_castps_si256(hit));
            }
            __m256 share = _mm256_div_ps(_mm256_cvtepi32_ps(count), _mm256_set1_ps((float)n));
            _mm256_maskstore_ps(out, lanes, share);
        }
}
#endif
