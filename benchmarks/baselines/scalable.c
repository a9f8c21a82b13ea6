/* The passes of Scalable Ambient Obscurance, float32, one loop nest a pass as a C programmer writes the paper down: the
 * baselines for lfssao's numba kernels. Operations stand in lfssao's order; with -ffp-contract=off they give its bits.
 */
#include <math.h>
#include <stdint.h>

static int find_msb(int h)
{
    return h > 0 ? 31 - __builtin_clz((unsigned)h) : -1;
}

/* lines: u_c, a, b, c, d for x, then for y; m: rows of four, cast space -> world; first: place of each level. k: reach_u,
 * reach_v, inverse radius, 1 for the appendix's falloff, bias, bias of depth, origin of depth, epsilon. */
void sampling(int width, int height, const float *z, const float *pyramid, const int32_t *first, int levels,
              const float *positions, const float *normals, const float *rotations, const float *taps, int s,
              const float *lines, const float *m, const float *k, int log_q, float *sums)
{
#pragma omp parallel for schedule(static, 8)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            int64_t t = (int64_t)j * width + i;
            sums[t] = 0;
            if (!(z[t] < INFINITY))
                continue;
            float r_u = k[0] / fabsf(lines[2] + z[t] * lines[4]), r_v = k[1] / fabsf(lines[7] + z[t] * lines[9]);
            r_u = r_u < 1048576.0f ? r_u : 1048576.0f;
            r_v = r_v < 1048576.0f ? r_v : 1048576.0f;
            float cosine = rotations[t], sine = rotations[(int64_t)width * height + t], total = 0;
            const float less = k[4] + k[5] * (z[t] - k[6]);
            const float *c = positions + 3 * t, *n = normals + 3 * t;
            for (int tap = 0; tap < s; tap++) {
                float tx = taps[3 * tap], ty = taps[3 * tap + 1], alpha = taps[3 * tap + 2];
                float h_u = r_u * alpha, h_v = r_v * alpha;
                float x = (float)i + h_u * (tx * cosine - ty * sine), y = (float)j + h_v * (tx * sine + ty * cosine);
                if (!(x >= 0 && x < (float)width && y >= 0 && y < (float)height))
                    continue;
                int column = (int)x, row = (int)y;
                if (column == i && row == j)
                    continue;
                int level = find_msb((int)(h_u > h_v ? h_u : h_v)) - log_q;
                level = level < 0 ? 0 : level > levels - 1 ? levels - 1 : level;
                int span = (width + (1 << level) - 1) >> level;
                float d = pyramid[first[level] + (row >> level) * span + (column >> level)];
                if (!(d < INFINITY))
                    continue;
                float at_u = ((float)column + 0.5f) - lines[0], at_v = ((float)row + 0.5f) - lines[5];
                float qx = (lines[1] + lines[2] * at_u) + d * (lines[3] + lines[4] * at_u);
                float qy = (lines[6] + lines[7] * at_v) + d * (lines[8] + lines[9] * at_v);
                float a = ((((m[0] * qx + m[1] * qy) + m[2] * d) + m[3]) - c[0]) * k[2];
                float b = ((((m[4] * qx + m[5] * qy) + m[6] * d) + m[7]) - c[1]) * k[2];
                float e = ((((m[8] * qx + m[9] * qy) + m[10] * d) + m[11]) - c[2]) * k[2];
                float square = (a * a + b * b) + e * e, above = ((a * n[0] + b * n[1]) + e * n[2]) - less;
                float left = 1 - k[3] * square;
                if (above > 0 && left > 0)
                    total += ((left * left) * left) * (above / (square + k[7]));
            }
            sums[t] = total;
        }
}

static float tap_weight(float gauss, float key, float centre, float sharpness)
{
    float near = 1 - sharpness * fabsf(key - centre);
    return gauss * (near > 0 ? near : 0);
}

void bilateral(int width, int height, const float *values, const float *keys, const float *weights, float sharpness,
               int vertical, float *target)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            float total = 0, weight = 0, centre = keys[(int64_t)j * width + i];
            for (int k = 0; k < 7; k++) {
                int x = vertical ? i : i + (k - 3) * 3, y = vertical ? j + (k - 3) * 3 : j;
                if (x < 0 || x >= width || y < 0 || y >= height)
                    continue;
                float w = tap_weight(weights[k], keys[(int64_t)y * width + x], centre, sharpness);
                total += w * values[(int64_t)y * width + x];
                weight += w;
            }
            target[(int64_t)j * width + i] = weight > 0 ? total / weight : 1;
        }
}

void quads(int width, int height, const float *visibility, const float *z, float edge, float *target)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < height; j += 2) {
        for (int y = j; y < height && y < j + 2; y++)
            for (int i = 0; i < width; i++) {
                int64_t t = (int64_t)y * width + i, o = (int64_t)y * width + (i ^ 1);
                target[t] = visibility[t];
                if ((i ^ 1) < width && fabsf(z[t] - z[o]) < edge)
                    target[t] = (visibility[i & 1 ? o : t] + visibility[i & 1 ? t : o]) * 0.5f;
            }
        if (j + 1 < height)
            for (int i = 0; i < width; i++) {
                int64_t t = (int64_t)j * width + i, o = t + width;
                if (fabsf(z[t] - z[o]) < edge)
                    target[t] = target[o] = (target[t] + target[o]) * 0.5f;
            }
    }
}
