/* The passes of the multi-resolution estimator (lfssao/kernels/multiresolution.py), float32, as a C programmer writes them:
 * with -ffp-contract=off they give lfssao's bits. A level is a texture of texel numbers, -1 for no surface.
 */
#include <math.h>
#include <stdint.h>

void first_level(int width, int height, const float *depth, int32_t *level)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++)
            level[(int64_t)j * width + i] = depth[(int64_t)j * width + i] < INFINITY ? j * width + i : -1;
}

/* The lower median by depth of the up to four texels that see a surface, by insertion. */
void halve(int width, int height, const float *depth, const int32_t *fine, int32_t *coarse)
{
    const int w = (width + 1) / 2, h = (height + 1) / 2;
#pragma omp parallel for schedule(static)
    for (int j = 0; j < h; j++)
        for (int i = 0; i < w; i++) {
            int32_t sorted[4];
            int seen = 0;
            for (int k = 0; k < 4; k++) {
                const int y = 2 * j + k / 2, x = 2 * i + k % 2;
                if (y >= height || x >= width)
                    continue;
                const int32_t texel = fine[(int64_t)y * width + x];
                if (texel < 0)
                    continue;
                int at = seen++;
                for (; at > 0 && depth[texel] < depth[sorted[at - 1]]; at--)
                    sorted[at] = sorted[at - 1];
                sorted[at] = texel;
            }
            coarse[(int64_t)j * w + i] = seen ? sorted[(seen - 1) / 2] : -1;
        }
}

void level_occlusion(int width, int height, const int32_t *level, const float *places, const float *facing, int reach,
                     float squared, float *occlusion)
{
    const float number = (float)((2 * reach + 1) * (2 * reach + 1) - 1);
#pragma omp parallel for schedule(dynamic, 8)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            const int32_t at = level[(int64_t)j * width + i];
            float total = 0;
            occlusion[(int64_t)j * width + i] = 0;
            if (at < 0)
                continue;
            const float *p = places + 3 * (int64_t)at, *n = facing + 3 * (int64_t)at;
            for (int y = j - reach < 0 ? 0 : j - reach; y <= j + reach && y < height; y++)
                for (int x = i - reach < 0 ? 0 : i - reach; x <= i + reach && x < width; x++) {
                    const int32_t tap = level[(int64_t)y * width + x];
                    if (tap < 0 || tap == at)
                        continue;
                    const float *q = places + 3 * (int64_t)tap;
                    const float vx = q[0] - p[0], vy = q[1] - p[1], vz = q[2] - p[2];
                    const float d = (vx * vx + vy * vy) + vz * vz, above = (vx * n[0] + vy * n[1]) + vz * n[2];
                    if (d > 0 && d < squared && above > 0)
                        total += (1 - d / squared) * (above / sqrtf(d));
                }
            occlusion[(int64_t)j * width + i] = total / number;
        }
}

static inline float weight(const float *p, const float *n, const float *q, const float *m, float radius)
{
    float s = (q[0] - p[0]) * n[0] + (q[1] - p[1]) * n[1];
    s = fabsf(s + (q[2] - p[2]) * n[2]);
    float a = (n[0] * m[0] + n[1] * m[1]) + n[2] * m[2];
    a = 0.5f * (1 + a);
    a *= a, a *= a, a *= a;
    float b = radius + s;
    b = b > 0 && b < INFINITY ? radius / b : 0;
    b *= b, b *= b, b *= b, b *= b;
    return a * b < INFINITY ? a * b : 0;
}

void refine(int width, int height, const int32_t *fine, const int32_t *coarse, const float *places, const float *facing,
            float radius, const float *coarse_most, const float *coarse_sum, float *most, float *total)
{
    const int w = (width + 1) / 2, h = (height + 1) / 2;
#pragma omp parallel for schedule(dynamic, 8)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            const int64_t here = (int64_t)j * width + i;
            const int64_t p = fine[here];
            float weights = 0, high = 0, mean = 0;
            if (p < 0)
                continue;
            for (int k = 0; k < 4; k++) {
                const int y = j / 2 + (k / 2) * (2 * (j % 2) - 1), x = i / 2 + (k % 2) * (2 * (i % 2) - 1);
                if (y < 0 || y >= h || x < 0 || x >= w || coarse[(int64_t)y * w + x] < 0)
                    continue;
                const int64_t at = (int64_t)y * w + x, q = coarse[at];
                const float one = (float)((3 - 2 * (k / 2)) * (3 - 2 * (k % 2)))
                    * weight(places + 3 * p, facing + 3 * p, places + 3 * q, facing + 3 * q, radius);
                weights += one;
                high += one * coarse_most[at];
                mean += one * coarse_sum[at];
            }
            if (weights > 0) {
                high /= weights;
                most[here] = high > most[here] ? high : most[here];
                total[here] += mean / weights;
            }
        }
}
