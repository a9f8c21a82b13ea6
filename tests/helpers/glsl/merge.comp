// The maximum over radii: section 11 of the kit's SPECIFICATION.md.

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Layers { float layers[]; };
layout(std430, binding = 1) writeonly buffer Merged { float merged[]; };

uniform int texels;
uniform int count;

void main() {
    int texel = int(gl_GlobalInvocationID.x);
    if (texel >= texels) return;
    float largest = layers[texel];
    for (int k = 1; k < count; ++k) largest = max(largest, layers[k * texels + texel]);
    merged[texel] = largest;
}
