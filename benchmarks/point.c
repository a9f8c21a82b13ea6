/* The estimators 'hemisphere' and 'alchemy' on a flat display with the linear diffuser, float32, one loop nest per texel
 * and sample, as a C programmer writes them down: the peers of lfssao's numba kernels.
 *
 * All write the operations in lfssao's order; compiled with -ffp-contract=off they give its bits.
 */
#include <stdint.h>
#include <math.h>

/* Depth and texel of the image point of world point P + offset, (x, y, z) after the affine rows; -1 outside. */
static inline int64_t texel_of(int width, int height, const float *m, float x, float y, float z)
{
    float u = m[14] + x / (m[12] - z), v = m[15] + y / (m[13] - z);
    if (!(z < m[12] && z > m[13] && u >= 0 && u < width && v >= 0 && v < height))
        return -1;
    return (int64_t)(int)v * width + (int)u;
}

static inline float row(const float *m, int k, const float *p)
{
    return ((m[4 * k] * p[0] + m[4 * k + 1] * p[1]) + m[4 * k + 2] * p[2]) + m[4 * k + 3];
}

static inline float linear(const float *m, int k, const float *p)
{
    return (m[4 * k] * p[0] + m[4 * k + 1] * p[1]) + m[4 * k + 2] * p[2];
}

/* offsets: n x 3, world units. ends: n x 3, the same after the rows' linear part. */
void hemisphere(int width, int height, int n, const float *depth, const float *positions, const float *normals,
                const float *offsets, const float *ends, const float *m, float *ao)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            const int64_t here = (int64_t)j * width + i;
            const float *p = positions + 3 * here, *up = normals + 3 * here;
            ao[here] = 0;
            if (!(depth[here] < INFINITY))
                continue;
            float a = row(m, 0, p), b = row(m, 1, p), c = row(m, 2, p);
            int count = 0;
            for (int s = 0; s < n; s++) {
                const float *o = offsets + 3 * s, *e = ends + 3 * s;
                float t = (o[0] * up[0] + o[1] * up[1]) + o[2] * up[2] < 0 ? -1.0f : 1.0f;
                float z = c + t * e[2];
                int64_t q = texel_of(width, height, m, a + t * e[0], b + t * e[1], z);
                count += q >= 0 && depth[q] < z;
            }
            ao[here] = (float)count / (float)n;
        }
}

/* turns: cosine and sine of each texel's rotation; axes: six numbers a texel, the disk's axes times the radius. away:
 * four numbers. numbers: beta, epsilon, 2 sigma / s; k is 1. */
void alchemy(int width, int height, int n, const float *depth, const float *positions, const float *normals,
             const float *turns, const float *axes, const float *taps, const float *m, const float *away,
             const float *numbers, float *ao)
{
    const float beta = numbers[0], epsilon = numbers[1], scale = numbers[2];
#pragma omp parallel for schedule(static)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            const int64_t here = (int64_t)j * width + i;
            const float *p = positions + 3 * here, *up = normals + 3 * here, *one = axes + 6 * here, *two = one + 3;
            ao[here] = 0;
            if (!(depth[here] < INFINITY))
                continue;
            float far = ((away[0] * p[0] + away[1] * p[1]) + away[2] * p[2]) + away[3];
            float bias = beta * (far > 0 ? far : 0), total = 0, at[3], first[3], second[3];
            for (int k = 0; k < 3; k++) {
                at[k] = row(m, k, p);
                first[k] = linear(m, k, one);
                second[k] = linear(m, k, two);
            }
            for (int s = 0; s < n; s++) {
                float x = taps[2 * s] * turns[2 * here] - taps[2 * s + 1] * turns[2 * here + 1];
                float y = taps[2 * s] * turns[2 * here + 1] + taps[2 * s + 1] * turns[2 * here];
                int64_t q = texel_of(width, height, m, at[0] + (x * first[0] + y * second[0]),
                                     at[1] + (x * first[1] + y * second[1]), at[2] + (x * first[2] + y * second[2]));
                if (q < 0 || !(depth[q] < INFINITY))
                    continue;
                float vx = positions[3 * q] - p[0], vy = positions[3 * q + 1] - p[1], vz = positions[3 * q + 2] - p[2];
                float above = ((vx * up[0] + vy * up[1]) + vz * up[2]) - bias;
                float square = ((vx * vx + vy * vy) + vz * vz) + epsilon;
                if (above > 0 && square > 0 && square < INFINITY)
                    total += above / square;
            }
            float a = 1 - scale * total;
            ao[here] = 1 - (a > 0 ? a : 0);
        }
}
