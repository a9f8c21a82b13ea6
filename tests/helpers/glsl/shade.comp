// The picture with occlusion: section 13 of the kit's SPECIFICATION.md.

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Image { float image[]; };
layout(std430, binding = 1) readonly buffer Occlusion { float occlusion[]; };
layout(std430, binding = 2) writeonly buffer Shaded { float shaded[]; };

uniform int numbers;

void main() {
    int k = int(gl_GlobalInvocationID.x);
    if (k >= numbers) return;
    precise float visible = 1.0 - occlusion[k / 3];
    precise float product = image[k] * visible;
    shaded[k] = product;
}
