"use strict";
// The picture of an eye before lenses, as lfssao/rendering/lenslet_viewer.py has it: columns depend on x alone and rows
// on y, so each picture is some columns and rows of the panel.

const find = (selector) => document.querySelector(selector);
const data = JSON.parse(find("#data").textContent);
const canvas = find("canvas"), context = canvas.getContext("2d", { alpha: false }), { width, height } = canvas;
const { panel, size, screen } = data, [panelWidth, panelHeight] = size;
const state = { x: data.eye[0], y: data.eye[1], distance: data.distance, ao: true, other: false };
const image = context.createImageData(width, height), colors = new Uint32Array(image.data.buffer);
const [BLACK, ORANGE] = new Uint32Array(new Uint8Array([0, 0, 0, 255, 255, 128, 0, 255]).buffer);
let panels = [], waiting = false;

// Pitches from the middle to the lens, or elemental image, that is nearest to a place.
const steps = (place, pitch) => Math.floor(place / pitch + data.start) + (0.5 - data.start);

// The place on the panel that the eye sees through a point of the lenses, along one axis, metres.
function seen(point, eye) {
  const middle = data.lensPitch * steps(point, data.lensPitch);
  const slope = (point - eye) / state.distance - (point - middle) / data.focalLength;
  return point + data.gap * slope;
}

// Of each pixel of an axis, the panel's texel, -1 for none, and whether it is of another lens's image. The sign is 1 for
// columns and -1 for rows, which run against y.
function texels(pixels, sign, axis, eye) {
  return Array.from({ length: pixels }, (_, i) => {
    const point = screen[axis] * (sign * ((i + 0.5) / pixels - 0.5));
    const at = Math.floor(size[axis] * (0.5 + sign * seen(point, eye) / panel[axis]));
    const middle = (at + (0.5 - size[axis] / 2)) * (panel[axis] / size[axis]);
    const other = steps(middle, data.imagePitch) !== sign * steps(point, data.lensPitch);
    return { at: at >= 0 && at < size[axis] ? at : -1, other };
  });
}

function draw() {
  const columns = texels(width, 1, 0, state.x), rows = texels(height, -1, 1, state.y);
  const shown = panels[state.ao ? panels.length - 1 : 0];
  for (let j = 0; j < height; j++) {
    for (let i = 0; i < width; i++) {
      const column = columns[i], row = rows[j], lit = column.at >= 0 && row.at >= 0;
      const color = lit ? shown[row.at * panelWidth + column.at] : BLACK;
      colors[j * width + i] = state.other && lit && (column.other || row.other) ? ORANGE : color;
    }
  }
  context.putImageData(image, 0, 0);
}

// Put the eye elsewhere or switch what is shown: what the controls show, and the next frame.
function look(change) {
  Object.assign(state, change);
  for (const [name, [least, most]] of [["x", data.eyes], ["y", data.eyes], ["distance", data.distances]]) {
    state[name] = Math.min(Math.max(state[name], least), most);
    Object.assign(find(`#${name}`), { min: least, max: most }).value = state[name];
    find(`#${name} + output`).value = (1000 * state[name]).toFixed(2);
  }
  for (const name of ["ao", "other"]) find(`#${name}`).checked = state[name];
  if (!waiting) requestAnimationFrame(() => { waiting = false; draw(); });
  waiting = true;
}

async function decoded(png) {
  const picture = Object.assign(new Image(), { src: `data:image/png;base64,${png}` });
  await picture.decode();
  const canvas = Object.assign(document.createElement("canvas"), { width: panelWidth, height: panelHeight });
  const context = canvas.getContext("2d", { alpha: false, willReadFrequently: true });
  context.drawImage(picture, 0, 0);
  return new Uint32Array(context.getImageData(0, 0, panelWidth, panelHeight).data.buffer);
}

async function open() {
  find("#status").textContent = "reading the panel";
  panels = await Promise.all(data.panels.map(decoded));
  find("#status").textContent = "";
  look({});
  canvas.dataset.ready = true;
}

const [across, away] = [data.eyes, data.distances].map(([least, most]) => (most - least) / 60);
const KEYS = {
  ArrowLeft: () => ({ x: state.x - across }),
  ArrowRight: () => ({ x: state.x + across }),
  ArrowUp: () => ({ y: state.y + across }),
  ArrowDown: () => ({ y: state.y - across }),
  "+": () => ({ distance: state.distance - away }),
  "-": () => ({ distance: state.distance + away }),
  a: () => ({ ao: !state.ao }),
};
document.addEventListener("keydown", (event) => {
  const key = event.key.length > 1 ? event.key : event.key.toLowerCase();
  const taken = event.ctrlKey || event.metaKey || event.altKey || event.target.matches("[type=range]");
  if (taken || !(key in KEYS)) return;
  event.preventDefault();
  look(KEYS[key]());
});
for (const name of ["x", "y", "distance"]) {
  find(`#${name}`).addEventListener("input", ({ target }) => look({ [name]: target.valueAsNumber }));
}
for (const name of ["ao", "other"]) find(`#${name}`).addEventListener("input", ({ target }) => look({ [name]: target.checked }));
find("#switch").hidden = data.panels.length < 2;
let held = [0, 0]; // where the pointer was last
canvas.addEventListener("pointerdown", ({ pointerId, clientX, clientY }) => {
  canvas.setPointerCapture(pointerId);
  held = [clientX, clientY];
});
canvas.addEventListener("pointermove", ({ pointerId, clientX, clientY }) => {
  if (!canvas.hasPointerCapture(pointerId)) return;
  const step = 60 * across / canvas.clientWidth;
  look({ x: state.x + (clientX - held[0]) * step, y: state.y - (clientY - held[1]) * step });
  held = [clientX, clientY];
});
open().catch((error) => { find("#status").textContent = `${error.message}.`; });
