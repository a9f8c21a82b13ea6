/* Volumetric obscurance by areas and its pyramid of moments (lfssao/kernels/moments.py, volumetric_area.py), as a C
 * programmer writes the loops: textures float32, moments float64. With -ffp-contract=off they give lfssao's bits.
 */
#include "scene.h"

#define FAR 0x1p100

/* The next level of share, z and z^2, each with its border. */
void moments_half(int width, int high, double *moments, int source, int target, double outer, double inner)
{
    const int pitch = width + 3, wide = (width + 1) / 2;
#pragma omp parallel for schedule(static)
    for (int j = 0; j < high; j++)
        for (int i = 0; i < wide; i++)
            for (int m = 0; m < 3; m++) {
                const double *from = moments + 3 * (source + (int64_t)2 * j * pitch + 2 * i) + m;
                double total = 0;
                for (int row = 0; row < 4; row++, from += 3 * pitch) {
                    const double across = ((outer * from[0] + inner * from[3]) + inner * from[6]) + outer * from[9];
                    total += (row == 0 || row == 3 ? outer : inner) * across;
                }
                moments[3 * (target + (int64_t)(j + 1) * (wide + 3) + i + 1) + m] = total;
            }
}

/* Share, first and second moment of a level at image point (u, v), linearly between the four texels around it. */
static void look_up(const double *moments, int64_t start, int64_t pitch, int level, float u, float v, double *out)
{
    const double scale = 1.0 / (double)(1 << level), x = u * scale + 0.5, y = v * scale + 0.5;
    const int64_t i = (int64_t)x, j = (int64_t)y;
    const double f = x - (double)i, g = y - (double)j;
    const double *a = moments + 3 * (start + j * pitch + i), *b = a + 3 * pitch;
    for (int m = 0; m < 3; m++) {
        const double up = a[m] + f * (a[3 + m] - a[m]), low = b[m] + f * (b[3 + m] - b[m]);
        out[m] = up + g * (low - up);
    }
}

static float hidden_by_box(float low, float high, float bottom, float top)
{
    float start = low < bottom ? bottom : low, end = high < bottom ? bottom : high;
    start = start < top ? start : top, end = end < top ? end : top;
    const float first = start <= low ? 0 : start < high ? (start - low) / (high - low) : 1;
    const float last = end <= low ? 0 : end < high ? (end - low) / (high - low) : 1;
    return (top - end) + (end - start) * (0.5f * (first + last));
}

/* Half the log2 of the area of the disk's image; 512 where a corner of it has none. */
static double detail(const Scene *s, const Texel *t)
{
    float u[3], v[3];
    int there = 1;
    for (int k = 0; k < 3; k++) {
        const float x = k == 1, y = k == 2, z = (t->z + x * t->ez) + y * t->fz;
        project(s, (t->u + x * t->eu) + y * t->fu, (t->v + x * t->ev) + y * t->fv, z, u + k, v + k);
        there = there && z < s->lens[0] && z > s->lens[1];
    }
    if (!there)
        return 512;
    const float area = (u[1] - u[0]) * (v[2] - v[0]) - (v[1] - v[0]) * (u[2] - u[0]);
    return 0.5 * log2_(3.141592653589793 * fabs((double)area));
}

void vo_area(ARRAYS, const float *turns, int n, const float *disk, const float *half, const float *weights,
             const double *finer, const double *moments, const int64_t *starts, const int64_t *pitches, int levels,
             double half_width, float thickness, float *ao)
{
    SCENE;
#pragma omp parallel for schedule(dynamic, 8)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            NEXT
            float total = 0;
            ao[(int64_t)j * width + i] = 0;
            if (!(depth[(int64_t)j * width + i] < INFINITY))
                continue;
            const Texel t = texel_at(&scene, radius, turns, 0, j, i);
            if (!t.seen)
                continue;
            const double lod = (float)detail(&scene, &t);
            for (int k = 0; k < n; k++) {
                NEXT
                const float x = disk[2 * k], y = disk[2 * k + 1], top = half[k], z = (t.z + x * t.ez) + y * t.fz;
                float u, v;
                if (!project(&scene, (t.u + x * t.eu) + y * t.fu, (t.v + x * t.ev) + y * t.fv, z, &u, &v))
                    continue;
                double level = lod + finer[k], m[3];
                level = level > 0 ? level : 0;
                level = level < levels - 1 ? level : levels - 1;
                const int fine = (int)level;
                const double part = level - fine;
                look_up(moments, starts[fine], pitches[fine], fine, u, v, m);
                if (part > 0) {
                    double c[3];
                    look_up(moments, starts[fine + 1], pitches[fine + 1], fine + 1, u, v, c);
                    for (int q = 0; q < 3; q++)
                        m[q] += part * (c[q] - m[q]);
                }
                if (!(m[0] > 0))
                    continue;
                const double mean = m[1] / m[0], variance = m[2] / m[0] - mean * mean;
                const double middle = (mean - z) * t.steep, reach = half_width * (variance > 0 ? sqrt(variance) : 0) * t.steep;
                const float low = (float)fmin(fmax(middle - reach, -FAR), FAR), high = (float)fmin(fmax(middle + reach, -FAR), FAR);
                if (!(top > -top && low <= high))
                    continue;
                total += weights[k] * (float)m[0] * (hidden_by_box(low, high, -top, top)
                                                     - hidden_by_box(low + thickness, high + thickness, -top, top));
            }
            total = total > 0 ? total : 0;
            ao[(int64_t)j * width + i] = total < 1 ? total : 1;
        }
}
