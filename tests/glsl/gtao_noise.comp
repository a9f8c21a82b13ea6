// GTAO as XeGTAO has it: view space is left-handed (z away from the viewer), rows begin above, noise of two numbers turns
// the slices and moves the steps, each of which looks at the nearest centre of a texel.
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Depth { float depth[]; };      // 0 near to 1 far, 1 without a surface
layout(std430, binding = 1) readonly buffer Normals { float normals[]; };  // of OpenGL's view space
layout(std430, binding = 2) readonly buffer Noise { float noise[]; };      // of a tile, 0 to 1
layout(std430, binding = 3) writeonly buffer Occlusion { float occlusion[]; };

uniform ivec2 size;
uniform int side;  // of the tile of noise
uniform mat4 projection;
uniform vec2 planes;
uniform float radius, falloff_range, distribution, thin, power;
uniform int slices, steps;

const float PI = 3.1415926535897932;

float fast_sqrt(float x) { return intBitsToFloat(0x1fbd1df5 + (floatBitsToInt(x) >> 1)); }

float fast_acos(float x) {
    float made = (-0.156583 * abs(x) + 1.570796) * fast_sqrt(max(1.0 - abs(x), 0.0));
    return x >= 0.0 ? made : 3.141593 - made;
}

float distance_at(ivec2 q) {
    float d = depth[q.y * size.x + q.x];
    return d < 1.0 ? planes.x * planes.y / (planes.y - d * (planes.y - planes.x)) : planes.y;
}

vec3 point_at(vec2 uv, float z) {
    vec2 ndc = vec2(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0);
    return vec3((ndc + vec2(projection[2][0], projection[2][1])) / vec2(projection[0][0], projection[1][1]), 1.0) * z;
}

float horizon_of(vec2 uv, vec3 here, vec3 v, float low, float reach) {
    ivec2 q = clamp(ivec2(floor(uv * vec2(size))), ivec2(0), size - 1);
    vec3 away = point_at(uv, distance_at(q)) - here;
    float range = falloff_range * reach, from = reach * (1.0 - falloff_range);
    float far = length(vec3(away.xy, away.z * (1.0 + thin)));
    float weight = clamp(far * (-1.0 / range) + (from / range + 1.0), 0.0, 1.0);
    return mix(low, dot(away / length(away), v), weight);
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, size))) return;
    int texel = p.y * size.x + p.x;
    occlusion[texel] = 0.0;
    if (depth[texel] >= 1.0) return;
    vec2 uv = (vec2(p) + 0.5) / vec2(size);
    float z = distance_at(p) * 0.99999, reach = radius * 1.457;
    vec3 here = point_at(uv, z), v = normalize(-here);
    vec3 n = vec3(normals[3 * texel], normals[3 * texel + 1], -normals[3 * texel + 2]);
    int tile = 2 * ((p.y % side) * side + p.x % side);
    vec2 random = vec2(noise[tile], noise[tile + 1]);
    float in_texels = reach / (z * 2.0 / (projection[0][0] * float(size.x)));
    float visible = clamp((10.0 - in_texels) / 100.0, 0.0, 1.0) * 0.5;
    float nearest = 1.3 / in_texels;
    for (int i = 0; i < slices; ++i) {
        float phi = (float(i) + random.x) / float(slices) * PI;
        vec3 d = vec3(cos(phi), sin(phi), 0.0);
        vec2 omega = vec2(d.x, -d.y) * in_texels;
        vec3 ortho = d - dot(d, v) * v, axis = normalize(cross(ortho, v));
        vec3 part = n - axis * dot(n, axis);
        float len = length(part), cosine = clamp(dot(part, v) / len, 0.0, 1.0);
        float angle = sign(dot(ortho, part)) * fast_acos(cosine);
        float low0 = cos(angle + 0.5 * PI), low1 = cos(angle - 0.5 * PI);
        float horizon0 = low0, horizon1 = low1;
        for (int k = 0; k < steps; ++k) {
            float moved = fract(random.y + float(i + k * steps) * 0.6180339887498948482);
            float s = pow((float(k) + moved) / float(steps), distribution) + nearest;
            vec2 offset = round(s * omega) / vec2(size);
            horizon0 = max(horizon0, horizon_of(uv + offset, here, v, low0, reach));
            horizon1 = max(horizon1, horizon_of(uv - offset, here, v, low1, reach));
        }
        len = mix(len, 1.0, 0.05);
        float h0 = -fast_acos(horizon1), h1 = fast_acos(horizon0);
        float arc0 = (cosine + 2.0 * h0 * sin(angle) - cos(2.0 * h0 - angle)) / 4.0;
        float arc1 = (cosine + 2.0 * h1 * sin(angle) - cos(2.0 * h1 - angle)) / 4.0;
        visible += len * (arc0 + arc1);
    }
    occlusion[texel] = 1.0 - clamp(max(0.03, pow(visible / float(slices), power)), 0.0, 1.0);
}
