// SAO as Filament has it: taps in a spiral of squared distances, moved and turned by noise, each in a level of depth by its
// distance; view space looks along -z, rows begin below.
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Depth { float depth[]; };      // 0 near to 1 far, 1 without a surface
layout(std430, binding = 1) readonly buffer Normals { float normals[]; };  // view space
layout(std430, binding = 2) readonly buffer Noise { float noise[]; };      // 0 to 1, and 0
layout(std430, binding = 3) writeonly buffer Occlusion { float occlusion[]; };

uniform ivec2 size;
uniform int taps, levels;
uniform mat4 projection;
uniform vec2 planes;
uniform float radius, bias, intensity, horizon, power, turns;

const float PI = 3.14159265358979;

float depth_at(vec2 uv, int level) {
    ivec2 there = size >> level, q = clamp(ivec2(floor(uv * vec2(there))), ivec2(0), there - 1);
    for (int k = 0; k < level; ++k) q = 2 * q + ivec2(q.y & 1, q.x & 1);
    return depth[q.y * size.x + q.x];
}

vec3 point_at(vec2 uv, float d) {
    float z = planes.x * planes.y / (planes.y - d * (planes.y - planes.x));
    vec2 ndc = uv * 2.0 - 1.0 + vec2(projection[2][0], projection[2][1]);
    return vec3(ndc / vec2(projection[0][0], projection[1][1]), -1.0) * z;
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, size))) return;
    int texel = p.y * size.x + p.x;
    occlusion[texel] = 0.0;
    if (depth[texel] >= 1.0) return;
    vec2 uv = (vec2(p) + 0.5) / vec2(size);
    vec3 here = point_at(uv, depth[texel]);
    vec3 n = vec3(normals[3 * texel], normals[3 * texel + 1], normals[3 * texel + 2]);
    float random = noise[2 * texel], each = 1.0 / (float(taps) - 0.5), peak = 0.1 * radius;
    float scale = min(0.5 * projection[0][0] * float(size.x), 0.5 * projection[1][1] * float(size.y));
    float disk = -(scale * radius / here.z), start = 2.0 * PI * 2.4 * random, turn = each * turns * 2.0 * PI;
    vec2 way = vec2(cos(start), sin(start));
    mat2 further = mat2(cos(turn), sin(turn), -sin(turn), cos(turn));
    float sum = 0.0;
    for (int i = 0; i < taps; ++i) {
        float alpha = (float(i) + random + 0.5) * each, far = max(1.0, alpha * alpha * disk);
        vec2 there = uv + far * way / vec2(size);
        way = further * way;
        float d = depth_at(there, clamp(int(floor(log2(far))) - 3, 0, levels - 1));
        if (d >= 1.0) continue;
        vec3 v = point_at(there, d) - here;
        float vv = dot(v, v), vn = dot(v, n), weight = max(0.0, 1.0 - vv / (radius * radius));
        float term = max(0.0, vn + here.z * bias) / (vv + peak * peak);
        sum += step(vv * horizon * horizon, vn * vn) * weight * weight * term;
    }
    float obscured = sqrt(sum * 2.0 * PI * peak * intensity / float(taps));
    occlusion[texel] = 1.0 - pow(clamp(1.0 - obscured, 0.0, 1.0), 2.0 * power);
}
