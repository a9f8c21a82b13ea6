"use strict";
// The viewer: both sides of one texture and their difference under one zoom and pan, and the texel under the crosshair.
// A place is in the address, #module/layer/column,row, so every texel is a link and the browser's Back works.

const find = (selector, within = document) => within.querySelector(selector);
const all = (selector, within = document) => [...within.querySelectorAll(selector)];
const viewer = find("#viewer"), pictures = find("#pictures"), canvases = all("canvas");
const view = { zoom: 1, left: 0, top: 0 }; // CSS pixels of a texel, and the texel in the canvases' corner
let article = null, texture = null, texel = null, opened = 0;

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
const digits = (v) => Object.is(v, -0) ? "-0" : String(Number(v.toPrecision(9))).replace("Infinity", "inf").replace("NaN", "nan");
const range = (low, high) => low.map(digits).join(" ") + " to " + high.map(digits).join(" ");

// The words of a cell, without the picture of a texel's samples below them.
const text = (cell) => cell.firstChild?.textContent ?? "";

async function picture(data) {
  const image = Object.assign(new Image(), { src: `data:image/png;base64,${data}` });
  await image.decode();
  return image;
}

async function unpacked(data) {
  const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Values of all sides: byte planes of the reference's bits, then of what the others' bits differ by.
async function numbers(made) {
  const planes = await unpacked(made.values);
  const bytes = new Uint8Array(planes.length), count = planes.length / made.bytes, side = planes.length / made.sides;
  for (let k = 0; k < bytes.length; k++) bytes[k] = planes[(k % made.bytes) * count + Math.floor(k / made.bytes)];
  for (let k = side; k < bytes.length; k++) bytes[k] ^= bytes[k % side];
  return made.bytes === 4 ? new Float32Array(bytes.buffer) : new Float64Array(bytes.buffer);
}

async function load(made) {
  return {
    ...made,
    reference: await picture(made.reference),
    mine: await picture(made.mine ?? made.reference),
    difference: await picture(made.difference),
    overview: made.overview && await picture(made.overview),
    values: made.values && await numbers(made),
    verdicts: made.verdicts && await unpacked(made.verdicts),
  };
}

// Half of what a canvas shows, in texels.
const half = () => [canvases[0].clientWidth / view.zoom / 2, canvases[0].clientHeight / view.zoom / 2];
const whole = () => Math.min(canvases[0].clientWidth / texture.width, canvases[0].clientHeight / texture.height);

function center(column, row, scale) {
  view.zoom = scale;
  const [wide, high] = half();
  [view.left, view.top] = [clamp(column, 0, texture.width) - wide, clamp(row, 0, texture.height) - high];
}

const fit = () => center(texture.width / 2, texture.height / 2, whole());

// Zoom so that the texel at x, y, CSS pixels of a canvas, stays there.
function zoom(factor, x, y) {
  const [column, row] = [view.left + x / view.zoom, view.top + y / view.zoom];
  view.zoom = clamp(view.zoom * factor, whole() / 2, 128);
  [view.left, view.top] = [column - x / view.zoom, row - y / view.zoom];
}

function pan(x, y) {
  const [wide, high] = half();
  center(view.left + wide + x / view.zoom, view.top + high + y / view.zoom, view.zoom);
}

function draw() {
  if (!texture) return;
  const ratio = devicePixelRatio, scale = view.zoom * ratio;
  for (const canvas of canvases) {
    canvas.width = Math.round(canvas.clientWidth * ratio);
    canvas.height = Math.round(canvas.clientHeight * ratio);
    // Less than a pixel a texel: maxima of blocks, so that one wrong texel stays visible.
    const far = canvas.dataset.picture === "difference" && texture.overview && scale < 1;
    const image = far ? texture.overview : texture[canvas.dataset.picture];
    const step = far ? texture.overview_step : texture.step;
    const context = canvas.getContext("2d");
    context.imageSmoothingEnabled = canvas.dataset.picture !== "difference" && scale * step < 1;
    context.setTransform(scale, 0, 0, scale, -view.left * scale, -view.top * scale);
    context.drawImage(image, 0, 0, image.width * step, image.height * step);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    if (texel) mark(context, canvas);
  }
}

// The crosshair, white within black so that it is seen on anything.
function mark(context, { clientWidth, clientHeight }) {
  const [x, y] = [(texel[0] + 0.5 - view.left) * view.zoom, (texel[1] + 0.5 - view.top) * view.zoom];
  const side = Math.max(view.zoom, 5) / 2, gap = side + 4, path = new Path2D();
  path.rect(x - side, y - side, 2 * side, 2 * side);
  for (const [from, to] of [[0, x - gap], [x + gap, clientWidth]]) path.rect(from, y, to - from, 0);
  for (const [from, to] of [[0, y - gap], [y + gap, clientHeight]]) path.rect(x, from, 0, to - from);
  for (const [color, width] of [["#000", 3], ["#fff", 1]]) {
    [context.strokeStyle, context.lineWidth] = [color, width];
    context.stroke(path);
  }
}

// What is known of the texel under the crosshair: exact values where the page has them, else those of the worst texels.
function read() {
  if (!texel) return { why: "point at a texel, or press N for the worst ones" };
  const [column, row] = texel, place = row * texture.width + column;
  const worst = find(`[data-texel="${column},${row}"]`, article);
  const [, verdict, mine, reference, interval, why] = worst ? [...worst.cells].map(text) : [];
  const said = { texel: `${column}, ${row}`, verdict, mine, reference, interval, why };
  if (!texture.values) {
    return worst ? said : { ...said, why: "of this texture the page holds a preview, and values of its worst texels" };
  }
  const { channels, sides, stored, values, words } = texture, from = (k) => k * values.length / sides + place * channels;
  const at = (k) => [...values.subarray(from(k), from(k) + channels)];
  const [right, own, low, high] = [0, 1, 2, 3].map((k) => k < sides ? at(k) : null);
  return {
    ...said,
    verdict: words[texture.verdicts[place]],
    mine: own.map(digits).join(" "),
    reference: right.map(digits).join(" ") + (stored ? (reference?.match(/ \(.*/)?.[0] ?? ", as stored") : ""),
    "off by": own.map((v, k) => Object.is(v, right[k]) ? "0" : digits(v - right[k])).join(" "),
    interval: low ? range(low, high) : "none is known",
    why: why ?? (texture.verdicts[place] === 2 ? expected() : ""),
  };
}

// Why a texel is wrong that is none of the worst: what holds for all of the texture, as each has its own reason else.
function expected() {
  const reason = text(find("[data-texel] td:last-child", article));
  return /^(expected|$)/.test(reason) ? reason : "each texel has its own reason: press N for those of the worst";
}

function show() {
  const said = read();
  for (const item of all("#readout dd")) {
    item.textContent = said[item.previousSibling.textContent] ?? "";
    item.className = /^outside|^different/.test(item.textContent) ? "wrong" : "";
  }
  draw();
}

function choose(column, row) {
  const [i, j] = [Math.floor(column), Math.floor(row)];
  texel = i >= 0 && j >= 0 && i < texture.width && j < texture.height ? [i, j] : null;
  show();
}

// Bars of a histogram: texels inside below, those outside above them.
function bars(counts) {
  const rows = counts[0].map((inside, k) => [inside, counts[1][k]]);
  const most = Math.log1p(Math.max(...rows.map(([inside, outside]) => inside + outside))) || 1;
  find("#histogram").hidden = !rows.flat().some((count) => count);
  find("#histogram div").replaceChildren(...rows.map(([inside, outside], k) => {
    const bar = document.createElement("span"), all = inside + outside, part = document.createElement("span");
    const ends = [k, k + 1].map((n) => texture.low * (texture.high / texture.low) ** (n / rows.length));
    bar.title = `${ends.map((v) => v.toPrecision(2)).join(" to ")}: ${inside} inside, ${outside} outside`;
    bar.style.height = `${100 * Math.log1p(all) / most}%`;
    part.style.height = `${100 * outside / (all || 1)}%`;
    bar.append(part);
    return bar;
  }));
}

// Mine in the place of the reference and back, twice a second, until the key is pressed again.
let blinking = 0;

function blink() {
  clearInterval(blinking);
  const canvas = canvases[1], caption = find("figcaption", canvas.parentElement);
  const show = (name) => { canvas.dataset.picture = caption.textContent = name; draw(); };
  if (blinking) [blinking] = [0, show("reference")];
  else blinking = setInterval(() => show(canvas.dataset.picture === "mine" ? "reference" : "mine"), 500);
}

// Open the texture that the address names, else the first that fails.
async function open() {
  const [module, layer, place] = location.hash.slice(1).split("/"), ticket = ++opened;
  const wanted = document.getElementById(`${module}/${layer}`) ?? document.getElementById(document.body.dataset.first);
  if (wanted !== article) {
    const data = wanted && find("script", wanted);
    const loaded = data ? await load(JSON.parse(data.textContent)) : null;
    if (ticket !== opened) return; // another was asked for meanwhile
    const same = texture && loaded && texture.width === loaded.width && texture.height === loaded.height;
    [article, texture] = [wanted, loaded];
    for (const other of all("article")) other.hidden = other !== article;
    for (const link of all(".verdicts a")) link.ariaCurrent = link.hash === `#${article?.id}` ? "true" : null;
    viewer.hidden = !texture;
    if (texture) {
      find("header", article).after(viewer);
      canvases.forEach((canvas) => { canvas.style.aspectRatio = `${texture.width} / ${texture.height}`; });
      bars(texture.counts);
      find("#ends").textContent = `logarithmic, ${+texture.low.toPrecision(3)} to ${+texture.high.toPrecision(3)}`;
      if (!same) { texel = null; fit(); }
    }
  }
  const [column, row] = (place ?? "").split(",").map(Number);
  if (!texture) return;
  if (place && column < texture.width && row < texture.height) {
    center(column + 0.5, row + 0.5, Math.max(view.zoom, 12));
    texel = [column, row];
  }
  show();
}

function next(step) {
  const links = all("[data-texel] a", article);
  const now = links.findIndex((link) => link.hash === location.hash);
  if (links.length) location.hash = links[now < 0 ? 0 : (now + step + links.length) % links.length].hash;
}

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

function press(key, shift) {
  const [wide, high] = half(), middle = [view.left + wide, view.top + high], arrow = ARROWS[key];
  const [column, row] = texel ?? middle;
  const seen = texel && Math.abs(column - middle[0]) < wide && Math.abs(row - middle[1]) < high;
  const stay = seen ? [column + 0.5, row + 0.5] : middle;
  const held = [(stay[0] - view.left) * view.zoom, (stay[1] - view.top) * view.zoom];
  const [right, bottom] = [texture.width - 1, texture.height - 1];
  if (arrow && shift) choose(clamp(column + arrow[0], 0, right), clamp(row + arrow[1], 0, bottom));
  else if (arrow) pan(40 * arrow[0], 40 * arrow[1]);
  else if (key === "+" || key === "=") zoom(1.5, ...held);
  else if (key === "-") zoom(1 / 1.5, ...held);
  else if (key === "0") fit();
  else if (/^[np]$/i.test(key)) next(/n/i.test(key) ? 1 : -1);
  else if (/^b$/i.test(key)) blink();
  else return false;
  draw();
  return true;
}

pictures.addEventListener("keydown", (event) => {
  if (!event.ctrlKey && !event.metaKey && !event.altKey && press(event.key, event.shiftKey)) event.preventDefault();
});
find("#keys").addEventListener("click", (event) => event.target.dataset.key && press(event.target.dataset.key, false));
for (const canvas of canvases) {
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(1.002 ** -event.deltaY, event.offsetX, event.offsetY);
    draw();
  }, { passive: false });
  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons) pan(-event.movementX, -event.movementY);
    choose(view.left + event.offsetX / view.zoom, view.top + event.offsetY / view.zoom);
  });
}
find("#failures")?.addEventListener("change", (event) => {
  find(".verdicts").classList.toggle("failures", event.target.checked);
});
// A link to where the address is already leads back there; the pictures get the keys of what was opened by a link.
document.addEventListener("click", (event) => {
  if (location.hash && event.target.closest?.("a")?.hash === location.hash) open();
});
addEventListener("hashchange", () => open().then(() => {
  pictures.focus({ preventScroll: true });
  viewer.scrollIntoView({ block: "nearest" });
}));
new ResizeObserver(draw).observe(pictures);
open();
