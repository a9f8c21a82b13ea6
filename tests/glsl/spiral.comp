// A shader that no registry knows: a golden spiral in the tangent plane, its terms falling off exponentially.
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Depth { float depth[]; };
layout(std430, binding = 1) readonly buffer Positions { float positions[]; };  // world space
layout(std430, binding = 2) readonly buffer Normals { float normals[]; };      // world space
layout(std430, binding = 3) readonly buffer Mapping { float m[]; };            // world -> image, rows of four
layout(std430, binding = 4) writeonly buffer Occlusion { float occlusion[]; };

uniform ivec2 size;
uniform vec3 right;
uniform float radius;

const int COUNT = 12;
const float GOLDEN = 0.7639320225 * 3.14159265359, DECAY = 2.0;

vec3 point(int k) { return vec3(positions[3 * k], positions[3 * k + 1], positions[3 * k + 2]); }

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, size))) return;
    int texel = p.y * size.x + p.x;
    occlusion[texel] = 0.0;
    if (isinf(depth[texel])) return;
    vec3 c = point(texel), n = vec3(normals[3 * texel], normals[3 * texel + 1], normals[3 * texel + 2]);
    vec3 t = normalize(right - n * dot(right, n)), b = cross(n, t);
    float sum = 0.0;
    for (int k = 0; k < COUNT; k++) {
        float far = radius * sqrt((float(k) + 0.5) / float(COUNT)), angle = GOLDEN * float(k);
        vec4 at = vec4(c + far * (cos(angle) * t + sin(angle) * b), 1.0);
        float q = dot(vec4(m[12], m[13], m[14], m[15]), at);
        vec2 uv = vec2(dot(vec4(m[0], m[1], m[2], m[3]), at), dot(vec4(m[4], m[5], m[6], m[7]), at)) / q;
        if (q <= 0.0 || any(lessThan(uv, vec2(0.0))) || any(greaterThanEqual(uv, vec2(size)))) continue;
        int there = int(uv.y) * size.x + int(uv.x);
        if (isinf(depth[there]) || there == texel) continue;
        vec3 v = point(there) - c;
        sum += max(0.0, dot(v, n)) / length(v) * exp(-DECAY * dot(v, v) / (radius * radius));
    }
    occlusion[texel] = min(1.0, sum / float(COUNT));
}
