// World -> image: section 8 of the kit's SPECIFICATION.md. Everything is precise: nothing fused, nothing reordered.

const int CROSSED_SLITS = 0, MATRIX = 1, DISPLAY = 2;

layout(std430, binding = 0) readonly buffer Mapping { float m[]; };

float linear_row(int row, float x, float y, float z) {
    precise float sum = (m[4 * row] * x + m[4 * row + 1] * y) + m[4 * row + 2] * z;
    return sum;
}

float turned_row(int row, float x, float y, float z, float c, float s) {
    precise float sum = (c * (m[4 * row] * x + m[4 * row + 1] * y) + s * (m[4 * row + 1] * x - m[4 * row] * y))
        + m[4 * row + 2] * z;
    return sum;
}

float affine_row(int row, float x, float y, float z) {
    precise float sum = linear_row(row, x, y, z) + m[4 * row + 3];
    return sum;
}

// Where a line leaves a circle: t and the discriminant.
vec2 crossing(float curvature, float x, float z, float dx, float dz) {
    precise float a = curvature * (dx * dx + dz * dz);
    precise float b = curvature * (x * dx + z * dz) - dz;
    precise float c = curvature * (x * x + z * z) - (z + z);
    precise float d = b * b - a * c;
    precise float root = 0.0;
    if (d > 0.0) root = sqrt(d);
    precise float t = -c / (b + root);
    return vec2(t, d);
}

// Numbers of the module behind the matrix.
float number(int k) { return m[12 + k]; }

// Screen point that shows (x, y, z) to the viewers; false where there is none.
bool screen_point(float x, float y, float z, out precise vec3 s) {
    float m_x = number(0), m_y = number(1), m_z = number(2), y_o = number(3), z_o = number(4);
    s = vec3(0.0);
    precise float dx = x - m_x, dz = z - m_z, from_observers = m_z - z_o;
    precise vec2 on_screen = crossing(number(5), m_x, m_z, dx, dz);
    precise vec2 on_arc = crossing(number(6), m_x, from_observers, dx, dz);
    precise float t_s = on_screen.x, t_v = on_arc.x;
    if (!(z < m_z) || on_arc.y < 0.0 || !(t_v > 1.0)) return false;
    if (on_screen.y < 0.0 || !(0.0 < t_s && t_s < t_v)) return false;
    precise float s_y = y_o + (y - y_o) * ((t_v - t_s) / (t_v - 1.0));
    precise float s_x = 0.0, s_z = 0.0;
    if (number(7) == 0.0) {
        if (number(5) != 0.0) s_z = m_z + t_s * (z - m_z);
        s_x = m_x + t_s * (x - m_x);
    } else {
        precise float h_m = sqrt((s_y - m_y) * (s_y - m_y) + m_z * m_z);
        precise float h_e = sqrt((s_y - y_o) * (s_y - y_o) + z_o * z_o);
        precise float k = (z / z_o) * (h_e / h_m);
        precise float divisor = 1.0 + k;
        if (!(divisor > 0.0)) return false;
        s_x = (x + m_x * k) / divisor;
    }
    s = vec3(s_x, s_y, s_z);
    return true;
}

bool display_to_image(float x, float y, float z, out precise vec3 image) {
    image = vec3(0.0);
    precise vec3 s;
    if (!screen_point(x, y, z, s)) return false;
    precise float s_x = s.x, s_y = s.y;
    if (s.z != 0.0) {
        float m_x = number(0), m_y = number(1), m_z = number(2);
        precise float g = m_z / (m_z - s.z);
        s_x = m_x + (s_x - m_x) * g;
        s_y = m_y + (s_y - m_y) * g;
        if (!(g > 0.0)) return false;
    }
    precise float w = (number(14) * s_x + number(15) * s_y) + number(16);
    precise float u = ((number(8) * s_x + number(9) * s_y) + number(10)) / w;
    precise float v = ((number(11) * s_x + number(12) * s_y) + number(13)) / w;
    if (!(w > 0.0)) return false;
    float c_u = number(17), c_v = number(18), f = number(19), k1 = number(20), k2 = number(21);
    if (k1 != 0.0 || k2 != 0.0) {
        precise float p = (u - c_u) / f, q = (v - c_v) / f;
        precise float r = p * p + q * q;
        if (!(r < number(22))) return false;
        precise float e = 1.0 + r * (k1 + r * k2);
        u = c_u + f * (p * e);
        v = c_v + f * (q * e);
    }
    image = vec3(u, v, z);
    return true;
}

// u, v, image z of the sums of the matrix's rows; false outside the mapping's domain.
bool to_image(int kind, vec4 sums, out precise vec3 image) {
    if (kind == DISPLAY) return display_to_image(sums.x, sums.y, sums.z, image);
    if (kind == MATRIX) {
        image = vec3(sums.x / sums.w, sums.y / sums.w, sums.z / sums.w);
        return sums.w > 0.0;
    }
    precise float u = m[14] + sums.x / (m[12] - sums.z);
    precise float v = m[15] + sums.y / (m[13] - sums.z);
    image = vec3(u, v, sums.z);
    return sums.z < m[12] && sums.z > m[13];
}
