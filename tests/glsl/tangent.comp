// A kernel in a tangent frame as engines ship it: view space (x right, y up, z towards the viewer), rows from below.
// FRAME: cross(n, t) or cross(t, n). TERM: 0 the smooth range check of distances, 1 two limits of linear depth.
// FILTER: 1 reads between four texels. Texels without a surface hold what the buffers were cleared to.

layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Positions { float positions[]; };
layout(std430, binding = 1) readonly buffer Normals { float normals[]; };
layout(std430, binding = 2) readonly buffer Depth { float depth[]; };  // 0 near to 1 far, 1 without a surface
layout(std430, binding = 3) readonly buffer Kernel { float kernel[]; };
layout(std430, binding = 4) readonly buffer Noise { float noise[]; };
layout(std430, binding = 5) writeonly buffer Occlusion { float occlusion[]; };

uniform ivec2 size;
uniform int side;  // of the tile of noise
uniform int count;
uniform mat4 projection;
uniform vec2 planes;
uniform float radius, bias;
uniform vec2 limits;

ivec2 held(ivec2 p) { return clamp(p, ivec2(0), size - 1); }

vec3 position_at(ivec2 p) {
    int at = 3 * (held(p).y * size.x + held(p).x);
    return vec3(positions[at], positions[at + 1], positions[at + 2]);
}

float z_at(vec2 uv) {
    vec2 place = uv * vec2(size);
#if FILTER
    vec2 corner = floor(place - 0.5), part = place - 0.5 - corner;
    ivec2 p = ivec2(corner);
    float below = mix(position_at(p).z, position_at(p + ivec2(1, 0)).z, part.x);
    float above = mix(position_at(p + ivec2(0, 1)).z, position_at(p + ivec2(1, 1)).z, part.x);
    return mix(below, above, part.y);
#else
    return position_at(ivec2(floor(place))).z;
#endif
}

float linear_depth(vec2 uv) {
    ivec2 p = held(ivec2(floor(uv * vec2(size))));
    float d = depth[p.y * size.x + p.x];
    float z = planes.x * planes.y / ((planes.y - planes.x) * d - planes.y);
    return (z + planes.x) / (planes.x - planes.y);
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, size))) return;
    int texel = p.y * size.x + p.x;
    occlusion[texel] = 0.0;
    if (depth[texel] == 1.0) return;
    vec3 c = position_at(p), n = vec3(normals[3 * texel], normals[3 * texel + 1], normals[3 * texel + 2]);
    int tile = 3 * ((p.y % side) * side + p.x % side);
    vec3 random = vec3(noise[tile], noise[tile + 1], noise[tile + 2]);
    vec3 t = normalize(random - n * dot(random, n)), b = FRAME;
    float sum = 0.0;
    for (int i = 0; i < count; ++i) {
        vec3 s = c + radius * (kernel[3 * i] * t + kernel[3 * i + 1] * b + kernel[3 * i + 2] * n);
        vec4 clip = projection * vec4(s, 1.0);
        if (clip.w <= 0.0) continue;
        vec2 uv = clip.xy / clip.w * 0.5 + 0.5;
#if TERM == 0
        float z = z_at(uv);
        float near = smoothstep(0.0, 1.0, radius / abs(c.z - z));
        sum += (z >= s.z + bias ? 1.0 : 0.0) * near;
#else
        float delta = (s.z + planes.x) / (planes.x - planes.y) - linear_depth(uv);
        if (delta > limits.x && delta < limits.y) sum += 1.0;
#endif
    }
    occlusion[texel] = sum / float(count);
}
