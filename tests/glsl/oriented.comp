// The half ball in the normal's frame as tutorials ship it, of a camera, from the kit's specification: a texel each.
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 0) readonly buffer Depth { float depth[]; };
layout(std430, binding = 1) readonly buffer Normals { float normals[]; };      // world space
layout(std430, binding = 2) readonly buffer Angles { float angles[]; };        // radians
layout(std430, binding = 3) writeonly buffer Occlusion { float occlusion[]; };
layout(std430, binding = 4) readonly buffer Positions { float positions[]; };  // world space
layout(std430, binding = 5) readonly buffer Mapping { float m[]; };            // world -> image, rows of four
layout(std430, binding = 6) readonly buffer Samples { float samples[]; };      // of the ball, three numbers each

uniform ivec2 size;
uniform vec3 right, up;
uniform vec4 axis;  // distance from the eye's plane
uniform float radius, bias;
uniform int count;

vec3 point(ivec2 p) {
    int k = 3 * (p.y * size.x + p.x);
    return vec3(positions[k], positions[k + 1], positions[k + 2]);
}

void main() {
    ivec2 p = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(p, size))) return;
    int texel = p.y * size.x + p.x;
    occlusion[texel] = 0.0;
    if (isinf(depth[texel])) return;
    vec3 c = point(p), n = vec3(normals[3 * texel], normals[3 * texel + 1], normals[3 * texel + 2]);
    vec3 noise = cos(angles[texel]) * right + sin(angles[texel]) * up;
    vec3 tangent = normalize(noise - n * dot(noise, n)), bitangent = cross(n, tangent);
    float z_c = dot(axis, vec4(c, 1.0)), sum = 0.0;
    for (int s = 0; s < count; s++) {
        vec3 o = vec3(samples[3 * s], samples[3 * s + 1], abs(samples[3 * s + 2]));
        vec4 at = vec4(c + radius * (o.x * tangent + o.y * bitangent + o.z * n), 1.0);
        float q = dot(vec4(m[12], m[13], m[14], m[15]), at);
        vec2 uv = vec2(dot(vec4(m[0], m[1], m[2], m[3]), at), dot(vec4(m[4], m[5], m[6], m[7]), at)) / q;
        if (q <= 0.0 || any(lessThan(uv, vec2(0.0))) || any(greaterThanEqual(uv, vec2(size)))) continue;
        ivec2 there = ivec2(uv);
        if (isinf(depth[there.y * size.x + there.x])) continue;
        float z = dot(axis, vec4(point(there), 1.0));
        if (z > dot(axis, at) - bias) continue;
#if RANGE == 0
        sum += 1.0;
#elif RANGE == 1
        sum += abs(z_c - z) < radius ? 1.0 : 0.0;
#else
        sum += smoothstep(0.0, 1.0, radius / abs(z_c - z));
#endif
    }
    occlusion[texel] = sum / float(count);
}
