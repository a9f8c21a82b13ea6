// Ground-truth AO of a camera as engines write it: slices, horizons' cosines, angles, the inner integral with sines.
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Depth { float depth[]; };
layout(std430, binding = 1) readonly buffer Normals { float normals[]; };      // world space
layout(std430, binding = 2) readonly buffer Angles { float angles[]; };        // radians
layout(std430, binding = 3) writeonly buffer Occlusion { float occlusion[]; };
layout(std430, binding = 4) readonly buffer Positions { float positions[]; };  // world space
layout(std430, binding = 5) readonly buffer Mapping { float m[]; };            // world -> image, rows of four

uniform ivec2 size;
uniform vec3 eye, right;
uniform float radius, start, falloff, power;
uniform int slices, steps;

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

float angle_of(float x) { return acos(clamp(x, -1.0, 1.0)); }

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, size))) return;
    int texel = p.y * size.x + p.x;
    occlusion[texel] = 0.0;
    if (isinf(depth[texel])) return;
    vec3 here = fetch3(0, p), normal = fetch3(1, p), v = normalize(eye - here);
    vec3 a = normalize(right - dot(right, v) * v), b = cross(a, v);
    float spin = angles[texel], visible = 0.0;
    vec3 e = cos(spin) * a - sin(spin) * b, f = -sin(spin) * a - cos(spin) * b;
    vec2 centre = vec2(p) + 0.5;
    for (int s = 0; s < slices; s++) {
        float phi = 0.5 * PI * float(2 * s + 1) / float(slices);
        vec3 along = cos(phi) * e + sin(phi) * f, axis = normalize(cross(along, v));
        vec3 projected = normal - axis * dot(normal, axis);
        float part = length(projected), cos_n = clamp(dot(projected, v) / part, 0.0, 1.0);
        float n = sign(dot(along, projected)) * angle_of(cos_n);
        for (int side = -1; side <= 1; side += 2) {
            float tilt = float(side) * n, low = cos(tilt + 0.5 * PI), horizon = low;
            vec2 way = image(here + float(side) * radius * along) - centre;
            for (int k = 0; k < steps; k++) {
                float x = (float(k) + start) / float(steps);
                vec2 at = centre + way * x * x;
                if (any(lessThan(at, vec2(0.0))) || any(greaterThanEqual(at, vec2(size)))) continue;
                ivec2 q = ivec2(at);
                if (q == p || isinf(depth[q.y * size.x + q.x])) continue;
                vec3 d = fetch3(0, q) - here;
                float far = length(d), weight = clamp((1.0 - far / radius) / falloff, 0.0, 1.0);
                horizon = max(horizon, mix(low, dot(d, v) / far, weight));
            }
            float h = angle_of(horizon);
            visible += WEIGHTED;
        }
    }
    occlusion[texel] = 1.0 - pow(clamp(visible / float(slices), 0.0, 1.0), power);
}
