// The lanes: what each signal looks like over time, and its value as text. A lane has a name, a height in pixels, `draw`,
// `at`, its value at a time as text, and maybe `label`, which writes its scale beside it.

const HEIGHTS = { events: 20, utility: 112, signal: 42, ping: 40, curve: 36, flags: 19, pin: 19 }; // pixels
const CURVES = 4; // of the numbers that the brain shows have a lane; the others are in the list only

// ---- which lanes there are ----
function makeLanes() {
  lanes = [{ name: "events", height: HEIGHTS.events, draw: drawEvents, at: eventAt }];
  if (run.mind)
    lanes.push({ name: "utility", height: HEIGHTS.utility, draw: drawUtilities, label: labelUtilities, at: utilityAt });
  lanes.push({ name: "motors", height: HEIGHTS.signal, draw: drawSignals, label: labelSignals, at: signalsAt });
  if (run.has("ping"))
    lanes.push({
      name: "Ping",
      height: HEIGHTS.ping,
      draw: drawPing,
      label: (c, box) => write(c, box, farthestEcho().toFixed(1) + " m", 0.5),
      at: t => pingText(tickAt(t)),
    });
  if (run.has("infrared_left") || run.has("infrared_right"))
    lanes.push(flagsLane("IR", 4, 8, "charger", ["left", "right"]));
  if (run.has("whisker_left") || run.has("whisker_right"))
    lanes.push(flagsLane("whiskers", 1, 2, "touch", ["left", "right"]));
  if (run.known) lanes.push(flagsLane("true contact", CONTACT_BIT, 0, "contact", ["contact"]));
  if (run.load)
    lanes.push({
      name: "load of tick",
      height: HEIGHTS.curve,
      draw: drawLoad,
      label: (c, box) => write(c, box, "100 %", 0.2),
      at: t => (100 * run.load.values[tickAt(t)]).toFixed(0) + " %",
    });
  for (const one of run.numbers.slice(0, CURVES))
    lanes.push({
      name: one.name,
      height: HEIGHTS.curve,
      draw: (c, box) => drawShown(c, box, one.values.values),
      label: (c, box) => labelShown(c, box, one.values.values),
      at: t => shownText(one, t),
    });
  for (const pin of run.pins)
    lanes.push({
      name: pin.name,
      height: HEIGHTS.pin,
      draw: (c, box) => drawPin(c, box, pin),
      at: t => pinText(pin, t),
    });
  $("signals").style.setProperty("--height", AXIS + lanes.reduce((sum, lane) => sum + lane.height, 0) + "px");
}
const flagsLane = (name, first, second, colour, words) => ({
  name,
  height: HEIGHTS.flags,
  draw(c, box) {
    drawFlags(c, box, first, second ? 0.16 : 0.22, second ? 0.3 : 0.56, colours[colour]);
    if (second) drawFlags(c, box, second, 0.56, 0.3, colours[colour]);
  },
  at(t) {
    const bits = run.flags.values[tickAt(t)];
    return (
      [first, second]
        .map((bit, k) => (bits & bit ? words[k] : ""))
        .filter(Boolean)
        .join(" and ") || "none"
    );
  },
});
const tickAt = t => indexIn(run.time.values, t);
const inGutter = name => (name.length > 14 ? name.slice(0, 13) + "…" : name);

// A line through values; where there are many for a pixel, from the least to the greatest of each pixel.
function drawCurve(c, box, times, values, y) {
  const first = indexIn(times, box.from),
    end = Math.min(values.length - 1, indexIn(times, box.to) + 1);
  c.beginPath();
  if (end - first < 3 * box.width) {
    for (let i = first; i <= end; i++)
      i === first ? c.moveTo(box.px(times[i]), y(values[i])) : c.lineTo(box.px(times[i]), y(values[i]));
  } else {
    const each = Math.ceil((end - first) / box.width);
    for (let i = first; i <= end; i += each) {
      let least = values[i],
        most = values[i];
      for (let j = i; j < Math.min(end + 1, i + each); j++) {
        least = Math.min(least, values[j]);
        most = Math.max(most, values[j]);
      }
      const x = box.px(times[i]);
      i === first ? c.moveTo(x, y(least)) : c.lineTo(x, y(least));
      c.lineTo(x, y(most));
    }
  }
  c.stroke();
}
const write = (c, box, text, at) => c.fillText(text, box.left - 5 * ratio, box.top + at * box.height); // of the scale, beside the lane
const SIGNALS = [
  ["L", "left", "end"],
  ["R", "right", "estimate"],
];
function drawSignals(c, box) {
  const y = v => box.middle - v * box.height * 0.42;
  c.lineWidth = 1.2 * ratio;
  for (const [, name, colour] of SIGNALS) {
    c.strokeStyle = colours[colour];
    drawCurve(c, box, run.time.values, run[name].values, y);
  }
}
function labelSignals(c, box) {
  font(c, 11.5);
  c.textAlign = "left";
  SIGNALS.forEach(([sign, , colour], k) => {
    c.fillStyle = colours[colour];
    c.fillText(sign, box.left - (30 - 12 * k) * ratio, box.middle);
  });
}
const signalsAt = t => "left " + signed(run.left.values[tickAt(t)]) + ", right " + signed(run.right.values[tickAt(t)]);
function drawLoad(c, box) {
  c.strokeStyle = colours.end;
  c.lineWidth = 1.2 * ratio;
  drawCurve(c, box, run.time.values, run.load.values, v => box.top + box.height * (0.94 - 0.86 * Math.min(1, v)));
}
const farthestEcho = () => run.ping.values.reduce((a, b) => Math.max(a, b), 0.1);
function drawPing(c, box) {
  const times = run.time.values,
    far = farthestEcho(),
    end = Math.min(run.last, indexIn(times, box.to) + 1);
  c.fillStyle = colours.end;
  c.globalAlpha = 0.7;
  for (let i = indexIn(times, box.from); i <= end; i++) {
    if (run.ping.values[i] <= 0) continue;
    const x = box.px(times[i]),
      wide = i < run.last ? box.px(times[i + 1]) - x : ratio;
    c.fillRect(
      x,
      box.top + box.height * (0.94 - (0.86 * run.ping.values[i]) / far),
      Math.max(ratio, wide),
      1.6 * ratio,
    );
  }
  c.globalAlpha = 1;
}
// A bar while the bit is set.
function drawFlags(c, box, bit, at, tall, colour) {
  const times = run.time.values,
    flags = run.flags.values,
    end = Math.min(run.last, indexIn(times, box.to) + 1);
  c.fillStyle = colour;
  for (let i = indexIn(times, box.from), begun = -1; i <= end + 1; i++) {
    const on = i <= end && flags[i] & bit;
    if (on && begun < 0) begun = i;
    if (!on && begun >= 0) {
      c.fillRect(
        box.px(times[begun]),
        box.top + box.height * at,
        Math.max(1.5 * ratio, box.px(times[i - 1]) - box.px(times[begun])),
        box.height * tall,
      );
      begun = -1;
    }
  }
}
// The least and the greatest.
function extent(values) {
  let least = Infinity,
    most = -Infinity;
  for (const v of values)
    if (Number.isFinite(v)) {
      if (v < least) least = v;
      if (v > most) most = v;
    }
  return [least, most];
}
// A value that the brain shows, between its least and its greatest; it holds until the next one.
function drawShown(c, box, values) {
  const times = run.shownTime.values,
    [least, most] = extent(values);
  const y = v => box.top + box.height * (most > least ? 0.92 - (0.84 * (v - least)) / (most - least) : 0.5);
  c.strokeStyle = colours.charger;
  c.lineWidth = 1.3 * ratio;
  c.beginPath();
  for (let i = indexIn(times, box.from), before = NaN; i < values.length && (times[i] <= box.to || !i); i++) {
    const v = values[i],
      from = box.px(times[i]),
      to = i + 1 < values.length ? box.px(times[i + 1]) : box.px(run.duration);
    if (!Number.isNaN(v)) {
      if (Number.isNaN(before)) c.moveTo(from, y(v));
      else c.lineTo(from, y(v));
      c.lineTo(to, y(v));
    }
    before = v;
  }
  c.stroke();
}
function labelShown(c, box, values) {
  const [least, most] = extent(values);
  if (most > least) {
    font(c, 9);
    write(c, box, short(most), 0.22);
    write(c, box, short(least), 0.8);
  }
}
// Numbers are in a column, texts in a list.
function shownText(one, t) {
  const i = shownAt(run.shownTime.values, t);
  if (Array.isArray(one.values)) return i < 0 ? "" : (one.values[i] ?? "");
  return i < 0 ? "–" : short(one.values.values[i] ?? NaN);
}

// A line for each process, from -1 to 1, and below them a band in the colour of the active motor behavior.
const utilityShare = u => 0.42 - 0.36 * u; // of the lane's height
function drawUtilities(c, box) {
  const times = run.mind.time.values,
    y = u => box.top + box.height * utilityShare(u);
  c.strokeStyle = colours.grid;
  c.lineWidth = ratio;
  for (const u of [-1, 0, 1]) {
    c.beginPath();
    c.moveTo(box.left, y(u));
    c.lineTo(box.right, y(u));
    c.stroke();
  }
  c.lineWidth = 0.8 * ratio;
  c.strokeStyle = colours.faint;
  for (const process of run.mind.cognitive) drawCurve(c, box, times, process.utility.values, y);
  c.lineWidth = 1.6 * ratio;
  for (const behavior of run.mind.behaviors) {
    c.strokeStyle = readable(behavior.colour);
    drawCurve(c, box, times, behavior.utility.values, y);
  }
  drawBand(c, box, times, run.mind.motor.values);
}
const labelUtilities = (c, box) => {
  for (const u of [-1, 0, 1]) write(c, box, minus(String(u)), utilityShare(u));
};
function drawBand(c, box, times, motor) {
  const from = indexIn(times, box.from),
    end = indexIn(times, box.to);
  if (!times.length) return;
  for (let i = from, begun = from; i <= end; i++)
    if (i === end || motor[i + 1] !== motor[begun]) {
      const left = Math.max(box.left, box.px(times[begun])),
        right = Math.min(box.right, i + 1 < times.length ? box.px(times[i + 1]) : box.px(run.duration));
      c.fillStyle = readable(run.mind.behaviors[motor[begun]].colour);
      c.fillRect(left, box.top + box.height * 0.84, right - left, box.height * 0.13);
      begun = i + 1;
    }
}
function utilityAt(t) {
  const i = indexIn(run.mind.time.values, t + 1e-4),
    active = run.mind.behaviors[run.mind.motor.values[i]];
  const values = [...run.mind.behaviors, ...run.mind.cognitive].map(
    one => one.name + " " + signed(one.utility.values[i] ?? NaN).trim(),
  );
  return (active ? active.name + " is active: " : "") + values.join(", ");
}

// ---- pins: a line that is low or high, or in the middle while the pin is released ----
const PIN_WORDS = ["low", "high", "released", "pulled up"];
const PIN_SHARES = [0.8, 0.2, 0.55, 0.4]; // of the lane's height
function drawPin(c, box, pin) {
  const times = pin.time.values,
    levels = pin.level.values,
    y = level => box.top + box.height * PIN_SHARES[level];
  let i = shownAt(times, box.from);
  c.strokeStyle = colours.ink;
  c.lineWidth = ratio;
  c.beginPath();
  if (i < 0) c.moveTo(box.px(times[++i]), y(levels[i]));
  else c.moveTo(box.left, y(levels[i])); // before its first edge nobody knows
  for (i++; i < times.length && times[i] <= box.to; i++) {
    const x = box.px(times[i]),
      pixel = Math.floor(x);
    c.lineTo(x, y(levels[i - 1]));
    if (i + 1 < times.length && Math.floor(box.px(times[i + 1])) === pixel) {
      // several edges in a pixel
      while (i + 1 < times.length && Math.floor(box.px(times[i + 1])) === pixel) i++;
      c.lineTo(x, y(0));
      c.lineTo(x, y(1));
    }
    c.lineTo(x, y(levels[i]));
  }
  c.lineTo(Math.min(box.right, box.px(i < times.length ? times[i] : run.duration)), y(levels[i - 1]));
  c.stroke();
}
function pinText(pin, t) {
  const times = pin.time.values,
    i = indexIn(times, t),
    word = PIN_WORDS[pin.level.values[i]];
  if (times[i] > t || i + 1 >= times.length) return word;
  const us = (times[i + 1] - times[i]) * 1e6;
  return word + " for " + (us < 1e4 ? us.toFixed(us < 100 ? 2 : 0) + " µs" : (us / 1e3).toFixed(1) + " ms");
}

// ---- events: a mark each, another form for each kind ----
const EVENT_KINDS = {
  switch: "switch",
  contact: "true contact",
  touch: "touch",
  fault: "fault",
  lost: "lost frames",
  reset: "restart",
  intervention: "intervention",
};
function eventColour(event) {
  const behavior = event.kind === "switch" && run.mind && run.mind.behaviors.find(one => one.name === event.on);
  if (behavior) return readable(behavior.colour);
  return (
    {
      contact: colours.contact,
      touch: colours.touch,
      fault: colours.alert,
      lost: colours.alert,
      reset: colours.alert,
      intervention: colours.accent,
    }[event.kind] || colours.faint
  );
}
// Adds its form to a path of its own; true: to be filled.
function eventMark(c, kind, x, y, r) {
  c.beginPath();
  if (kind === "switch") {
    c.moveTo(x, y - r);
    c.lineTo(x, y + r);
    return false;
  }
  if (kind === "contact") {
    c.moveTo(x - r, y - r);
    c.lineTo(x + r, y + r);
    c.moveTo(x + r, y - r);
    c.lineTo(x - r, y + r);
    return false;
  }
  if (kind === "touch") {
    c.arc(x, y, 0.8 * r, 0, 7);
    return false;
  }
  if (kind === "lost") {
    c.moveTo(x - r, y);
    c.lineTo(x - r / 3, y);
    c.moveTo(x + r / 3, y);
    c.lineTo(x + r, y);
    return false;
  }
  if (kind === "intervention") {
    c.moveTo(x, y - r);
    c.lineTo(x + r, y);
    c.lineTo(x, y + r);
    c.lineTo(x - r, y);
    c.closePath();
    return true;
  }
  if (kind === "reset") {
    c.arc(x, y, 0.8 * r, 0.8, 6);
    return false;
  }
  c.moveTo(x, y - r);
  c.lineTo(x + r, y + r);
  c.lineTo(x - r, y + r);
  c.closePath();
  return true; // a fault
}
function drawEvents(c, box) {
  c.lineWidth = 1.6 * ratio;
  for (const event of run.events) {
    if (event.time < box.from || event.time > box.to) continue;
    c.strokeStyle = c.fillStyle = eventColour(event);
    if (eventMark(c, event.kind, box.px(event.time), box.middle, 5 * ratio)) c.fill();
    else c.stroke();
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
