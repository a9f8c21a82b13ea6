// A kernel whose directions and lengths each texel takes from another number on, as Babylon.js' SSAO2 has it: view space
// is left-handed (z away from the viewer), rows begin below, points outside the texture count for nothing.
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Depth { float depth[]; };            // 0 near to 1 far, 1 without a surface
layout(std430, binding = 1) readonly buffer Normals { float normals[]; };        // of OpenGL's view space
layout(std430, binding = 2) readonly buffer Directions { float directions[]; };
layout(std430, binding = 3) readonly buffer Noise { float noise[]; };            // -1 to 1
layout(std430, binding = 4) writeonly buffer Occlusion { float occlusion[]; };

uniform ivec2 size;
uniform int side;  // of the tile of noise
uniform mat4 projection;
uniform vec2 planes;
uniform float radius, strength, base, max_z, min_z_aspect;

const float lengths[16] = float[16](0.1, 0.11406250000000001, 0.131640625, 0.15625, 0.187890625, 0.2265625, 0.272265625,
    0.325, 0.384765625, 0.4515625, 0.525390625, 0.60625, 0.694140625, 0.7890625, 0.891015625, 1.0);

float distance_at(ivec2 p) {
    float d = depth[p.y * size.x + p.x];
    return planes.x * planes.y / (d * (planes.x - planes.y) + planes.y);
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, size))) return;
    int texel = p.y * size.x + p.x;
    occlusion[texel] = 0.0;
    if (depth[texel] == 1.0) return;
    float far = distance_at(p), reach = min(radius, min_z_aspect * far / planes.x);
    vec2 ndc = (vec2(p) + 0.5) / vec2(size) * 2.0 - 1.0;
    vec3 here = vec3((ndc + vec2(projection[2][0], projection[2][1])) / vec2(projection[0][0], projection[1][1]), 1.0) * far;
    vec3 n = vec3(normals[3 * texel], normals[3 * texel + 1], -normals[3 * texel + 2]);
    int tile = 3 * ((p.y % side) * side + p.x % side);
    vec2 random = vec2(noise[tile], noise[tile + 1]) * 0.5 + 0.5;
    vec3 r = vec3(random * 2.0 - 1.0, 0.0);
    r = 1.0 - abs(dot(r, n)) > 1e-2 ? r : vec3(-r.y, 0.0, r.x);
    vec3 t = normalize(r - n * dot(r, n)), b = cross(n, t);
    float sum = 0.0;
    for (int i = 0; i < 16; ++i) {
        int k = 3 * ((i + int(random.y * 16.0)) % 16);
        vec3 way = directions[k] * t + directions[k + 1] * b + directions[k + 2] * n;
        vec3 s = lengths[(i + int(random.x * 16.0)) % 16] * way * reach + here;
        vec4 clip = projection * vec4(s.xy, -s.z, 1.0);
        if (clip.w <= 0.0) continue;
        vec2 uv = clip.xy / clip.w * 0.5 + 0.5;
        if (uv.x < 0.0 || uv.y < 0.0 || uv.x >= 1.0 || uv.y >= 1.0) continue;
        ivec2 q = ivec2(floor(uv * vec2(size)));
        if (depth[q.y * size.x + q.x] == 1.0) continue;
        float before = s.z - distance_at(q);
        sum += (before >= 0.0 ? 1.0 : 0.0) * (1.0 - smoothstep(reach * 0.5, reach, before));
    }
    sum *= 1.0 - smoothstep(max_z * 0.75, max_z, far);
    occlusion[texel] = 1.0 - clamp(1.0 - strength * sum / 16.0 + base, 0.0, 1.0);
}
