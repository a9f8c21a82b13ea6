// One pass of the Gaussian blur, along `direction`: section 12 of the kit's SPECIFICATION.md.

layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Source { float source[]; };
layout(std430, binding = 1) readonly buffer Weights { float weights[]; };
layout(std430, binding = 2) writeonly buffer Target { float target[]; };

uniform ivec2 size;
uniform ivec2 direction;
uniform int reach;

void main() {
    ivec2 place = ivec2(gl_GlobalInvocationID.xy);
    if (place.x >= size.x || place.y >= size.y) return;
    precise float sum = 0.0;
    for (int tap = 0; tap <= 2 * reach; ++tap) {
        ivec2 from = clamp(place + direction * (tap - reach), ivec2(0), size - 1);
        sum = sum + weights[tap] * source[from.y * size.x + from.x];
    }
    target[place.y * size.x + place.x] = sum;
}
