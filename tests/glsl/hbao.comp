// Horizon-based AO of a camera, from the kit's specification, its directions turned by a texel's angle: a texel each.
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Depth { float depth[]; };
layout(std430, binding = 1) readonly buffer Normals { float normals[]; };      // world space
layout(std430, binding = 2) readonly buffer Angles { float angles[]; };        // radians
layout(std430, binding = 3) writeonly buffer Occlusion { float occlusion[]; };
layout(std430, binding = 4) readonly buffer Positions { float positions[]; };  // world space
layout(std430, binding = 5) readonly buffer Mapping { float m[]; };            // world -> image, rows of four

uniform ivec2 size;
uniform vec3 eye, right;
uniform float radius, bias;  // bias in radians
uniform int around, steps;

const float PI = 3.14159265358979;

vec3 fetch3(int source, ivec2 p) {
    int k = 3 * (p.y * size.x + p.x);
    return source == 0 ? vec3(positions[k], positions[k + 1], positions[k + 2])
                       : vec3(normals[k], normals[k + 1], normals[k + 2]);
}

vec2 image(vec3 x) {
    vec4 at = vec4(x, 1.0);
    float q = dot(vec4(m[12], m[13], m[14], m[15]), at);
    return vec2(dot(vec4(m[0], m[1], m[2], m[3]), at), dot(vec4(m[4], m[5], m[6], m[7]), at)) / q;
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, size))) return;
    int texel = p.y * size.x + p.x;
    occlusion[texel] = 0.0;
    if (isinf(depth[texel])) return;
    vec3 here = fetch3(0, p), n = fetch3(1, p), w = normalize(here - eye);
    vec3 a = normalize(right - dot(right, w) * w), b = cross(w, a);
    float spin = angles[texel];
    vec3 e = cos(spin) * a - sin(spin) * b, f = -sin(spin) * a - cos(spin) * b;
    float facing = max(-dot(n, w), 1.0 / 1048576.0), sum = 0.0;
    vec2 centre = vec2(p) + 0.5;
    for (int s = 0; s < around; s++) {
        float theta = PI * float(2 * s + 1) / float(around);
        vec3 out_there = cos(theta) * e + sin(theta) * f;
        float rise = atan(-dot(n, out_there) / facing) + bias;
        float horizon = rise < 0.5 * PI ? sin(rise) : 1.0;
        vec2 way = image(here + radius * out_there) - centre;
        for (int k = 1; k <= steps; k++) {
            vec2 at = centre + way * (float(k) / float(steps));
            if (any(lessThan(at, vec2(0.0))) || any(greaterThanEqual(at, vec2(size)))) continue;
            ivec2 q = ivec2(at);
            if (isinf(depth[q.y * size.x + q.x])) continue;
            vec3 d = fetch3(0, q) - here;
            float distance = length(d), rho = distance / radius, up = -dot(d, w) / distance;
            if (rho < 1.0 && up > horizon) {
                sum += (1.0 - rho * rho) * (up - horizon);
                horizon = up;
            }
        }
    }
    occlusion[texel] = min(sum / float(around), 1.0);
}
