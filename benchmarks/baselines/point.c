/* LF's algorithms, the half ball and Alchemy AO on a flat display with the linear diffuser, float32, one loop nest per texel
 * and sample, as a C programmer writes them down: baselines for lfssao's numba kernels.
 *
 * All write the operations in lfssao's order; compiled with -ffp-contract=off they give its bits.
 */
#include "elementary.h"

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

/* offsets: n x 3, world units. ends: n x 4, the same after the rows' linear part. half: turn those below the surface. */
void share_behind(int width, int height, int n, const float *depth, const float *positions, const float *normals,
                const float *offsets, const float *ends, const float *m, int half, float *ao)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            NEXT
            const int64_t here = (int64_t)j * width + i;
            const float *p = positions + 3 * here, *up = normals + 3 * here;
            ao[here] = 0;
            if (!(depth[here] < INFINITY))
                continue;
            float a = row(m, 0, p), b = row(m, 1, p), c = row(m, 2, p);
            int count = 0;
            for (int s = 0; s < n; s++) {
                NEXT
                const float *o = offsets + 3 * s, *e = ends + 4 * s;
                float t = half && (o[0] * up[0] + o[1] * up[1]) + o[2] * up[2] < 0 ? -1.0f : 1.0f;
                float z = c + t * e[2];
                int64_t q = texel_of(width, height, m, a + t * e[0], b + t * e[1], z);
                count += q >= 0 && depth[q] < z;
            }
            ao[here] = (float)count / (float)n;
        }
}

/* away: four numbers of the distance from the viewers. epsilon: squared world units; scale: 2 sigma / s; k is 1. */
void alchemy(int width, int height, int n, const float *depth, const float *positions, const float *normals,
             const float *directions, const float *taps, const float *turns, const float *m, const float *away,
             float radius, float beta, float epsilon, float scale, float *ao)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            NEXT
            const int64_t here = (int64_t)j * width + i;
            const float *p = positions + 3 * here, *up = normals + 3 * here, *d = directions + 3 * here;
            ao[here] = 0;
            if (!(depth[here] < INFINITY))
                continue;
            const float cosine = turns[here], sine = turns[(int64_t)width * height + here];
            const float sign = d[2] >= 0 ? 1 : -1, q = -1 / (sign + d[2]);
            const float b = d[0] * d[1] * q;
            const float one[3] = {radius * (1 + sign * d[0] * d[0] * q), radius * (sign * b), radius * (-sign * d[0])};
            const float two[3] = {radius * b, radius * (sign + d[1] * d[1] * q), radius * -d[1]};
            float far = ((away[0] * p[0] + away[1] * p[1]) + away[2] * p[2]) + away[3];
            float bias = beta * (far > 0 ? far : 0), total = 0, at[3], first[3], second[3];
            for (int k = 0; k < 3; k++) {
                at[k] = row(m, k, p);
                first[k] = linear(m, k, one);
                second[k] = linear(m, k, two);
            }
            for (int s = 0; s < n; s++) {
                NEXT
                float x = taps[2 * s] * cosine - taps[2 * s + 1] * sine;
                float y = taps[2 * s] * sine + taps[2 * s + 1] * cosine;
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

/* Points of the half ball around the normal, smooth range check, nothing beyond background. kernel: n x 3, z >= 0.
 * axes: the display's right and up. */
void oriented(int width, int height, int n, const float *depth, const float *positions, const float *normals,
              const float *kernel, const float *turns, const float *axes, const float *m, float radius, float reach,
              float bias, float *ao)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            NEXT
            const int64_t here = (int64_t)j * width + i;
            const float *p = positions + 3 * here, *up = normals + 3 * here;
            ao[here] = 0;
            if (!(depth[here] < INFINITY))
                continue;
            const float cosine = turns[here], sine = turns[(int64_t)width * height + here];
            float r[3];
            for (int k = 0; k < 3; k++)
                r[k] = cosine * axes[k] + sine * axes[3 + k];
            const float along = (up[0] * r[0] + up[1] * r[1]) + up[2] * r[2];
            float t[3], at[3], first[3], second[3], third[3], total = 0;
            for (int k = 0; k < 3; k++)
                t[k] = r[k] - along * up[k];
            const float scale = 1 / sqrtf((t[0] * t[0] + t[1] * t[1]) + t[2] * t[2]);
            for (int k = 0; k < 3; k++)
                t[k] *= scale;
            const float b[3] = {up[1] * t[2] - up[2] * t[1], up[2] * t[0] - up[0] * t[2], up[0] * t[1] - up[1] * t[0]};
            for (int k = 0; k < 3; k++) {
                at[k] = row(m, k, p);
                first[k] = radius * linear(m, k, t), second[k] = radius * linear(m, k, b);
                third[k] = radius * linear(m, k, up);
            }
            for (int s = 0; s < n; s++) {
                NEXT
                float image[3];
                for (int k = 0; k < 3; k++)
                    image[k] = ((at[k] + kernel[3 * s] * first[k]) + kernel[3 * s + 1] * second[k])
                               + kernel[3 * s + 2] * third[k];
                const int64_t q = texel_of(width, height, m, image[0], image[1], image[2]);
                if (q < 0 || !(depth[q] < INFINITY) || !(image[2] - depth[q] >= bias))
                    continue;
                const float d = fabsf(at[2] - depth[q]), x = d > reach ? reach / d : 1;
                total += (x * x) * (3 - (x + x));
            }
            total /= (float)n;
            ao[here] = total > 0 ? total < 1 ? total : 1 : 0;
        }
}

/* LF Algorithm 1, lines 1 to 3: to_world, rows of four, screen -> world. */
void unproject(int width, int height, const float *depth, const float *to_world, float *positions)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            NEXT
            const int64_t here = (int64_t)j * width + i;
            const float at[3] = {(float)i + 0.5f, (float)j + 0.5f, depth[here]}, w = row(to_world, 3, at);
            for (int k = 0; k < 3; k++)
                positions[3 * here + k] = row(to_world, k, at) / w;
        }
}

/* LF Algorithm 2, the full ball. offsets: n x 4, after m's linear part; matrix: whether m is a camera's. */
void algorithm2(int width, int height, int n, const float *depth, const float *positions, const float *offsets,
                const float *m, int matrix, float *ao)
{
#pragma omp parallel for schedule(static)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            NEXT
            const int64_t here = (int64_t)j * width + i;
            const float *p = positions + 3 * here;
            ao[here] = 0;
            if (!(depth[here] < INFINITY))
                continue;
            const float a = row(m, 0, p), b = row(m, 1, p), c = row(m, 2, p), d = matrix ? row(m, 3, p) : 0;
            int count = 0;
            if (matrix)
                for (int s = 0; s < n; s++) {
                    NEXT
                    const float *o = offsets + 4 * s, q = d + o[3];
                    const float u = (a + o[0]) / q, v = (b + o[1]) / q, z = (c + o[2]) / q;
                    if (q > 0 && u >= 0 && u < width && v >= 0 && v < height)
                        count += depth[(int64_t)(int)v * width + (int)u] < z;
                }
            else
                for (int s = 0; s < n; s++) {
                    NEXT
                    const float *o = offsets + 4 * s, z = c + o[2];
                    const int64_t q = texel_of(width, height, m, a + o[0], b + o[1], z);
                    count += q >= 0 && depth[q] < z;
                }
            ao[here] = (float)count / (float)n;
        }
}
