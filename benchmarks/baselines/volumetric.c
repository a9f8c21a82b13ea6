/* Volumetric obscurance by points and lines, and horizons, as a C programmer writes the loops, one texel and one sample at a
 * time, float32: baselines for lfssao's numba kernels. Operations stand in lfssao's order; compiled with
 * -ffp-contract=off they give its bits.
 */
#include "scene.h"

void vo_lines(ARRAYS, const float *turns, int n, const float *disk, const float *half, const float *weights, int tangent,
              float thickness, float *ao)
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
            const Texel t = texel_at(&scene, radius, turns, tangent, j, i);
            if (!t.seen)
                continue;
            for (int k = 0; k < n; k++) {
                NEXT
                const float x = disk[2 * k], y = disk[2 * k + 1], z_s = half[k];
                const float z = (t.z + x * t.ez) + y * t.fz;
                float u, v;
                if (!project(&scene, (t.u + x * t.eu) + y * t.fu, (t.v + x * t.ev) + y * t.fv, z, &u, &v))
                    continue;
                const float d = (depth[(int64_t)(int)v * width + (int)u] - z) * t.steep;
                const float plane = tangent ? x * t.slope1 + y * t.slope2 : z_s, top = plane < z_s ? plane : z_s;
                const float back = d + thickness < top ? d + thickness : top, length = back - (d < -z_s ? -z_s : d);
                if (length > 0)
                    total += weights[k] * length;
            }
            ao[(int64_t)j * width + i] = total < 1 ? total : 1;
        }
}

void vo_points(ARRAYS, const float *mirrors, int n, const float *ball, const float *weights, int tangent, float thickness,
               float *ao)
{
    SCENE;
#pragma omp parallel for schedule(dynamic, 8)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            NEXT
            const int64_t at = (int64_t)j * width + i;
            float total = 0;
            ao[at] = 0;
            if (!(depth[at] < INFINITY))
                continue;
            const float *p = positions + 3 * at, *r = mirrors + (j & 3) * 256 + (i & 3), two = radius + radius;
            const float *up = normals + 3 * at, *w = directions + 3 * at, rx = r[0], ry = r[1024], rz = r[2048];
            const float mu = two * linear_row(rows, 0, rx, ry, rz), mv = two * linear_row(rows, 1, rx, ry, rz);
            const float mz = two * linear_row(rows, 3, rx, ry, rz);
            const float pu = linear_row(rows, 0, p[0], p[1], p[2]) + rows[3];
            const float pv = linear_row(rows, 1, p[0], p[1], p[2]) + rows[7];
            const float pz = linear_row(rows, 3, p[0], p[1], p[2]) + rows[15];
            const float reach = thickness < INFINITY ? thickness * linear_row(rows, 3, w[0], w[1], w[2]) : thickness;
            float across = 0, lu = 0, lv = 0, lz = 0;
            if (tangent) {
                across = (rx * up[0] + ry * up[1]) + rz * up[2];
                across += across;
                lu = two * linear_row(rows, 0, up[0], up[1], up[2]), lv = two * linear_row(rows, 1, up[0], up[1], up[2]);
                lz = two * linear_row(rows, 3, up[0], up[1], up[2]);
            }
            for (int k = 0; k < n; k++) {
                NEXT
                const float x = ball[3 * k], y = ball[3 * k + 1], z_o = ball[3 * k + 2];
                const float mirror = (x * rx + y * ry) + z_o * rz;
                float z = (pz + radius * linear_row(rows, 3, x, y, z_o)) - mirror * mz;
                float a = (pu + radius * linear_row(rows, 0, x, y, z_o)) - mirror * mu;
                float b = (pv + radius * linear_row(rows, 1, x, y, z_o)) - mirror * mv;
                if (tangent) {
                    const float above = ((x * up[0] + y * up[1]) + z_o * up[2]) - mirror * across;
                    if (above < 0)
                        z -= above * lz, a -= above * lu, b -= above * lv;
                }
                float u, v;
                if (!project(&scene, a, b, z, &u, &v))
                    continue;
                const float before = z - depth[(int64_t)(int)v * width + (int)u];
                if (before > 0 && before <= reach)
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
            NEXT
            float total = 0;
            ao[(int64_t)j * width + i] = 0;
            if (!(depth[(int64_t)j * width + i] < INFINITY))
                continue;
            const Texel t = texel_at(&scene, radius, turns, 1, j, i);
            if (!t.seen)
                continue;
            for (int k = 0; k < n; k++) {
                NEXT
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
                    NEXT
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

/* GTAO without falloff and of exact angles, weighted by the cosine: ``around`` has both sides of each slice. */
void gtao(ARRAYS, const float *turns, int n, const float *around, int steps, float first, float *ao)
{
    SCENE;
#pragma omp parallel for schedule(dynamic, 8)
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++) {
            NEXT
            float total = 0;
            const int64_t here = (int64_t)j * width + i;
            ao[here] = 0;
            if (!(depth[here] < INFINITY))
                continue;
            const Texel t = texel_at(&scene, radius, turns, 1, j, i);
            for (int k = 0; k < n; k++) {
                NEXT
                const float x = around[2 * k], y = around[2 * k + 1], z = (t.z + x * t.ez) + y * t.fz;
                const float e = x * t.ne + y * t.nf;
                float u1, v1, horizon = -e / sqrtf(t.towards * t.towards + e * e);
                project(&scene, (t.u + x * t.eu) + y * t.fu, (t.v + x * t.ev) + y * t.fv, z, &u1, &v1);
                const float u0 = (float)i + 0.5f, v0 = (float)j + 0.5f, du = u1 - u0, dv = v1 - v0;
                for (int step = 1; step <= (z < lens[0] && z > lens[1] ? steps : 0); step++) {
                    NEXT
                    const float part = (((float)step - 1) + first) / (float)steps, u = u0 + part * du, v = v0 + part * dv;
                    if (!(u >= 0 && u < width && v >= 0 && v < height))
                        continue;
                    const int64_t there = (int64_t)(int)v * width + (int)u;
                    const float *q = positions + 3 * there;
                    const float dx = q[0] - t.p[0], dy = q[1] - t.p[1], dz = q[2] - t.p[2];
                    const float length = sqrtf((dx * dx + dy * dy) + dz * dz);
                    const float cosine = -((dx * t.w[0] + dy * t.w[1]) + dz * t.w[2]) / length;
                    if (length / radius < 1 && there != here && cosine > horizon)
                        horizon = cosine;
                }
                const float c = horizon > 1 ? 1 : horizon < -1 ? -1 : horizon, square = 1 - c * c > 0 ? 1 - c * c : 0;
                total += 0.5f * (square * t.towards + ((float)acos_(c) - c * sqrtf(square)) * e);
            }
            total /= (float)(n / 2);
            ao[here] = 1 - (total < 0 ? 0 : total < 1 ? total : 1);
        }
}
