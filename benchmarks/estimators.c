/* The estimators' loops as a C programmer writes them, one texel and one sample at a time, float32, flat displays with
 * the linear diffuser: the peers of lfssao's numba kernels. Operations stand in lfssao's order; compiled with
 * -ffp-contract=off they give its bits.
 *
 * rows: u, v, divisor (unused here) and cast z, rows of four; lens: z_m, z_o, u_0, v_0 (lfssao/kernels/neighbourhood.py).
 */
#include <math.h>
#include <stdint.h>

typedef struct { int width, height; const float *depth, *positions, *directions, *normals, *rows, *lens, *right; } Scene;
typedef struct { float p[3], u, v, z, eu, ev, ez, fu, fv, fz, steep, slope1, slope2; const float *w; int seen; } Texel;

static float linear_row(const float *m, int k, float x, float y, float z)
{
    return (m[4 * k] * x + m[4 * k + 1] * y) + m[4 * k + 2] * z;
}

static Texel texel_at(const Scene *s, float radius, const float *turns, int tangent, int j, int i)
{
    Texel t;
    const int64_t k = (int64_t)j * s->width + i;
    const float *p = s->positions + 3 * k, *w = s->directions + 3 * k, *r = s->right, *m = s->rows;
    const float c = turns[(j & 3) * 256 + (i & 3)], sn = turns[1024 + (j & 3) * 256 + (i & 3)];
    t.w = w;
    t.p[0] = p[0], t.p[1] = p[1], t.p[2] = p[2];
    const float deep = radius * linear_row(m, 3, w[0], w[1], w[2]);
    t.seen = s->depth[k] < INFINITY && deep > 0;
    t.steep = 1 / deep;
    const float along = (r[0] * w[0] + r[1] * w[1]) + r[2] * w[2];
    float ax = r[0] - along * w[0], ay = r[1] - along * w[1], az = r[2] - along * w[2];
    const float scale = 1 / sqrtf((ax * ax + ay * ay) + az * az);
    ax *= scale, ay *= scale, az *= scale;
    const float bx = w[1] * az - w[2] * ay, by = w[2] * ax - w[0] * az, bz = w[0] * ay - w[1] * ax;
    const float ex = c * ax + sn * bx, ey = c * ay + sn * by, ez = c * az + sn * bz;
    const float fx = sn * ax - c * bx, fy = sn * ay - c * by, fz = sn * az - c * bz;
    t.u = linear_row(m, 0, p[0], p[1], p[2]) + m[3];
    t.v = linear_row(m, 1, p[0], p[1], p[2]) + m[7];
    t.z = linear_row(m, 3, p[0], p[1], p[2]) + m[15];
    t.eu = radius * linear_row(m, 0, ex, ey, ez), t.fu = radius * linear_row(m, 0, fx, fy, fz);
    t.ev = radius * linear_row(m, 1, ex, ey, ez), t.fv = radius * linear_row(m, 1, fx, fy, fz);
    t.ez = radius * linear_row(m, 3, ex, ey, ez), t.fz = radius * linear_row(m, 3, fx, fy, fz);
    if (tangent) {
        const float *n = s->normals + 3 * k;
        float towards = -((n[0] * w[0] + n[1] * w[1]) + n[2] * w[2]);
        towards = towards > 0x1p-20f ? towards : 0x1p-20f;
        t.slope1 = ((n[0] * ex + n[1] * ey) + n[2] * ez) / towards;
        t.slope2 = ((n[0] * fx + n[1] * fy) + n[2] * fz) / towards;
    }
    return t;
}

/* The image point and cast z of rows a, b, z; whether it lies in the texture. */
static int project(const Scene *s, float a, float b, float z, float *u, float *v)
{
    *u = s->lens[2] + a / (s->lens[0] - z);
    *v = s->lens[3] + b / (s->lens[1] - z);
    return z < s->lens[0] && z > s->lens[1] && *u >= 0 && *u < s->width && *v >= 0 && *v < s->height;
}

#define SCENE const Scene scene = {width, height, depth, positions, directions, normals, rows, lens, right}
#define ARRAYS int width, int height, const float *depth, const float *positions, const float *directions, \
    const float *normals, const float *rows, const float *lens, const float *right, float radius

void vo_lines(ARRAYS, const float *turns, int n, const float *disk, const float *half, const float *weights, float *ao)
{
    SCENE;
#pragma omp parallel for schedule(dynamic, 8)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            float total = 0;
            ao[(int64_t)j * width + i] = 0;
            if (!(depth[(int64_t)j * width + i] < INFINITY))
                continue;
            const Texel t = texel_at(&scene, radius, turns, 0, j, i);
            if (!t.seen)
                continue;
            for (int k = 0; k < n; k++) {
                const float x = disk[2 * k], y = disk[2 * k + 1], z_s = half[k];
                const float z = (t.z + x * t.ez) + y * t.fz;
                float u, v;
                if (!project(&scene, (t.u + x * t.eu) + y * t.fu, (t.v + x * t.ev) + y * t.fv, z, &u, &v))
                    continue;
                const float d = (depth[(int64_t)(int)v * width + (int)u] - z) * t.steep;
                const float length = z_s - (d < -z_s ? -z_s : d);
                if (length > 0)
                    total += weights[k] * length;
            }
            ao[(int64_t)j * width + i] = total < 1 ? total : 1;
        }
}

void vo_points(ARRAYS, const float *mirrors, int n, const float *ball, const float *weights, float *ao)
{
    SCENE;
#pragma omp parallel for schedule(dynamic, 8)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            const int64_t at = (int64_t)j * width + i;
            float total = 0;
            ao[at] = 0;
            if (!(depth[at] < INFINITY))
                continue;
            const float *p = positions + 3 * at, *r = mirrors + (j & 3) * 256 + (i & 3), two = radius + radius;
            const float rx = r[0], ry = r[1024], rz = r[2048];
            const float mu = two * linear_row(rows, 0, rx, ry, rz), mv = two * linear_row(rows, 1, rx, ry, rz);
            const float mz = two * linear_row(rows, 3, rx, ry, rz);
            const float pu = linear_row(rows, 0, p[0], p[1], p[2]) + rows[3];
            const float pv = linear_row(rows, 1, p[0], p[1], p[2]) + rows[7];
            const float pz = linear_row(rows, 3, p[0], p[1], p[2]) + rows[15];
            for (int k = 0; k < n; k++) {
                const float x = ball[3 * k], y = ball[3 * k + 1], z_o = ball[3 * k + 2];
                const float mirror = (x * rx + y * ry) + z_o * rz;
                const float z = (pz + radius * linear_row(rows, 3, x, y, z_o)) - mirror * mz;
                const float a = (pu + radius * linear_row(rows, 0, x, y, z_o)) - mirror * mu;
                const float b = (pv + radius * linear_row(rows, 1, x, y, z_o)) - mirror * mv;
                float u, v;
                if (project(&scene, a, b, z, &u, &v) && z - depth[(int64_t)(int)v * width + (int)u] > 0)
                    total += weights[k];
            }
            ao[at] = total < 1 ? total : 1;
        }
}

void hbao(ARRAYS, const float *turns, int n, const float *around, int steps, float *ao)
{
    SCENE;
#pragma omp parallel for schedule(dynamic, 8)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            float total = 0;
            ao[(int64_t)j * width + i] = 0;
            if (!(depth[(int64_t)j * width + i] < INFINITY))
                continue;
            const Texel t = texel_at(&scene, radius, turns, 1, j, i);
            if (!t.seen)
                continue;
            for (int k = 0; k < n; k++) {
                const float x = around[2 * k], y = around[2 * k + 1], z = (t.z + x * t.ez) + y * t.fz;
                float u1, v1;
                project(&scene, (t.u + x * t.eu) + y * t.fu, (t.v + x * t.ev) + y * t.fv, z, &u1, &v1);
                if (!(z < lens[0] && z > lens[1]))
                    continue;
                const float tau = x * t.slope1 + y * t.slope2, cosine = 1 / sqrtf(1 + tau * tau);
                const float u0 = (float)i + 0.5f, v0 = (float)j + 0.5f, du = u1 - u0, dv = v1 - v0;
                float horizon = -tau * cosine;
                if (!(cosine > 0))
                    horizon = 1;
                for (int step = 1; step <= steps; step++) {
                    const float part = (float)step / (float)steps, u = u0 + part * du, v = v0 + part * dv;
                    if (!(u >= 0 && u < width && v >= 0 && v < height))
                        continue;
                    const float *q = positions + 3 * ((int64_t)(int)v * width + (int)u);
                    const float dx = q[0] - t.p[0], dy = q[1] - t.p[1], dz = q[2] - t.p[2];
                    const float length = sqrtf((dx * dx + dy * dy) + dz * dz), r = length / radius;
                    const float sine = -((dx * t.w[0] + dy * t.w[1]) + dz * t.w[2]) / length;
                    if (r < 1 && sine > horizon) {
                        total += (1 - (0 * r + 1 * (r * r))) * (sine - horizon);
                        horizon = sine;
                    }
                }
            }
            total /= (float)n;
            ao[(int64_t)j * width + i] = total < 1 ? total : 1;
        }
}
