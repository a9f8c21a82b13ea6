// SSAO as Godot 4 has it at quality 'low': four passes of half the size, each of its own parity of columns and rows, with
// three pairs of taps at whole texels; view space is left-handed (z away from the viewer), rows begin above.
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Depth { float depth[]; };      // 1 near to 0 far, 0 without a surface
layout(std430, binding = 1) readonly buffer Normals { float normals[]; };  // of OpenGL's view space
layout(std430, binding = 2) writeonly buffer Occlusion { float occlusion[]; };

uniform ivec2 size;
uniform mat4 projection;
uniform vec2 planes, fading;
uniform float radius, intensity, horizon, power;

const vec3 TAPS[3] = vec3[](
    vec3(0.78488064, 0.56661671, 1.5), vec3(0.26022232, -0.29575172, 1.5), vec3(0.10459357, 0.08372527, 1.11));
const int ORDER[5] = int[](0, 1, 4, 3, 2);

int mirrored(int k, int n) {
    k = (k < 0 ? -1 - k : k) % (2 * n);
    return min(k, 2 * n - 1 - k);
}

float distance_at(ivec2 q, ivec2 parity) {
    ivec2 half_size = size / 2, t = 2 * ivec2(mirrored(q.x, half_size.x), mirrored(q.y, half_size.y)) + parity;
    float d = depth[t.y * size.x + t.x];
    return d > 0.0 ? planes.x * planes.y / (planes.x + d * (planes.y - planes.x)) : planes.y;
}

vec3 point_at(vec2 uv, float z) {
    vec2 slope = vec2(2.0, -2.0) / vec2(projection[0][0], projection[1][1]);
    return vec3((slope * uv - 0.5 * slope) * z, z);
}

float obscured(vec3 n, vec3 away, float fall) {
    float square = dot(away, away);
    return max(0.0, dot(n, away) / sqrt(square) - horizon) * max(0.0, square * fall + 1.0);
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, size))) return;
    int texel = p.y * size.x + p.x;
    occlusion[texel] = 0.0;
    if (depth[texel] <= 0.0) return;
    ivec2 parity = p & 1, q = p / 2;
    vec2 pixel = 2.0 / vec2(size), uv = (vec2(q) + 0.75) * pixel;
    float z = distance_at(q, parity);
    vec3 here = point_at(uv, z);
    vec3 n = normalize(vec3(normals[3 * texel], normals[3 * texel + 1], -normals[3 * texel + 2]));
    float wide = (point_at(uv + pixel, z) - here).x, limit = radius * 1.2 * 1.5 * projection[1][1];
    float reach = radius * (clamp(length(here) / limit, 0.0, 1.0) * 0.8 + 0.2), fall = -1.0 / (reach * reach);
    int a = parity.x + 2 * parity.y, b = ORDER[(2 * q.y + q.x) % 5];
    float turn = (float(a) + float(b) / 5.0) * 1.57079632679;
    float scale = (1.0 + (float(a) - 1.5 + (float(b) - 2.0) / 5.0) * 0.07) * 0.85 * reach / wide;
    vec2 first = scale * vec2(cos(turn), -sin(turn)), second = scale * vec2(-sin(turn), -cos(turn));
    here.z *= 0.99;
    float sum = 0.0, weights = 0.0;
    for (int i = 0; i < 3; ++i) {
        ivec2 far = ivec2(round(vec2(dot(TAPS[i].xy, first), dot(TAPS[i].xy, second))));
        for (int side = 1; side >= -1; side -= 2) {
            vec3 seen = point_at(uv + vec2(side * far) * pixel, distance_at(q + side * far, parity));
            sum += TAPS[i].z * obscured(n, seen - here, fall);
            weights += TAPS[i].z;
        }
    }
    float fade = clamp((fading.y - here.z) / (fading.y - fading.x), 0.0, 1.0);
    float hidden = min(intensity * sum / weights, 0.98) * fade;
    occlusion[texel] = 1.0 - pow(clamp(1.0 - hidden, 0.0, 1.0), power);
}
