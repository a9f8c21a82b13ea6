// A visibility bitmask as Bevy has it: view space looks along -z, rows begin above, depth is reversed, infinitely far at 0,
// and read between texels; noise of two numbers turns the slices and moves the steps.
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Depth { float depth[]; };      // 0 near to 1 far, 1 without a surface
layout(std430, binding = 1) readonly buffer Normals { float normals[]; };  // view space
layout(std430, binding = 2) readonly buffer Noise { float noise[]; };      // of a tile, 0 to 1
layout(std430, binding = 3) writeonly buffer Occlusion { float occlusion[]; };

uniform ivec2 size;
uniform int side;  // of the tile of noise
uniform mat4 projection;
uniform vec2 planes;
uniform float radius, thickness;
uniform int slices, steps;

const float PI = 3.141592653589793;

float fast_acos(float x) {
    float made = (-0.156583 * abs(x) + 0.5 * PI) * sqrt(max(1.0 - abs(x), 0.0));
    return x >= 0.0 ? made : PI - made;
}

float reversed_at(ivec2 q) {
    q = clamp(q, ivec2(0), size - 1);
    float d = depth[q.y * size.x + q.x];
    return d < 1.0 ? (planes.y - d * (planes.y - planes.x)) / planes.y : 0.0;
}

float between(vec2 uv) {
    vec2 at = uv * vec2(size) - 0.5, part = fract(at);
    ivec2 q = ivec2(floor(at));
    float upper = mix(reversed_at(q), reversed_at(q + ivec2(1, 0)), part.x);
    return mix(upper, mix(reversed_at(q + ivec2(0, 1)), reversed_at(q + ivec2(1, 1)), part.x), part.y);
}

vec3 point_at(vec2 uv, float d) {
    vec2 ndc = vec2(uv.x * 2.0 - 1.0, 1.0 - 2.0 * uv.y);
    vec2 way = (ndc + vec2(projection[2][0], projection[2][1])) / vec2(projection[0][0], projection[1][1]);
    return vec3(way, -1.0) * (planes.x / d);
}

uint sectors(vec2 uv, vec3 here, vec3 v, float way, float middle) {
    float d = between(uv), count = float(2 * steps);
    if (d <= 0.0) return 0u;
    vec3 front = point_at(uv, d) - here, back = front - v * thickness;
    vec2 ends = vec2(fast_acos(dot(normalize(front), v)), fast_acos(dot(normalize(back), v))) / PI;
    ends = clamp(way * ends + middle, 0.0, 1.0);
    ends = way < 0.0 ? ends.yx : ends;
    return bitfieldInsert(0u, ~0u, int(ends.x * count), int(ceil((ends.y - ends.x) * count)));
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, size))) return;
    int texel = p.y * size.x + p.x;
    occlusion[texel] = 0.0;
    if (depth[texel] >= 1.0) return;
    vec2 uv = (vec2(p) + 0.5) / vec2(size);
    vec3 here = point_at(uv, reversed_at(p) + 0.00001), v = normalize(-here);
    vec3 n = vec3(normals[3 * texel], normals[3 * texel + 1], normals[3 * texel + 2]);
    int tile = 2 * ((p.y % side) * side + p.x % side);
    vec2 random = vec2(noise[tile], noise[tile + 1]);
    float scale = -0.5 * radius * projection[0][0] / here.z;
    int hidden = 0;
    for (int i = 0; i < slices; ++i) {
        float phi = PI / float(slices) * (float(i) + random.x);
        vec3 d = vec3(cos(phi), sin(phi), 0.0), ortho = d - dot(d, v) * v;
        vec3 axis = cross(d, v);
        vec3 part = n - axis * dot(n, axis);
        float cosine = clamp(dot(part, v) / length(part), 0.0, 1.0);
        float middle = (0.5 * PI - sign(dot(ortho, part)) * fast_acos(cosine)) / PI;
        uint bits = 0u;
        for (int k = 0; k < steps; ++k) {
            float moved = fract(random.y + float(i + k * steps) * 0.6180339887498948482);
            float s = (float(k) + moved) / float(steps);
            vec2 offset = s * s * vec2(d.x, -d.y) * scale;
            bits |= sectors(uv + offset, here, v, 1.0, middle);
            bits |= sectors(uv - offset, here, v, -1.0, middle);
        }
        hidden += bitCount(bits);
    }
    occlusion[texel] = 1.0 - clamp(1.0 - float(hidden) / float(slices * 2 * steps), 0.03, 1.0);
}
