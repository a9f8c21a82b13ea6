// GTAO as three.js has it: view space, rows from below, points rebuilt from depth where a step lands, slices of equal
// weight, and horizons that each step raises less.
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Depth { float depth[]; };      // 0 near to 1 far, 1 without a surface
layout(std430, binding = 1) readonly buffer Normals { float normals[]; };  // view space
layout(std430, binding = 2) readonly buffer Noise { float noise[]; };      // of a tile, -1 to 1
layout(std430, binding = 3) writeonly buffer Occlusion { float occlusion[]; };

uniform ivec2 size;
uniform int side;  // of the tile of noise
uniform mat4 projection, inverse_projection;
uniform float radius, exponent, thickness, fall_off, power;
uniform int slices, steps;

const float PI = 3.14159265358979;

float depth_at(vec2 uv) {
    ivec2 p = clamp(ivec2(floor(uv * vec2(size))), ivec2(0), size - 1);
    return depth[p.y * size.x + p.x];
}

vec3 point_at(vec2 uv, float d) {
    vec4 view = inverse_projection * vec4(vec3(uv, d) * 2.0 - 1.0, 1.0);
    return view.xyz / view.w;
}

vec3 seen_from(vec3 place) {
    vec4 clip = projection * vec4(place, 1.0);
    vec2 uv = clip.xy / clip.w * 0.5 + 0.5;
    return point_at(uv, depth_at(uv));
}

float risen(float horizon, vec3 away, vec3 v, int k) {
    if (abs(away.z) >= thickness) return horizon;
    float cosine = dot(v, normalize(away));
    return horizon + max(0.0, (cosine - horizon) * mix(1.0, 2.0 / float(k + 2), fall_off));
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, size))) return;
    int texel = p.y * size.x + p.x;
    occlusion[texel] = 0.0;
    if (depth[texel] >= 1.0) return;
    vec2 uv = (vec2(p) + 0.5) / vec2(size);
    vec3 here = point_at(uv, depth[texel]), v = normalize(-here);
    vec3 n = vec3(normals[3 * texel], normals[3 * texel + 1], normals[3 * texel + 2]);
    int tile = 3 * ((p.y % side) * side + p.x % side);
    vec3 t = normalize(vec3(noise[tile], noise[tile + 1], 0.0)), b = vec3(-t.y, t.x, 0.0);
    float visible = 0.0;
    for (int i = 0; i < slices; ++i) {
        float angle = float(i) / float(slices) * PI;
        vec3 d = normalize(cos(angle) * t + sin(angle) * b);
        vec3 across = normalize(cross(d, v)), out_there = cross(across, v);
        vec3 normal = normalize(n - across * dot(n, across)), plane = cross(normal, across);
        float first = dot(v, plane), second = -first;
        for (int k = 0; k < steps; ++k) {
            vec3 way = d * radius * pow(float(k + 1) / float(steps), exponent);
            first = risen(first, seen_from(here + way) - here, v, k);
            second = risen(second, seen_from(here - way) - here, v, k);
        }
        float x = dot(normal, out_there), y = dot(normal, v);
        float turned = acos(second) - acos(first) + sqrt(1.0 - first * first) * first - sqrt(1.0 - second * second) * second;
        visible += 0.5 * (x * turned + y * (2.0 - first * first - second * second));
    }
    occlusion[texel] = 1.0 - pow(clamp(visible / float(slices), 0.0, 1.0), power);
}
