// LF Algorithm 2 for the flat display with the linear diffuser: one invocation a texel. Everything is precise, in the
// order of lfssao's kernel, so that bits can be equal. Offsets are the samples after the mapping's linear part.
#version 430

layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Depth { float depth[]; };
layout(std430, binding = 1) readonly buffer Positions { float positions[]; };
layout(std430, binding = 2) readonly buffer Offsets { float offsets[]; };
layout(std430, binding = 3) readonly buffer Numbers { float m[]; };
layout(std430, binding = 4) writeonly buffer Occlusion { float occlusion[]; };

uniform ivec2 size;
uniform int samples;

float row(int k, vec3 p) {
    precise float sum = ((m[4 * k] * p.x + m[4 * k + 1] * p.y) + m[4 * k + 2] * p.z) + m[4 * k + 3];
    return sum;
}

void main() {
    ivec2 place = ivec2(gl_GlobalInvocationID.xy);
    if (place.x >= size.x || place.y >= size.y) return;
    int texel = place.y * size.x + place.x;
    occlusion[texel] = 0.0;
    if (!(depth[texel] < uintBitsToFloat(0x7F800000u))) return;
    vec3 p = vec3(positions[3 * texel], positions[3 * texel + 1], positions[3 * texel + 2]);
    precise vec3 here = vec3(row(0, p), row(1, p), row(2, p));
    int count = 0;
    for (int s = 0; s < samples; ++s) {
        precise vec3 q = here + vec3(offsets[3 * s], offsets[3 * s + 1], offsets[3 * s + 2]);
        precise float u = m[14] + q.x / (m[12] - q.z);
        precise float v = m[15] + q.y / (m[13] - q.z);
        if (q.z < m[12] && q.z > m[13] && u >= 0.0 && u < float(size.x) && v >= 0.0 && v < float(size.y)
            && depth[int(v) * size.x + int(u)] < q.z) ++count;
    }
    precise float share = float(count) / float(samples);
    occlusion[texel] = share;
}
