"use strict";
// The picture of an eye: one draw for each run of columns that lie between the rays of the same two modules. On a flat
// screen a module's light is the same for every eye; its weight is not.

const find = (selector) => document.querySelector(selector);
const data = JSON.parse(find("#data").textContent);
const canvas = find("canvas"), gl = canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false });
const { width, height } = canvas, { modules, screen } = data, uniforms = {};
const state = { x: data.eye, distance: data.distance, ao: true, module: -1 };
let waiting = false;

// Depth at x of the observers' arc through the origin.
const onArc = (x, bend = data.curvature * x) => bend * x / (1 + Math.sqrt(1 - bend * bend));
const eyePoint = () => ({ x: state.x, z: onArc(state.x) - state.distance });
const metres = (i, j) => [screen[0] * (i / width - 0.5), screen[1] * (0.5 - j / height)];

// How a module's ray through (x, y, 0) passes the eye, as lfssao/rendering/kernels/light_field.py has it.
function sine(module, [x, y], eye) {
  const ratio = data.conical ? Math.hypot(y - data.height, eye.z) / Math.hypot(y - module.y, module.z) : eye.z / -module.z;
  const a = (x - module.x) * ratio, b = eye.x - x, f2 = eye.z * eye.z;
  return a * b + f2 > 0 ? (b - a) * eye.z / Math.sqrt((a * a + f2) * (b * b + f2)) : NaN;
}

// The modules whose rays pass next to the eye and whether they count; on its one side the last two if the other has none.
function pair(sines) {
  let [left, beforeLeft, right, pastRight] = [-1, -1, -1, -1];
  for (let k = 0; k < sines.length; k++) {
    const a = sines[k];
    if (a <= 0 && !(a <= sines[left])) [beforeLeft, left] = [left, k];
    else if (a <= 0 && !(a <= sines[beforeLeft])) beforeLeft = k;
    else if (a > 0 && !(a >= sines[right])) [pastRight, right] = [right, k];
    else if (a > 0 && !(a >= sines[pastRight])) pastRight = k;
  }
  if (left >= 0 && right >= 0) return [left, right, 1, 1];
  return left >= 0 ? [left, beforeLeft, 1, 0] : [pastRight, right, 0, 1];
}

// Runs of columns, the last one not included, with their pair. With the linear diffuser sines do not depend on the row.
function linearRuns(eye) {
  const runs = [];
  for (let i = 0; i < width; i++) {
    const found = pair(modules.map((module) => sine(module, metres(i + 0.5, 0), eye))), last = runs.at(-1);
    if (found[0] < 0 || found[1] < 0) continue;
    if (last?.to === i && found.every((each, k) => each === last.pair[k])) last.to = i + 1;
    else runs.push({ from: i, to: i + 1, pair: found });
  }
  return runs;
}

// The conical diffuser, with modules in a line: their rays through x_m meet the eye, which bends with the row. So runs
// overlap, and the shader leaves out what is not between the rays of the pair.
function conicalRuns(eye) {
  const order = [...modules.keys()].sort((a, b) => modules[a].x - modules[b].x), ends = modules.map(() => [Infinity, -Infinity]);
  for (let j = 0; j <= height; j++) {
    const [, y] = metres(0, j), { z, y: mY } = modules[0], ratio = Math.hypot(y - data.height, eye.z) / Math.hypot(y - mY, z);
    modules.forEach(({ x }, k) => {
      const i = ((eye.x + x * ratio) / (1 + ratio) / screen[0] + 0.5) * width;
      ends[k] = [Math.min(ends[k][0], i), Math.max(ends[k][1], i)];
    });
  }
  const run = (from, to, ...pair) => ({ from: Math.max(0, Math.floor(from)), to: Math.min(width, Math.ceil(to)), pair });
  const between = order.slice(1).map((k, n) => run(ends[order[n]][0], ends[k][1], k, order[n], 1, 1));
  const first = run(0, ends[order[0]][1], order[0], order[1], 1, 0);
  return [first, run(ends[order.at(-1)][0], width, order.at(-2), order.at(-1), 0, 1), ...between].filter((r) => r.from < r.to);
}

function draw() {
  const eye = eyePoint(), [top, end] = state.module < 0 ? data.rows : [0, height]; // other rows are black
  const set = (name, ...values) => gl[`uniform${values.length}f`](uniforms[name], ...values);
  gl.disable(gl.SCISSOR_TEST);
  gl.clear(gl.COLOR_BUFFER_BIT);
  gl.enable(gl.SCISSOR_TEST);
  set("eye", eye.x, eye.z);
  for (const { from, to, pair: [left, right, ofLeft, ofRight] } of data.conical ? conicalRuns(eye) : linearRuns(eye)) {
    const [l, r] = [modules[left], modules[right]];
    gl.scissor(from, height - end, to - from, end - top);
    set("modules", l.x, l.z, r.x, r.z);
    set("counts", ofLeft && l.textures ? 1 : 0, ofRight && r.textures ? 1 : 0);
    set("chosen", left === state.module, right === state.module);
    if (data.conical) set("bounded", ofLeft * ofRight);
    [l, r].forEach(({ textures }, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, textures && textures[state.ao ? textures.length - 1 : 0]);
    });
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }
}

// Put the eye elsewhere, switch AO or choose a module: what the controls show, and the next frame.
function look(change) {
  Object.assign(state, change);
  for (const [name, [least, most]] of [["x", data.eyes], ["distance", data.distances]]) {
    state[name] = Math.min(Math.max(state[name], least), most);
    find(`#${name}`).value = state[name];
    find(`#${name} + output`).value = state[name].toFixed(2);
  }
  find("#ao").checked = state.ao;
  if (!waiting) requestAnimationFrame(() => { waiting = false; draw(); });
  waiting = true;
}

async function texture(png) {
  const image = Object.assign(new Image(), { src: `data:image/png;base64,${png}` });
  await image.decode();
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, gl.RGBA, gl.UNSIGNED_BYTE, image);
  return made;
}

function build() {
  const program = gl.createProgram(), corners = `#version 300 es
    void main() { gl_Position = vec4(4 * (gl_VertexID % 2) - 1, 4 * (gl_VertexID / 2) - 1, 0, 1); }`;
  const colors = `#version 300 es\n#define CONICAL ${Number(data.conical)}\n${find("#shader").textContent}`;
  for (const [kind, source] of [[gl.VERTEX_SHADER, corners], [gl.FRAGMENT_SHADER, colors]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error("this browser cannot run the page's shader");
  gl.useProgram(program);
  for (let k = 0; k < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); k++) {
    const { name } = gl.getActiveUniform(program, k);
    uniforms[name] = gl.getUniformLocation(program, name);
  }
  gl.uniform1i(uniforms.right, 1);
  gl.uniform2f(uniforms.size, width, height);
  gl.uniform2f(uniforms.screen, ...screen);
  if (data.conical) gl.uniform2f(uniforms.heights, data.height, modules[0].y);
}

async function open() {
  if (!gl) throw new Error("this browser has no WebGL 2, which the picture needs");
  gl.disable(gl.DITHER);
  gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
  build();
  for (const [k, module] of modules.entries()) {
    find("#status").textContent = `reading pictures: ${k} of ${modules.length}`;
    module.textures = module.textures && await Promise.all(module.textures.map(texture));
  }
  find("#status").textContent = "";
  look({});
  canvas.dataset.ready = true;
}

const [across, away] = [data.eyes, data.distances].map(([least, most]) => (most - least) / 60);
const KEYS = {
  ArrowLeft: () => ({ x: state.x - across }),
  ArrowRight: () => ({ x: state.x + across }),
  ArrowUp: () => ({ distance: state.distance - away }),
  ArrowDown: () => ({ distance: state.distance + away }),
  a: () => ({ ao: !state.ao }),
};
document.addEventListener("keydown", (event) => {
  const key = event.key.length > 1 ? event.key : event.key.toLowerCase();
  const taken = event.ctrlKey || event.metaKey || event.altKey || event.target.matches("select, [type=range]");
  if (taken || !(key in KEYS)) return;
  event.preventDefault();
  look(KEYS[key]());
});
for (const name of ["x", "distance"]) find(`#${name}`).addEventListener("input", ({ target }) => look({ [name]: target.valueAsNumber }));
find("#ao").addEventListener("input", ({ target }) => look({ ao: target.checked }));
find("#switch").hidden = data.layers < 2;
modules.forEach(({ textures }, k) => textures && find("#module").add(new Option(k, k)));
find("#module").addEventListener("change", ({ target }) => look({ module: Number(target.value) }));
let held = 0; // where the pointer was last
canvas.addEventListener("pointerdown", ({ pointerId, clientX }) => { canvas.setPointerCapture(pointerId); held = clientX; });
canvas.addEventListener("pointermove", ({ pointerId, clientX }) => {
  if (!canvas.hasPointerCapture(pointerId)) return;
  look({ x: state.x + (clientX - held) * 60 * across / canvas.clientWidth });
  held = clientX;
});
canvas.addEventListener("webglcontextlost", () => { find("#status").textContent = "the graphics card lost the pictures: load the page again."; });
open().catch((error) => { find("#status").textContent = `${error.message}.`; });
