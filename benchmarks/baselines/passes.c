/* Passes over whole textures, float32, one loop nest a pass as a C programmer writes it down: baselines for lfssao's numba
 * kernels. Operations stand in lfssao's order; with -ffp-contract=off they give its bits.
 */
#include <fenv.h>
#include <math.h>
#include <omp.h>
#include <stdint.h>
#include <string.h>
#include "elementary.h"

#define ROWS _Pragma("omp parallel for schedule(static)") for (int j = 0; j < height; j++)

void set_threads(int n)
{
    omp_set_num_threads(n);
}

static uint64_t random_state;

/* Where the directions of rounding begin, of the calling thread; 0 rounds to nearest again. */
void set_rounding(uint64_t seed)
{
    random_state = seed;
    fesetround(FE_TONEAREST);
}

void next_rounding(void)
{
    static const int ways[] = {FE_TONEAREST, FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO};
    random_state ^= random_state << 13, random_state ^= random_state >> 7, random_state ^= random_state << 17;
    fesetround(ways[random_state >> 62]);
}

/* As many bytes as a pass must move, with nothing done to them. */
void copy(const char *from, char *to, int64_t bytes)
{
#pragma omp parallel for schedule(static)
    for (int64_t block = 0; block < bytes / 4096; block++)
        memcpy(to + 4096 * block, from + 4096 * block, 4096);
}

void linear_depth(int width, int height, const float *depth, float c_0, float c_1, float c_2, float *z)
{
    ROWS for (int i = 0; i < width; i++) {
        const float d = depth[(int64_t)j * width + i], below = d * c_1 + c_2;
        z[(int64_t)j * width + i] = d < INFINITY && below > 0 ? c_0 / below : INFINITY;
    }
}

/* Unit directions of the texels' rays, computed in double. kind: 0 a flat display's module, 1 a camera. */
void directions(int width, int height, int kind, const double *lens, const double *m, float *out)
{
    ROWS for (int i = 0; i < width; i++) {
        float *d = out + 3 * ((int64_t)j * width + i);
        double dx = 0, dy = 0;
        if (kind == 0)
            dx = (lens[0] - ((i + 0.5) - lens[5]) / lens[4]) / lens[1], dy = (lens[2] - ((j + 0.5) - lens[7]) / lens[6]) / lens[3];
        else if (lens[6] == 0)
            dx = ((i + 0.5) - lens[2]) / lens[0], dy = (lens[3] - (j + 0.5)) / lens[1];
        const double x = (m[0] * dx + m[1] * dy) + m[2], y = (m[4] * dx + m[5] * dy) + m[6], z = (m[8] * dx + m[9] * dy) + m[10];
        const double length = sqrt((x * x + y * y) + z * z);
        d[0] = length > 0 ? x / length : 0, d[1] = length > 0 ? y / length : 0, d[2] = length > 0 ? z / length : 0;
    }
}

/* lines: u_c, a, b, c, d for x, then for y; m: rows of four, cast space -> world. */
void positions(int width, int height, const float *z, const float *lines, const float *m, float *out)
{
    ROWS for (int i = 0; i < width; i++) {
        const int64_t t = (int64_t)j * width + i;
        const float d = z[t], u = ((float)i + 0.5f) - lines[0], v = ((float)j + 0.5f) - lines[5];
        const float x = (lines[1] + lines[2] * u) + d * (lines[3] + lines[4] * u);
        const float y = (lines[6] + lines[7] * v) + d * (lines[8] + lines[9] * v);
        for (int k = 0; k < 3; k++)
            out[3 * t + k] = d < INFINITY ? ((m[4 * k] * x + m[4 * k + 1] * y) + m[4 * k + 2] * d) + m[4 * k + 3] : INFINITY;
    }
}

static inline void unit(float *v)
{
    const float size = fmaxf(fmaxf(fabsf(v[0]), fabsf(v[1])), fabsf(v[2]));
    if (!(size > 0)) {
        v[0] = v[1] = v[2] = 0;
        return;
    }
    const float x = v[0] / size, y = v[1] / size, z = v[2] / size, length = sqrtf((x * x + y * y) + z * z);
    v[0] = x / length, v[1] = y / length, v[2] = z / length;
}

/* The texel that the difference of texel t, the place-th of its row or column, is taken to: one step on or back. */
static inline int64_t partner(const float *z, int64_t t, int place, int count, int64_t step)
{
    const int way = place & 1 ? -1 : 1;
    if (place + way >= 0 && place + way < count && z[t + way * step] < INFINITY)
        return t + way * step;
    if (place - way >= 0 && place - way < count && z[t - way * step] < INFINITY)
        return t - way * step;
    return t;
}

void face_normals(int width, int height, const float *z, const float *positions, const float *lines, const float *m,
                  float *normals)
{
    ROWS for (int i = 0; i < width; i++) {
        const int64_t t = (int64_t)j * width + i;
        float *n = normals + 3 * t;
        if (!(z[t] < INFINITY)) {
            n[0] = n[1] = n[2] = 0;
            continue;
        }
        const float *p = positions + 3 * t;
        const float *a = positions + 3 * partner(z, t, i, width, 1), *b = positions + 3 * partner(z, t, j, height, width);
        const float ax = a[0] - p[0], ay = a[1] - p[1], az = a[2] - p[2];
        const float bx = b[0] - p[0], by = b[1] - p[1], bz = b[2] - p[2];
        float up[3] = {ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx};
        unit(up);
        const float dx = lines[3] + lines[4] * (((float)i + 0.5f) - lines[0]);
        const float dy = lines[8] + lines[9] * (((float)j + 0.5f) - lines[5]);
        float ray[3];
        for (int k = 0; k < 3; k++)
            ray[k] = (m[4 * k] * dx + m[4 * k + 1] * dy) + m[4 * k + 2];
        const float away = (up[0] * ray[0] + up[1] * ray[1]) + up[2] * ray[2];
        if (!(away > 0) && !(away < 0)) {
            for (int k = 0; k < 3; k++)
                up[k] = -ray[k];
            unit(up);
        }
        for (int k = 0; k < 3; k++)
            n[k] = away > 0 ? -up[k] : up[k];
    }
}

static inline float farther(float a, float b)
{
    return a >= b ? a : b;
}

static inline float nearer(float a, float b)
{
    return a <= b ? a : b;
}

static inline float mean(float a, float b, float c, float d)
{
    return (((a + b) + c) + d) * 0.25f;
}

/* how: 0 rotated grid, 1 arithmetic mean, 2 harmonic mean, 3 min, 4 max (of the paper's negative z). */
void next_level(int width, int height, const float *source, int how, float origin, float *target)
{
    const int w = (width + 1) / 2, h = (height + 1) / 2;
#pragma omp parallel for schedule(static)
    for (int y = 0; y < h; y++) {
        const float *top = source + (int64_t)2 * y * width, *bottom = 2 * y + 1 < height ? top + width : top;
        float *out = target + (int64_t)y * w;
        for (int x = 0; x < w; x++) {
            const int left = 2 * x, right = 2 * x + 1 < width ? 2 * x + 1 : width - 1;
            if (how == 0) {
                out[x] = (x & 1 ? top : bottom)[y & 1 ? left : right];
                continue;
            }
            const float a = top[left], b = top[right], c = bottom[left], d = bottom[right];
            if (how == 1)
                out[x] = mean(a, b, c, d);
            else if (how == 3)
                out[x] = farther(farther(a, b), farther(c, d));
            else if (how == 4)
                out[x] = nearer(nearer(a, b), nearer(c, d));
            else {
                const float e = a - origin, f = b - origin, g = c - origin, k = d - origin;
                out[x] = e > 0 && f > 0 && g > 0 && k > 0
                    ? 1 / ((((1 / e + 1 / f) + 1 / g) + 1 / k) * 0.25f) + origin : mean(a, b, c, d);
            }
        }
    }
}

void through_bytes(int width, int height, const float *visibility, const float *keys, float *values, float *depths)
{
    ROWS for (int i = 0; i < width; i++) {
        const int64_t t = (int64_t)j * width + i;
        values[t] = (float)(int)(visibility[t] * 255 + 0.5f) / 255;
        depths[t] = INFINITY;
        if (!(keys[t] < INFINITY))
            continue;
        const float scaled = keys[t] * 256;
        const int high = (int)scaled < 255 ? (int)scaled : 255;
        int low = (int)((scaled - (float)high) * 255 + 0.5f);
        low = low < (high == 255 ? 254 : 255) ? low : (high == 255 ? 254 : 255);
        depths[t] = ((float)high + (float)low / 255) * (1.0f / 256);
    }
}

/* 1 - A^k for k = 1. */
void occlusion_of(int width, int height, const float *visibility, const float *z, float *occlusion)
{
    ROWS for (int i = 0; i < width; i++)
        occlusion[(int64_t)j * width + i] = z[(int64_t)j * width + i] < INFINITY
            ? 1 - visibility[(int64_t)j * width + i] : 0;
}

static inline int held(int i, int count)
{
    return i < 0 ? 0 : i < count ? i : count - 1;
}

void blur_horizontal(int width, int height, const float *source, const float *weights, int taps, float *target)
{
    ROWS for (int i = 0; i < width; i++) {
        float sum = 0;
        for (int k = 0; k < taps; k++)
            sum += weights[k] * source[(int64_t)j * width + held(i + k - taps / 2, width)];
        target[(int64_t)j * width + i] = sum;
    }
}

void blur_vertical(int width, int height, const float *source, const float *weights, int taps, float *target)
{
    ROWS for (int i = 0; i < width; i++) {
        float sum = 0;
        for (int k = 0; k < taps; k++)
            sum += weights[k] * source[(int64_t)held(j + k - taps / 2, height) * width + i];
        target[(int64_t)j * width + i] = sum;
    }
}
