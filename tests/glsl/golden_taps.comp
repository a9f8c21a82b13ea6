// N8AO: a kernel that turns about the normal by one number of noise and moves outwards by another; view space looks along
// -z, rows begin below, and the mean is of the points that lie in the camera's frustum.
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Depth { float depth[]; };      // 0 near to 1 far, 1 without a surface
layout(std430, binding = 1) readonly buffer Normals { float normals[]; };  // view space
layout(std430, binding = 2) readonly buffer Golden { float golden[]; };    // directions of the upper half
layout(std430, binding = 3) readonly buffer Noise { float noise[]; };      // of a tile, 0 to 1
layout(std430, binding = 4) writeonly buffer Occlusion { float occlusion[]; };

uniform ivec2 size;
uniform int side;  // of the tile of noise
uniform int count;
uniform mat4 projection, inverse_projection;
uniform vec2 planes;
uniform float radius, falloff, bias;

vec3 point_at(vec2 uv, float d) {
    vec4 p = inverse_projection * vec4(vec3(uv, d) * 2.0 - 1.0, 1.0);
    return p.xyz / p.w;
}

float distance_of(float d) {
    return planes.x * planes.y / (planes.y - d * (planes.y - planes.x));
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, size))) return;
    int texel = p.y * size.x + p.x;
    occlusion[texel] = 0.0;
    if (depth[texel] == 1.0) return;
    vec2 uv = (vec2(p) + 0.5) / vec2(size);
    vec3 here = point_at(uv, depth[texel]);
    vec3 n = vec3(normals[3 * texel], normals[3 * texel + 1], normals[3 * texel + 2]);
    int tile = 2 * ((p.y % side) * side + p.x % side);
    vec2 random = fract(vec2(noise[tile], noise[tile + 1]));
    vec3 helper = n.y > 0.99 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
    vec3 t = normalize(cross(helper, n)), b = cross(n, t);
    float turn = random.x * 2.0 * 3.1415962;
    mat3 turned = mat3(t, b, n) * mat3(cos(turn), -sin(turn), 0.0, sin(turn), cos(turn), 0.0, 0.0, 0.0, 1.0);
#if TEXELS
    float reach = distance(here, point_at(uv + vec2(radius, 0.0) / vec2(size), depth[texel])), soft = reach * falloff;
#else
    float reach = radius, soft = reach * falloff * 0.2;
#endif
    float hidden = 0.0, total = 0.0;
    for (int i = 0; i < count; ++i) {
        vec3 way = turned * vec3(golden[3 * i], golden[3 * i + 1], golden[3 * i + 2]);
        vec3 s = here + reach * fract(random.y + float(i) / float(count)) * way;
        vec4 clip = projection * vec4(s, 1.0);
        vec3 image = clip.xyz / clip.w * 0.5 + 0.5;
        if (any(lessThanEqual(image * (1.0 - image), vec3(0.0)))) continue;
        ivec2 q = ivec2(floor(image.xy * vec2(size)));
        float d = depth[q.y * size.x + q.x], before = distance_of(image.z) - distance_of(d);
        vec2 away = vec2(p) + 0.5 - vec2(q);
        float weight = smoothstep(0.0, 1.0, soft / abs(before));
        bool other = before != 0.0 && d != depth[texel];
        other = other && dot(away, away) >= 1.0;
        if (other && before >= bias) hidden += weight;
        total += 1.0;
    }
    occlusion[texel] = clamp(hidden / max(total, 1.0), 0.0, 1.0);
}
