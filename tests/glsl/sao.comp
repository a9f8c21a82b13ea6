// Scalable Ambient Obscurance of a perspective camera, raw A, from the kit's specification: one invocation a texel.
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Depth { float depth[]; };
layout(std430, binding = 1) readonly buffer Normals { float normals[]; };   // world space, read with FACE 0
layout(std430, binding = 2) readonly buffer Angles { float angles[]; };     // radians
layout(std430, binding = 3) writeonly buffer Occlusion { float occlusion[]; };
layout(std430, binding = 4) readonly buffer Axes { float axes[]; };         // rows of the world -> eye rotation

uniform ivec2 size;
uniform vec4 lens;     // focal lengths and centre, texels
uniform vec2 planes;   // near and far
uniform float radius, intensity, beta, epsilon, edge;
uniform int taps, turns, log_q, levels;

float linear_z(ivec2 p) {
    float d = depth[p.y * size.x + p.x];
    return d < 1.0 ? planes.x * planes.y / (planes.y + d * (planes.x - planes.y)) : uintBitsToFloat(0x7f800000u);
}

vec3 eye_point(ivec2 p, float z) {
    vec2 from_centre = vec2(p) + 0.5 - lens.zw;
    return vec3(from_centre.x * z / lens.x, -from_centre.y * z / lens.y, z);
}

ivec2 level_size(int level) {
    return (size + (1 << level) - 1) >> level;
}

// Texel of level 0 that a texel of a level was picked from, on a rotated grid.
ivec2 picked(ivec2 p, int level) {
    for (; level > 0; level--) {
        ivec2 last = level_size(level - 1) - 1;
        p = min(2 * p + ivec2(1 - (p.y & 1), 1 - (p.x & 1)), last);
    }
    return p;
}

bool seen(ivec2 p) {
    return all(greaterThanEqual(p, ivec2(0))) && all(lessThan(p, size)) && !isinf(linear_z(p));
}

// The neighbour along an axis, within the quad if it can be.
ivec2 partner(ivec2 p, ivec2 step) {
    bool odd = ((p.x * step.x + p.y * step.y) & 1) == 1;
    ivec2 first = odd ? p - step : p + step, second = odd ? p + step : p - step;
    return seen(first) ? first : seen(second) ? second : p;
}

vec3 normal_of(ivec2 p, vec3 c) {
#if FACE
    ivec2 right = partner(p, ivec2(1, 0)), below = partner(p, ivec2(0, 1));
    vec3 n = cross(eye_point(right, linear_z(right)) - c, eye_point(below, linear_z(below)) - c);
    n = dot(n, n) > 0.0 ? normalize(n) : -normalize(c);
    return dot(n, c) > 0.0 ? -n : n;
#else
    int k = 3 * (p.y * size.x + p.x);
    vec3 n = vec3(normals[k], normals[k + 1], normals[k + 2]);
    return vec3(dot(vec3(axes[0], axes[1], axes[2]), n), dot(vec3(axes[3], axes[4], axes[5]), n),
                dot(vec3(axes[6], axes[7], axes[8]), n));
#endif
}

ivec2 landed(ivec2 p, vec2 offset) {
#if LANDING == 0
    return ivec2(floor(vec2(p) + offset));
#elif LANDING == 1
    return p + ivec2(offset);
#else
    return p + ivec2(floor(offset + 0.5));
#endif
}

float light_at(ivec2 p, float z) {
    vec3 c = eye_point(p, z), n = normal_of(p, c);
    vec2 reach = abs(radius * lens.xy / z);
    float spin = angles[p.y * size.x + p.x], sum = 0.0;
    for (int t = 0; t < taps; t++) {
        float alpha = (float(t) + 0.5) / float(taps);
        float theta = FULL_TURN * alpha * float(turns) + spin;
        vec2 h = reach * alpha;
        ivec2 q = landed(p, h * vec2(cos(theta), sin(theta)));
        if (any(lessThan(q, ivec2(0))) || any(greaterThanEqual(q, size)) || q == p) continue;
        int level = clamp(findMSB(int(max(h.x, h.y))) - log_q, 0, levels - 1);
        float there = linear_z(picked(q >> level, level));
        if (isinf(there)) continue;
        vec3 v = eye_point(q, there) - c;
        float vv = dot(v, v), f = max(radius * radius - vv, 0.0);
        sum += f * f * f * max((dot(v, n) - beta) / (epsilon + vv), 0.0);
    }
    float r3 = radius * radius * radius;
    return max(0.0, 1.0 - sum / (r3 * r3) * intensity * (5.0 / float(taps)));
}

// The mean of both texels of a quad's row, or the first one's light at a depth edge: what derivatives within quads make.
float row_mean(ivec2 p, ivec2 other) {
    float z = linear_z(p), there = linear_z(other), light = light_at(p, z);
    return abs(z - there) < edge ? 0.5 * (light + light_at(other, there)) : light;
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, size))) return;
    int texel = p.y * size.x + p.x;
    occlusion[texel] = 0.0;
    float z = linear_z(p);
    if (isinf(z)) return;
    ivec2 right = ivec2(p.x ^ 1, p.y), below = ivec2(p.x, p.y ^ 1);
    float light = edge > 0.0 ? row_mean(p, right) : light_at(p, z);
    if (edge > 0.0 && abs(z - linear_z(below)) < edge) light = 0.5 * (light + row_mean(below, ivec2(right.x, below.y)));
    occlusion[texel] = 1.0 - light;
}
