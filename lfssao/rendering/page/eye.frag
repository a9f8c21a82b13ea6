// The picture between the rays of two modules, or beyond the last ray, as lfssao/rendering/kernels/light_field.py has it.
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D left, right; // the light of each on the screen; alpha: whether it shows the point
uniform vec4 modules; // x and z of the left one and the right one, metres
uniform vec2 counts; // 1: it has a picture, and the ray that passes next to the eye on its side; 0: not
uniform vec2 chosen; // 1: its light is shown orange
uniform vec2 eye, screen, size; // x and z, metres; width and height, metres and pixels
#if CONICAL
uniform vec2 heights; // of the observers and of all modules, metres
uniform float bounded; // 1: the draw covers more than lies between the rays
#endif
out vec4 color;

const vec3 ORANGE = vec3(1.0, 0.5, 0.0);
const float EDGE = 1e-5; // of shares: the draws of neighbours overlap by as much

void main() {
  vec2 s = screen * (gl_FragCoord.xy / size - 0.5), slope = -1.0 / modules.yw;
#if CONICAL
  slope = vec2(length(vec2(s.y - heights.x, eye.y)) / length(vec2(s.y - heights.y, modules.y)) / eye.y);
#endif
  vec2 rays = (s.x - modules.xz) * slope;
  vec2 sines = ((eye.x - s.x) / eye.y - rays) * inversesqrt(rays * rays + 1.0); // but for a factor that both have
  vec2 shares = 1.0 - abs(sines) / abs(sines.y - sines.x);
#if CONICAL
  if (bounded > 0.0 && min(shares.x, shares.y) < -EDGE) discard;
#endif
  ivec2 at = ivec2(gl_FragCoord.x, size.y - gl_FragCoord.y);
  vec4 l = texelFetch(left, at, 0), r = texelFetch(right, at, 0); // decoded from sRGB
  vec2 shows = counts * vec2(l.a, r.a), weights = clamp(shares, 0.0, 1.0);
  if (shows.x * shows.y == 0.0) weights = shows * step(0.5, weights); // one alone reaches half a step
  vec3 sum = weights.x * l.rgb + weights.y * r.rgb;
  vec3 code = mix(1.055 * pow(sum, vec3(1.0 / 2.4)) - 0.055, 12.92 * sum, lessThan(sum, vec3(0.0031308)));
  color = vec4(mix(code, ORANGE, 0.75 * dot(weights, chosen)), 1.0);
}
