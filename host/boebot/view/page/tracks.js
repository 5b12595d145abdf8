// Signals over time in lanes under a time axis: the canvas "tracks" (drawn when time goes beyond it, or there is more to
// show) and above it the canvas "cursor". What is in the lanes: lanes.js.

const [GUTTER, AXIS, RIGHT] = [112, 20, 10]; // pixels: of names at the left, of the time above, free at the right
const SHORTEST = 1e-3; // s, of the time that is shown
let lanes = [];
let tracksDirty = true;
let spanLength = null; // of the time that is shown, in s; null: the whole run
let spanBegin = 0;
function tracksChanged() {
  tracksDirty = true;
  requestDraw();
}

// ---- which time is shown ----
// From, to (s).
function span() {
  if (spanLength === null || (spanLength >= run.duration && !pageIsLive)) return [0, Math.max(run.duration, SHORTEST)];
  return [spanBegin, spanBegin + spanLength];
}
// As paper that is turned over: half of what was shown stays.
function keepCursorInside() {
  if (spanLength === null) return;
  const before = spanBegin;
  if (now > spanBegin + spanLength) spanBegin = now - spanLength / 2;
  if (now < spanBegin) spanBegin = now - spanLength / 2;
  const latest = pageIsLive ? Infinity : Math.max(0, run.duration - spanLength);
  spanBegin = Math.min(latest, Math.max(0, spanBegin));
  if (spanBegin !== before) tracksDirty = true;
}
function zoomTime(factor, about = now) {
  const [from, to] = span(),
    length = Math.max(SHORTEST, (to - from) * factor);
  if (length >= run.duration && !pageIsLive) spanLength = null;
  else {
    spanLength = length;
    spanBegin = Math.max(0, about - ((about - from) / (to - from)) * length);
    spanBegin = pageIsLive ? spanBegin : Math.min(spanBegin, run.duration - length);
  }
  tracksChanged();
}

// ---- drawing them ----
// Where each lane is, in pixels of the canvas.
function laneBoxes() {
  const [from, to] = span(),
    left = GUTTER * ratio,
    right = $("tracks").width - RIGHT * ratio,
    width = right - left;
  let top = AXIS * ratio;
  return lanes.map(lane => {
    const height = lane.height * ratio,
      px = t => left + ((t - from) / (to - from)) * width;
    const box = { lane, top, height, middle: top + height / 2, left, right, width, from, to, px };
    top += height;
    return box;
  });
}
const timeOfPixel = offsetX => {
  // of the pointer
  const [from, to] = span(),
    width = $("cursor").clientWidth - GUTTER - RIGHT;
  return from + ((offsetX - GUTTER) / width) * (to - from);
};
function drawTracks() {
  const canvas = $("tracks"),
    c = canvas.getContext("2d");
  c.clearRect(0, 0, canvas.width, canvas.height);
  drawAxis(c);
  for (const box of laneBoxes()) {
    c.strokeStyle = colours.grid;
    c.lineWidth = ratio;
    c.beginPath();
    c.moveTo(0, box.top);
    c.lineTo(canvas.width, box.top);
    c.stroke();
    c.fillStyle = colours.faint;
    font(c, 11.5);
    c.textBaseline = "middle";
    c.textAlign = "left";
    c.fillText(inGutter(box.lane.name), 8 * ratio, box.middle);
    c.textAlign = "right";
    font(c, 10);
    box.lane.label?.(c, box);
    c.save();
    c.beginPath();
    c.rect(box.left, box.top, box.width, box.height);
    c.clip();
    box.lane.draw(c, box);
    c.restore();
  }
  tracksDirty = false;
}
const TIME_STEPS = [1, 2, 5]
  .flatMap(k => [-6, -5, -4, -3, -2, -1, 0, 1, 2, 3, 4, 5].map(e => k * 10 ** e))
  .sort((a, b) => a - b);
function drawAxis(c) {
  const [from, to] = span(),
    left = GUTTER * ratio,
    right = $("tracks").width - RIGHT * ratio,
    width = right - left;
  const step = TIME_STEPS.find(one => (one / (to - from)) * width >= 62 * ratio) || 1e6,
    digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  font(c, 11);
  c.textBaseline = "middle";
  c.textAlign = "center";
  c.lineWidth = ratio;
  c.fillStyle = colours.faint;
  c.strokeStyle = colours.grid;
  for (let k = Math.ceil(from / step - 1e-9); k * step <= to; k++) {
    const x = left + ((k * step - from) / (to - from)) * width;
    c.beginPath();
    c.moveTo(x, AXIS * ratio - 4 * ratio);
    c.lineTo(x, $("tracks").height);
    c.stroke();
    if (x < right - 12 * ratio) c.fillText((k * step).toFixed(digits), x, (AXIS * ratio) / 2);
  }
  c.textAlign = "left";
  c.fillText("time, s", 8 * ratio, (AXIS * ratio) / 2);
}
// ---- the cursor, above them ----
let hoverTime = null;
function drawCursor() {
  const canvas = $("cursor"),
    c = canvas.getContext("2d"),
    [from, to] = span(),
    left = GUTTER * ratio,
    width = canvas.width - (GUTTER + RIGHT) * ratio;
  c.clearRect(0, 0, canvas.width, canvas.height);
  const upright = (t, colour, wide) => {
    const x = left + ((t - from) / (to - from)) * width;
    if (x < left - 1 || x > left + width + 1) return;
    c.strokeStyle = colour;
    c.lineWidth = wide * ratio;
    c.beginPath();
    c.moveTo(x, 0);
    c.lineTo(x, canvas.height);
    c.stroke();
  };
  if (hoverTime !== null) upright(hoverTime, colours.faint, 1);
  upright(now, colours.ink, 1.6);
}
function listenToTracks() {
  const cursor = $("cursor");
  cursor.addEventListener("pointerdown", e => {
    if (e.offsetX > GUTTER - 8) {
      cursor.setPointerCapture(e.pointerId);
      seek(timeOfPixel(e.offsetX));
    }
  });
  cursor.addEventListener("pointermove", e => {
    if (e.buttons && cursor.hasPointerCapture(e.pointerId)) seek(timeOfPixel(e.offsetX));
  });
  cursor.addEventListener(
    "wheel",
    e => {
      if (e.offsetX < GUTTER) return; // there it scrolls the lanes
      e.preventDefault();
      zoomTime(Math.exp(e.deltaY * (e.deltaMode ? 0.05 : 0.0015)), timeOfPixel(e.offsetX));
    },
    { passive: false },
  );
  $("shorter").onclick = () => zoomTime(0.5);
  $("longer").onclick = () => zoomTime(2);
}
