// Runs the script of a replay page without a browser: elements and canvases only keep what they are given.
// node replay_page.js PAGE TIME... prints one JSON object per time: texts by id, readings, fills and shapes drawn.
"use strict";
const fs = require("fs"), vm = require("vm");
const page = fs.readFileSync(process.argv[2], "utf-8"), script = /<script>([\s\S]*)<\/script>/.exec(page)[1];
const palette = Object.fromEntries([.../:root \{(.*?)\}/.exec(page)[1].matchAll(/(--[\w-]+): ([^;]+);/g)].map(([, name, value]) => [name, value]));

let drawn = [];
function canvasContext() {
  let path = [], matrix = [1, 0, 0, 1, 0, 0];
  const kept = [], place = (x, y) => { const [a, b, c, d, e, f] = matrix; return [a * x + c * y + e, b * x + d * y + f]; };
  const times = (a, b, c, d, e, f) => { matrix = [...place(a, b).map((v, k) => v - matrix[4 + k]), ...place(c, d).map((v, k) => v - matrix[4 + k]), ...place(e, f)]; };
  const state = {
    save() { kept.push(matrix); },
    restore() { matrix = kept.pop(); },
    setTransform(...given) { matrix = given; },
    translate(x, y) { times(1, 0, 0, 1, x, y); },
    scale(x, y) { times(x, 0, 0, y, 0, 0); },
    rotate(angle) { const cos = Math.cos(angle), sin = Math.sin(angle); times(cos, sin, -sin, cos, 0, 0); },
    beginPath() { path = []; },
    arc(x, y, radius) { path.push([...place(x, y), radius]); },
    moveTo(x, y) { path.push(place(x, y)); },
    lineTo(x, y) { path.push(place(x, y)); },
    fill() { drawn.push({ fill: this.fillStyle, alpha: this.globalAlpha ?? 1, path }); },
    stroke() { if (path.length < 40) drawn.push({ stroke: this.strokeStyle, path }); },
    createImageData(width, height) { return { data: new Uint8ClampedArray(4 * width * height) }; },
    drawImage(image, ...box) { if (box.length === 4) drawn.push({ image: box }); },
    fillText(text) { drawn.push({ text }); },
    fillRect(x, y, width, height) { drawn.push({ bar: this.fillStyle, x, width }); },
  };
  return new Proxy(state, { get: (target, key) => (key in target ? target[key] : () => {}), set: (target, key, value) => { target[key] = value; return true; } });
}
function element() {
  const cells = [], it = {
    style: { setProperty() {} }, dataset: {}, children: [], cells, textContent: "", checked: true, value: "1", clientWidth: 800, clientHeight: 600, hidden: false,
    classList: { toggle(name, on) { it.on = on; } },
    append(...more) { it.children.push(...more); },
    replaceChildren(...more) { it.children = more; },
    insertRow() { const row = element(); it.children.push(row); return row; },
    insertCell() { const cell = element(); cells.push(cell); return cell; },
    querySelector(name) { return (it[name] ??= element()); },
    getContext() { return (it.context ??= canvasContext()); },
    addEventListener() {}, setAttribute() {}, setPointerCapture() {},
  };
  return it;
}
const byId = {};
Object.assign(globalThis, {
  document: { getElementById: id => (byId[id] ??= element()), createElement: element, querySelectorAll: () => [], documentElement: {} },
  getComputedStyle: () => ({ getPropertyValue: name => palette[name] }), matchMedia: () => ({ addEventListener() {} }),
  ResizeObserver: class { observe() {} },
  location: { hash: "" }, addEventListener() {}, requestAnimationFrame() {}, devicePixelRatio: 1,
});
vm.runInThisContext(script);
const still = drawn;
for (const time of process.argv.slice(3)) {
  drawn = [];
  vm.runInThisContext(`seek(${Number(time)})`);
  const texts = Object.fromEntries(Object.entries(byId).map(([id, it]) => [id, it.textContent]));
  const readings = (byId.readings?.table?.children ?? []).map(row => row.cells.map(cell => cell.textContent));
  const hidden = Object.keys(byId).filter(id => byId[id].hidden);
  const lit = (byId.lamps?.children ?? []).map(lamp => [lamp.textContent, lamp.on]);
  const values = (byId.shownRows?.children ?? []).filter(row => row.children.length === 2).map(row => row.children.map(cell => cell.textContent));
  console.log(JSON.stringify({ texts, shown: values, readings, hidden, lamps: lit, still, drawn, scale: vm.runInThisContext("[scale, shiftX, shiftY]") }));
}
