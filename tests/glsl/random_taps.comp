// SSAO as Unity's Universal Render Pipeline has it: points in directions along the axes of a left-handed world, made of a
// noise of their own; depth is reversed, rows begin below, points outside the texture are seen at its border.
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Depth { float depth[]; };      // 1 near to 0 far, 0 without a surface
layout(std430, binding = 1) readonly buffer Normals { float normals[]; };  // world space
layout(std430, binding = 2) readonly buffer Noise { float noise[]; };      // of a tile, 0 to 1, and 0
layout(std430, binding = 3) writeonly buffer Occlusion { float occlusion[]; };

uniform ivec2 size;
uniform int side;  // of the tile of noise
uniform int count;
uniform mat4 view, projection;
uniform vec2 planes;
uniform float radius, beta, epsilon, intensity, falloff, contrast;

const float PI = 3.14159265358979;
const float first[12] = float[12](0.0, 0.33984375, 0.75390625, 0.56640625, 0.984375, 0.07421875, 0.23828125, 0.640625,
    0.359375, 0.5078125, 0.3828125, 0.984375);
const float second[12] = float[12](0.9296875, 0.76171875, 0.1333333, 0.015625, 0.0, 0.10546875, 0.640625, 0.74609375,
    0.6796875, 0.3515625, 0.4921875, 0.125);

float distance_at(vec2 uv) {
    ivec2 q = clamp(ivec2(floor(uv * vec2(size))), ivec2(0), size - 1);
    return 1.0 / ((planes.y / planes.x - 1.0) / planes.y * depth[q.y * size.x + q.x] + 1.0 / planes.y);
}

bool sky_at(vec2 uv) {
    ivec2 q = clamp(ivec2(floor(uv * vec2(size))), ivec2(0), size - 1);
    return depth[q.y * size.x + q.x] < 0.00001;
}

vec3 ray(vec2 ndc) {
    vec2 way = (ndc + vec2(projection[2][0], projection[2][1])) / vec2(projection[0][0], projection[1][1]);
    return transpose(mat3(view)) * vec3(way, -1.0);
}

vec3 from_eye(vec2 uv, float z) {
    vec3 corner = ray(vec2(-1.0, 1.0));
    vec3 across = ray(vec2(1.0, 1.0)) - corner, down = ray(vec2(-1.0, -1.0)) - corner;
    return (corner + across * uv.x + down * (1.0 - uv.y)) * z;
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, size))) return;
    int texel = p.y * size.x + p.x;
    occlusion[texel] = 0.0;
    vec2 uv = (vec2(p) + 0.5) / vec2(size);
    float z = distance_at(uv);
    if (sky_at(uv) || z > falloff) return;
    vec3 here = from_eye(uv, z), n = vec3(normals[3 * texel], normals[3 * texel + 1], normals[3 * texel + 2]);
    mat4 moved = projection * view;
    float sum = 0.0;
    for (int i = 0; i < count; ++i) {
        float part = float(i) * (1.0 / float(count));
        ivec2 tile = (p + int(part * float(side))) % side;
        float random = noise[2 * (tile.y * side + tile.x)];
        float height = fract(first[i] + random) * 2.0 - 1.0, angle = (second[i] + random) * 2.0 * PI * 100.0;
        float across = sqrt(1.0 - height * height);
        vec3 way = vec3(across * cos(angle), across * sin(angle), height);
        way *= float(dot(n, way) >= 0.0) * 2.0 - 1.0;
        way *= mix(0.1, 1.0, part * part);
        vec3 s = here + way * radius;
        float far = -dot(vec3(view[0][2], view[1][2], view[2][2]), s);
        vec2 there = clamp(((mat3(moved) * s).xy / far + 1.0) * 0.5, 0.0, 1.0);
        float seen = distance_at(there);
        if (sky_at(there)) continue;
        float inside = abs(far - seen) < radius ? 1.0 : 0.0;
        vec3 v = from_eye(there, seen) - here;
        sum += max(dot(v, n) - beta * z, 0.0) / (dot(v, v) + epsilon) * inside;
    }
    float fading = 1.0 - z * (1.0 / falloff);
    fading *= fading;
    occlusion[texel] = pow(clamp(sum * radius * intensity * fading / float(count), 0.0, 1.0), contrast);
}
