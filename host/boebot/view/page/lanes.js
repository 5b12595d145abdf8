// Signals over time in lanes under a time axis: the canvas "tracks" (drawn when time goes beyond it, or there is more to
// show) and above it the canvas "cursor".
//
// A lane: name, height (pixels), `at`: its value at a time as text; and what it shows, each where there is any:
//   curves   {times, value(i), colour, width, holds: the value stands until the next one}, between the ends of `range`
//   blocks   {times, colour(i): null: none; at, tall: shares of the lane's height}
//   scale    [value, text, colour] beside the lane; rules: with a line at each value
//   draw     anything else; legend: of its marks, in place of the name where the pointer is on that

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
// Where time runs on both canvases, and where a moment is, in their pixels.
function timeField() {
  const [from, to] = span(),
    left = GUTTER * ratio,
    right = $("tracks").width - RIGHT * ratio,
    width = right - left;
  return { from, to, left, right, width, px: t => left + ((t - from) / (to - from)) * width };
}
function laneBoxes() {
  const field = timeField();
  let top = AXIS * ratio;
  return lanes.map(lane => {
    const height = lane.height * ratio,
      box = { ...field, lane, top, height, middle: top + height / 2 };
    top += height;
    return box;
  });
}
// Of the pointer.
function timeOfPixel(offsetX) {
  const { from, to, left, width } = timeField();
  return from + ((offsetX * ratio - left) / width) * (to - from);
}
function drawTracks() {
  const canvas = $("tracks"),
    c = canvas.getContext("2d");
  c.clearRect(0, 0, canvas.width, canvas.height);
  drawAxis(c);
  for (const box of laneBoxes()) {
    const { name, range, scale = () => [], curves = [], blocks = [], draw } = box.lane,
      ends = range?.() ?? [0, 1];
    rule(c, 0, canvas.width, box.top);
    c.fillStyle = colours.faint;
    font(c, 11.5);
    c.textBaseline = "middle";
    c.textAlign = "left";
    c.fillText(inGutter(name), 8 * ratio, box.middle);
    c.textAlign = "right";
    font(c, 10);
    for (const [value, text, colour = colours.faint] of scale()) {
      c.fillStyle = colour;
      const inside = Math.min(box.top + box.height - 7 * ratio, Math.max(box.top + 7 * ratio, laneY(box, ends, value)));
      c.fillText(text, box.left - 5 * ratio, inside);
    }
    c.save();
    c.beginPath();
    c.rect(box.left, box.top, box.width, box.height);
    c.clip();
    if (box.lane.rules) for (const [value] of scale()) rule(c, box.left, box.right, laneY(box, ends, value));
    for (const curve of curves) drawCurve(c, box, ends, curve);
    for (const one of blocks) drawBlocks(c, box, one);
    draw?.(c, box);
    c.restore();
  }
  tracksDirty = false;
}
function straight(c, colour, wide, x0, y0, x1, y1) {
  c.strokeStyle = colour;
  c.lineWidth = wide * ratio;
  c.beginPath();
  c.moveTo(x0, y0);
  c.lineTo(x1, y1);
  c.stroke();
}
const rule = (c, from, to, y) => straight(c, colours.grid, 1, from, y, to, y);
const laneY = (box, [low, high], value) =>
  box.top + box.height * (high > low ? 0.92 - (0.84 * (value - low)) / (high - low) : 0.5);
// Where values are many for a pixel, from the least to the greatest of some; with a gap where none is known.
function drawCurve(c, box, ends, { times, value, colour, width = 1.2, holds }) {
  const all = times(),
    first = indexIn(all, box.from),
    end = Math.min(all.length - 1, indexIn(all, box.to) + 1),
    each = Math.max(1, Math.ceil((end - first) / (3 * box.width)));
  let isDown = false;
  c.strokeStyle = colour;
  c.lineWidth = width * ratio;
  c.beginPath();
  for (let i = first; i <= end; i += each) {
    const next = Math.min(end + 1, i + each),
      [least, most] = extent(i, next, value),
      x = box.px(all[i]);
    if (most >= least) {
      isDown ? c.lineTo(x, laneY(box, ends, least)) : c.moveTo(x, laneY(box, ends, least));
      if (most > least) c.lineTo(x, laneY(box, ends, most));
      if (holds) {
        const last = laneY(box, ends, value(next - 1));
        c.lineTo(x, last);
        c.lineTo(box.px(next < all.length ? all[next] : run.duration), last);
      }
    }
    isDown = most >= least;
  }
  c.stroke();
}
// The least and the greatest of those that are known.
function extent(from, to, value) {
  let least = Infinity,
    most = -Infinity;
  for (let i = from; i < to; i++) {
    const v = value(i);
    if (!Number.isFinite(v)) continue;
    if (v < least) least = v;
    if (v > most) most = v;
  }
  return [least, most];
}
// A bar for each stretch of one colour.
function drawBlocks(c, box, { times, colour, at, tall }) {
  const all = times(),
    end = indexIn(all, box.to);
  for (let i = indexIn(all, box.from), begun = i; i <= end && all.length; i++) {
    const fill = colour(begun);
    if (i < end && colour(i + 1) === fill) continue;
    if (fill) {
      const left = Math.max(box.left, box.px(all[begun])),
        right = Math.min(box.right, box.px(i + 1 < all.length ? all[i + 1] : run.duration));
      c.fillStyle = fill;
      c.fillRect(left, box.top + box.height * at, Math.max(1.5 * ratio, right - left), box.height * tall);
    }
    begun = i + 1;
  }
}
const inGutter = name => (name.length > 14 ? name.slice(0, 13) + "…" : name);
function drawAxis(c) {
  const { from, to, right, width, px } = timeField(),
    step = stepOf((62 * ratio * (to - from)) / width),
    digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  font(c, 11);
  c.textBaseline = "middle";
  c.textAlign = "center";
  c.fillStyle = colours.faint;
  for (let k = Math.ceil(from / step - 1e-9); k * step <= to; k++) {
    const x = px(k * step);
    straight(c, colours.grid, 1, x, (AXIS - 4) * ratio, x, $("tracks").height);
    if (x < right - 12 * ratio) c.fillText((k * step).toFixed(digits), x, (AXIS * ratio) / 2);
  }
  c.textAlign = "left";
  c.fillText("time, s", 8 * ratio, (AXIS * ratio) / 2);
}
// ---- the cursor, above them ----
let hoverTime = null;
function drawCursor() {
  const { width, height } = $("cursor"),
    c = $("cursor").getContext("2d"),
    { left, right, px } = timeField();
  c.clearRect(0, 0, width, height);
  const upright = (t, colour, wide) => {
    const x = px(t);
    if (x >= left - 1 && x <= right + 1) straight(c, colour, wide, x, 0, x, height);
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

// ---- which lanes there are ----
const CURVES = 4; // of the numbers that the brain shows have a lane; the others are in the list only
const tickAt = t => indexIn(run.time.values, t);
const ticks = () => run.time.values;
function makeLanes() {
  const legend = Object.values(EVENTS).map(([mark, , words]) => mark + " " + words);
  lanes = [{ name: "events", legend: legend.join("\n"), height: 20, draw: drawEvents, at: eventAt }];
  if (run.mind) lanes.push(mindLane());
  if (!run.program) lanes.push(motorsLane());
  const ping = run.reading("ping");
  if (ping)
    lanes.push(
      numberLane(ping.name, ticks, i => ping.values.values[i], {
        colour: colours.end,
        range: () => [0, Math.max(0.1, extent(0, ping.values.length, i => ping.values.values[i])[1])],
        scale: ([, far]) => [[far / 2, far.toFixed(1) + " m"]],
        at: t => readingText(ping, tickAt(t)),
      }),
    );
  for (const group of new Set(run.signs.map(groupOf)))
    lanes.push(
      flagLane(
        group,
        run.signs.filter(sign => groupOf(sign) === group),
      ),
    );
  if (run.known) lanes.push(flagLane("true contact", [{ device: "contact", colour: "contact" }]));
  for (const one of run.numbers.slice(0, CURVES))
    lanes.push(
      numberLane(one.name, () => run.shownTime.values, i => one.values.values[i], {
        colour: colours.charger,
        range: () => extent(0, one.values.length, i => one.values.values[i]),
        scale: ([least, most]) => (most > least ? [least, most].map(value => [value, short(value)]) : []),
        at: t => shownText(one, t),
      }),
    );
  for (const pin of run.pins)
    lanes.push({
      ...numberLane(pin.name, () => pin.time.values, i => PIN_LEVELS[pin.level.values[i]], {
        colour: colours.ink,
        range: () => [-0.2, 1.2],
        scale: () => [],
        at: t => pinText(pin, t),
      }),
      height: 19,
    });
  $("signals").style.setProperty("--height", AXIS + lanes.reduce((sum, lane) => sum + lane.height, 0) + "px");
}
function motorsLane() {
  return {
    name: "motors",
    height: 42,
    range: () => [-1.1, 1.1],
    curves: [
      { times: ticks, value: i => run.left.values[i], colour: colours.end },
      { times: ticks, value: i => run.right.values[i], colour: colours.estimate },
    ],
    scale: () => [
      [0.5, "L", colours.end],
      [-0.5, "R", colours.estimate],
    ],
    at: t => "left " + signed(run.left.values[tickAt(t)]) + ", right " + signed(run.right.values[tickAt(t)]),
  };
}
// Of a number that stands until the next one.
function numberLane(name, times, value, { colour, range, scale, at }) {
  return { name, height: 38, at, range, scale: () => scale(range()), curves: [{ times, value, colour, holds: true }] };
}
// The signs of left and right are in one lane.
const groupOf = ({ device }) => device.replace(/_(left|right)$/, "");
function flagLane(name, flags) {
  const tall = 0.6 / flags.length;
  return {
    name,
    height: 19,
    blocks: flags.map(({ device, colour }, k) => ({
      times: ticks,
      colour: i => (run.isOn(device, i) ? colourOf(colour) : null),
      at: (k + 0.5) / flags.length - tall / 2,
      tall,
    })),
    at: t =>
      flags
        .filter(({ device }) => run.isOn(device, tickAt(t)))
        .map(({ device }) => device.replace(name + "_", ""))
        .join(" and ") || "none",
  };
}
// A line for each process, from -1 to 1, and below them a band in the colour of the active motor behavior.
function mindLane() {
  const { mind } = run,
    times = () => mind.time.values,
    curve = (process, colour, width) => ({ times, value: i => process.utility.values[i], colour, width });
  return {
    name: "utility",
    height: 112,
    range: () => [-1.45, 1.1],
    scale: () => [-1, 0, 1].map(u => [u, minus(String(u))]),
    rules: true,
    curves: [
      ...mind.cognitive.map(process => curve(process, colours.faint, 0.8)),
      ...mind.behaviors.map(process => curve(process, readable(process.colour), 1.6)),
    ],
    blocks: [{ times, colour: i => readable(mind.behaviors[mind.motor.values[i]].colour), at: 0.84, tall: 0.13 }],
    at: utilityAt,
  };
}
function utilityAt(t) {
  const i = indexIn(run.mind.time.values, t + 1e-4),
    active = run.mind.behaviors[run.mind.motor.values[i]];
  const values = processes().map(one => one.name + " " + signed(one.utility.values[i] ?? NaN).trim());
  return (active ? active.name + " is active: " : "") + values.join(", ");
}
// Numbers are in a column, texts in a list.
function shownText(one, t) {
  const i = shownAt(run.shownTime.values, t);
  if (Array.isArray(one.values)) return i < 0 ? "" : (one.values[i] ?? "");
  return i < 0 ? "–" : short(one.values.values[i] ?? NaN);
}
const PIN_WORDS = ["low", "high", "released", "pulled up"];
const PIN_LEVELS = [0, 1, 0.4, 0.65];
function pinText(pin, t) {
  const times = pin.time.values,
    i = indexIn(times, t),
    word = PIN_WORDS[pin.level.values[i]];
  if (times[i] > t || i + 1 >= times.length) return word;
  const us = (times[i + 1] - times[i]) * 1e6;
  return word + " for " + (us < 1e4 ? us.toFixed(us < 100 ? 2 : 0) + " µs" : (us / 1e3).toFixed(1) + " ms");
}

// ---- events: a mark each, another form for each kind; its colour in the palette, and its words ----
const EVENTS = {
  switch: ["│", "faint", "switch"],
  contact: ["✕", "contact", "true contact"],
  touch: ["○", "touch", "touch"],
  fault: ["▲", "alert", "fault"],
  lost: ["╍", "alert", "lost frames"],
  reset: ["↻", "alert", "restart"],
  intervention: ["▼", "accent", "intervention"],
};
function drawEvents(c, box) {
  font(c, 14);
  c.textAlign = "center";
  for (const { time, kind, on } of run.events) {
    if (time < box.from || time > box.to) continue;
    const behavior = on && run.mind?.behaviors.find(one => one.name === on);
    c.fillStyle = behavior ? readable(behavior.colour) : colours[EVENTS[kind][1]];
    c.fillText(EVENTS[kind][0], box.px(time), box.middle);
  }
}
const eventText = event => event.time.toFixed(2) + " s: " + (event.kind === "switch" ? "switch to " : "") + event.text;
// Those about as near as the pointer can tell.
function eventAt(t) {
  const [from, to] = span(),
    near = ((to - from) * 6) / Math.max(1, $("cursor").clientWidth);
  const found = run.events.filter(event => Math.abs(event.time - t) <= near);
  return (
    found.slice(0, 4).map(eventText).join("\n") + (found.length > 4 ? "\nand " + (found.length - 4) + " more" : "") ||
    "none here"
  );
}
