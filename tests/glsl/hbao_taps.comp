// HBAO by cosines to the normal, as NVIDIA's sample has it: z is the distance along the axis, rows begin below, depth is
// held at the border, and noise is (cosine, sine, part of a step).
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Depth { float depth[]; };      // 0 near to 1 far, 1 without a surface
layout(std430, binding = 1) readonly buffer Normals { float normals[]; };  // view space
layout(std430, binding = 2) readonly buffer Noise { float noise[]; };
layout(std430, binding = 3) writeonly buffer Occlusion { float occlusion[]; };

uniform ivec2 size;
uniform int side;  // of the tile of noise
uniform mat4 projection;
uniform vec2 planes;
uniform float radius, bias, power;
uniform int directions, steps;

float distance_at(vec2 uv) {
    ivec2 p = clamp(ivec2(floor(uv * vec2(size))), ivec2(0), size - 1);
    float d = depth[p.y * size.x + p.x];
    return planes.x * planes.y / (d * (planes.x - planes.y) + planes.y);
}

vec3 point_at(vec2 uv) {
    vec2 scale = vec2(projection[0][0], projection[1][1]);
    vec2 slope = uv * 2.0 / scale - (1.0 - vec2(projection[2][0], projection[2][1])) / scale;
    float z = distance_at(uv);
    return vec3(slope * z, z);
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, size))) return;
    int texel = p.y * size.x + p.x;
    occlusion[texel] = 0.0;
    if (depth[texel] == 1.0) return;
    vec2 uv = (vec2(p) + 0.5) / vec2(size);
    vec3 here = point_at(uv), n = vec3(normals[3 * texel], normals[3 * texel + 1], -normals[3 * texel + 2]);
    int tile = 3 * ((p.y % side) * side + p.x % side);
    vec3 random = vec3(noise[tile], noise[tile + 1], noise[tile + 2]);
    float between = radius * 0.5 * (0.5 * float(size.y) * projection[1][1]) / here.z / float(steps + 1);
    float inverse = -1.0 / (radius * radius), sum = 0.0;
    for (int i = 0; i < directions; ++i) {
        float angle = 2.0 * 3.14159265 / float(directions) * float(i);
        vec2 d = vec2(cos(angle), sin(angle));
        d = vec2(d.x * random.x - d.y * random.y, d.x * random.y + d.y * random.x);
        float far = random.z * between + 1.0;
        for (int k = 0; k < steps; ++k) {
            vec2 at = uv + round(far * d) / vec2(size);
            vec3 v = point_at(at) - here;
            far += between;
            float square = dot(v, v);
            sum += clamp(dot(n, v) / sqrt(square) - bias, 0.0, 1.0) * clamp(square * inverse + 1.0, 0.0, 1.0);
        }
    }
    sum *= 1.0 / (1.0 - bias) / float(directions * steps);
    occlusion[texel] = 1.0 - pow(clamp(1.0 - sum * 2.0, 0.0, 1.0), power);
}
