// GTAO as Filament has it: a tile of noise turns the slices and moves the steps, each in a level of depth by its distance;
// near steps raise a horizon, lower ones take it down; view space looks along -z, rows begin below, depth is reversed.
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Depth { float depth[]; };      // 1 near to 0 far, 0 without a surface
layout(std430, binding = 1) readonly buffer Normals { float normals[]; };  // view space
layout(std430, binding = 2) writeonly buffer Occlusion { float occlusion[]; };

uniform ivec2 size;
uniform int levels, slices, steps;
uniform mat4 projection;
uniform vec2 planes;
uniform float radius, thickness, power, intensity;

const float PI = 3.14159265358979;

float distance_at(vec2 uv, int level) {
    ivec2 there = size >> level, q = clamp(ivec2(floor(uv * vec2(there))), ivec2(0), there - 1);
    for (int k = 0; k < level; ++k) q = 2 * q + ivec2(q.y & 1, q.x & 1);
    float d = depth[q.y * size.x + q.x];
    return d > 0.0 ? planes.x * planes.y / (planes.x + d * (planes.y - planes.x)) : planes.x * 16777216.0;
}

vec3 point_at(vec2 uv, float z) {
    vec2 ndc = uv * 2.0 - 1.0 + vec2(projection[2][0], projection[2][1]);
    return vec3(ndc / vec2(projection[0][0], projection[1][1]), -1.0) * z;
}

float angle_of(float cosine) {
    float y = abs(cosine), made = (1.570796 - 0.1565827 * y) * sqrt(1.0 - y);
    return cosine >= 0.0 ? made : PI - made;
}

float moved(float horizon, vec3 away, vec3 v) {
    float square = dot(away, away), fading = clamp(square * 2.0 / (radius * radius), 0.0, 1.0);
    float cosine = dot(away, v) * inversesqrt(square);
    return cosine > horizon ? mix(cosine, horizon, fading) : mix(horizon, cosine, thickness);
}

float arc(float h, float n) {
    h = n + clamp(h - n, -0.5 * PI, 0.5 * PI);
    return 0.25 * (2.0 * h * sin(n) + cos(n) - cos(2.0 * h - n));
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, size))) return;
    int texel = p.y * size.x + p.x;
    occlusion[texel] = 0.0;
    if (depth[texel] <= 0.0) return;
    vec2 uv = (vec2(p) + 0.5) / vec2(size);
    float z = distance_at(uv, 0);
    vec3 here = point_at(uv, z), v = normalize(-here);
    vec3 n = vec3(normals[3 * texel], normals[3 * texel + 1], normals[3 * texel + 2]);
    float turn = float((p.x + p.y) & 3) / 4.0 + float(p.x & 3) / 16.0, start = float((p.y - p.x) & 3) / 4.0;
    float scale = min(0.5 * projection[0][0] * float(size.x), 0.5 * projection[1][1] * float(size.y));
    float between = scale * radius / z / float(steps + 1);
    float visible = 0.0;
    for (int i = 0; i < slices; ++i) {
        float phi = (float(i) + turn) / float(slices) * PI;
        vec2 omega = vec2(cos(phi), sin(phi));
        vec3 d = vec3(omega, 0.0), e = normalize(d - dot(d, v) * v), axis = cross(e, v);
        vec3 part = n - axis * dot(n, axis);
        float len = length(part), tilt = sign(dot(e, part)) * angle_of(clamp(dot(part, v) / len, 0.0, 1.0));
        float first = -1.0, second = -1.0;
        for (int j = 0; j < steps; ++j) {
            float far = max((float(j) + start) * between, float(j + 1));
            int level = clamp(int(floor(log2(far))) - 3, 0, levels - 1);
            vec2 way = far * omega / vec2(size);
            first = moved(first, point_at(uv + way, distance_at(uv + way, level)) - here, v);
            second = moved(second, point_at(uv - way, distance_at(uv - way, level)) - here, v);
        }
        visible += len * (arc(angle_of(first), tilt) + arc(-angle_of(second), tilt));
    }
    float seen = pow(clamp(visible / float(slices), 0.0, 1.0), power);
    occlusion[texel] = 1.0 - mix(1.0, seen, intensity);
}
