// LF Algorithms 1 and 2: sections 9 and 10 of the kit's SPECIFICATION.md.

layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 1) readonly buffer Depth { float depth[]; };
layout(std430, binding = 2) readonly buffer Positions { float positions[]; };  // of Algorithm 1: screen -> world
layout(std430, binding = 3) readonly buffer Offsets { float offsets[]; };
layout(std430, binding = 4) writeonly buffer Occlusion { float occlusion[]; };
layout(std430, binding = 5) buffer Outside { uint outside; };
layout(std430, binding = 6) readonly buffer Turns { float turns[]; };  // cosines, then sines

uniform ivec2 size;
uniform int kind;
uniform int samples;
uniform bool algorithm1;
uniform bool turning;

float back(int row, float u, float v, float d) {
    precise float sum = ((positions[4 * row] * u + positions[4 * row + 1] * v) + positions[4 * row + 2] * d)
        + positions[4 * row + 3];
    return sum;
}

vec3 visible_point(int texel, ivec2 place) {
    precise vec3 point = vec3(positions[3 * texel], positions[3 * texel + 1], positions[3 * texel + 2]);
    if (algorithm1) {
        precise float u = float(place.x) + 0.5, v = float(place.y) + 0.5;
        float d = depth[texel];
        precise float w = back(3, u, v, d);
        point = vec3(back(0, u, v, d) / w, back(1, u, v, d) / w, back(2, u, v, d) / w);
    }
    return point;
}

void main() {
    ivec2 place = ivec2(gl_GlobalInvocationID.xy);
    if (place.x >= size.x || place.y >= size.y) return;
    int texel = place.y * size.x + place.x;
    if (!(depth[texel] < uintBitsToFloat(0x7F800000u))) {
        occlusion[texel] = 0.0;
        return;
    }
    precise vec3 p = visible_point(texel, place);
    int rows = kind == MATRIX ? 4 : 3;
    int count = 0;
    uint missed = 0u;
    for (int s = 0; s < samples; ++s) {
        precise vec4 sums = vec4(0.0);
        for (int row = 0; row < rows; ++row) {
            float x = offsets[3 * s], y = offsets[3 * s + 1], z = offsets[3 * s + 2];
            precise float offset = turning
                ? turned_row(row, x, y, z, turns[texel], turns[size.x * size.y + texel]) : linear_row(row, x, y, z);
            precise float sum = affine_row(row, p.x, p.y, p.z) + offset;
            sums[row] = sum;
        }
        precise vec3 image;
        bool there = to_image(kind, sums, image);
        there = there && image.x >= 0.0 && image.x < float(size.x) && image.y >= 0.0 && image.y < float(size.y);
        if (!there) {
            ++missed;
        } else if (depth[int(image.y) * size.x + int(image.x)] < image.z) {
            ++count;
        }
    }
    precise float share = float(count) / float(samples);
    occlusion[texel] = share;
    atomicAdd(outside, missed);
}
