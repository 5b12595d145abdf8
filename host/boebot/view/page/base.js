// What all parts of the page share: the run's data, elements, colours, numbers as text.
"use strict";
const page = /*DATA*/null;
const LAYER_COLOURS = /*LAYERS*/[];
const pageIsLive = page === null || page.live !== null;

const $ = id => document.getElementById(id);
const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
const floats = text => new Float32Array(bytes(text).buffer);

function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  Object.assign(made, properties);
  made.append(...children);
  return made;
}
// Calls `press` with true when the button is pressed, by a pointer or one of the keys, and with false when it is let go.
function onHold(button, keys, press) {
  button.onpointerdown = e => {
    button.setPointerCapture(e.pointerId);
    press(true);
  };
  button.onpointerup = button.onpointercancel = button.onblur = () => press(false);
  button.onkeydown = e => {
    if (!keys.includes(e.key)) return;
    e.preventDefault();
    e.stopPropagation(); // it is not the key that pauses
    press(true);
  };
  button.onkeyup = e => keys.includes(e.key) && press(false);
  button.oncontextmenu = e => e.preventDefault(); // of a long press
}
// Of a panel; returns the row and its right cell.
function row(name, value = "") {
  const cell = element("span", { textContent: value });
  return [element("div", { className: "row" }, element("span", { textContent: name }), cell), cell];
}
// Writes only what is new: a text that is written anew is laid out anew.
function say(id, text) {
  const it = $(id);
  if (it.textContent !== text) it.textContent = text;
}

// ---- numbers as text ----
const minus = text => text.replace("-", "−");
const signed = v => (v < 0 ? "−" : v > 0 ? "+" : " ") + Math.abs(v).toFixed(2);
const short = v => (Number.isNaN(v) ? "–" : minus(String(Number(v.toPrecision(4)))));
const asPose = p =>
  minus(p[0].toFixed(2)) + ", " + minus(p[1].toFixed(2)) + " m, " + minus(((p[2] * 180) / Math.PI).toFixed(0)) + "°";

// The least of 1, 2, 5, 10, 20, 50... that is not smaller: from line to line of a scale.
function stepOf(least) {
  const ten = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map(k => k * ten).find(step => step >= least) ?? 10 * ten;
}

// ---- the palette of style.py, light or dark, from the CSS variables ----
const COLOURS = (
  "paper floor ink faint grid rule accent alert edge solid dull low paint-dark paint-bright rough " +
  "smooth charger lamp moving start end estimate touch contact body"
).split(" ");
const colours = {};
function readColours() {
  const css = getComputedStyle(document.documentElement);
  for (const name of COLOURS) colours[name] = css.getPropertyValue("--" + name).trim();
}
const channels = colour => [1, 3, 5].map(k => parseInt(colour.slice(k, k + 2), 16));
// Colours of robots, behaviors and layers are chosen for lines on paper. On a dark floor they are made lighter, in texts on
// paper darker.
const isDark = () => channels(colours.floor)[0] < 128;
function contrasting(colour) {
  const mixed = channels(colour).map(v => Math.round(v + 0.45 * ((isDark() ? 255 : 0) - v)));
  return "#" + mixed.map(v => v.toString(16).padStart(2, "0")).join("");
}
const readable = colour => (isDark() ? contrasting(colour) : colour); // of lines and areas
const inText = contrasting;
