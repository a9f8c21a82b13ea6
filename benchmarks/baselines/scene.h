/* A texel's ball in the frame of its viewing direction and where places in it land, float32, flat displays with the linear
 * diffuser (lfssao/kernels/neighbourhood.py).
 *
 * rows: u, v, divisor (unused here) and cast z, rows of four; lens: z_m, z_o, u_0, v_0.
 */
#include "elementary.h"

typedef struct { int width, height; const float *depth, *positions, *directions, *normals, *rows, *lens, *right; } Scene;
typedef struct { float p[3], u, v, z, eu, ev, ez, fu, fv, fz, steep, ne, nf, towards, slope1, slope2; const float *w; int seen; } Texel;

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
        const float towards = -((n[0] * w[0] + n[1] * w[1]) + n[2] * w[2]);
        t.towards = towards > 0x1p-20f ? towards : 0x1p-20f;
        t.ne = (n[0] * ex + n[1] * ey) + n[2] * ez, t.nf = (n[0] * fx + n[1] * fy) + n[2] * fz;
        t.slope1 = t.ne / t.towards, t.slope2 = t.nf / t.towards;
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
