// The picture with occlusion and a light: section 18 of the kit's SPECIFICATION.md.

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Image { float image[]; };
layout(std430, binding = 1) readonly buffer Occlusion { float occlusion[]; };
layout(std430, binding = 2) readonly buffer Normals { float normals[]; };
layout(std430, binding = 3) writeonly buffer Shaded { float shaded[]; };

uniform int numbers;
uniform vec3 towards;
uniform float ambient;
uniform bool on_all;

void main() {
    int k = int(gl_GlobalInvocationID.x);
    if (k >= numbers) return;
    int n = k / 3 * 3;
    precise float d = (normals[n] * towards.x + normals[n + 1] * towards.y) + normals[n + 2] * towards.z;
    precise float direct = (1.0 - ambient) * (d < 0.0 ? 0.0 : d);
    precise float visible = 1.0 - occlusion[k / 3];
    precise float factor = on_all ? (ambient + direct) * visible : ambient * visible + direct;
    precise float product = image[k] * factor;
    shaded[k] = product;
}
