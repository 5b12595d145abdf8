// The panels beside the arena: signals of the chosen robot at the moment that is shown, its figures, the legend.

let cells = { readings: [], shown: [], utilities: [] }; // what is written anew for each moment
let namesShown = -1; // for how many names the panels were made: a live run may show new ones

function hide(id, is) {
  $(id).hidden = is;
}
// Anew for another robot.
function makePanels() {
  document.title = run.title + " · boebot " + (pageIsLive ? "live" : "replay");
  say("title", run.title + (run.known && run.table.arena ? " in " + run.table.arena : ""));
  say("poseName", run.known ? "true pose" : "odometry");
  hide("truth", !run.known);
  hide("estimateRow", !run.estimate);
  hide("errorRow", !run.estimate);
  document.querySelectorAll(".lamp").forEach(lamp => {
    lamp.hidden = !run.has(lamp.dataset.device);
  });
  hide("pingRow", !run.has("ping"));
  hide(
    "sensors",
    !["whisker_left", "whisker_right", "infrared_left", "infrared_right", "ping"].some(name => run.has(name)),
  );
  hide("mind", !run.mind);
  makeUtilities();
  makeFigures();
  makeReadings();
  makeRobots();
  namesShown = -1;
  makeShown();
}
// What hangs on names that a live run may add to.
function makeShown() {
  if (namesShown === run.names) return;
  namesShown = run.names;
  const rows = [...run.numbers, ...run.texts].map(one => row(one.name));
  cells.shown = rows.map(([, cell]) => cell);
  const layers = run.layers.map(layer => {
    const it = element("div", { textContent: "▬ " + layer.name });
    it.style.color = inText(layer.colour);
    return it;
  });
  $("shownRows").replaceChildren(...rows.map(([it]) => it), ...layers);
  hide("shown", !rows.length && !layers.length);
  makeLanes();
  makeLegend();
}
function makeReadings() {
  hide("readings", !run.readings.length);
  const table = $("readings").querySelector("table");
  table.replaceChildren();
  cells.readings = run.readings.map(reading => {
    const it = table.insertRow();
    it.insertCell().textContent = reading.name;
    return [it.insertCell(), it.insertCell()];
  });
}
// Of each process its utility, in the colour of its line below.
const processes = () => (run.mind ? [...run.mind.behaviors, ...run.mind.cognitive] : []);
function makeUtilities() {
  cells.utilities = processes().map(({ name, colour }) => {
    const fill = element("i"),
      value = element("span", { className: "value" }),
      label = element("span", { textContent: name, title: name });
    label.style.color = colour ? inText(colour) : colours.faint;
    fill.style.background = colour ? readable(colour) : colours.faint;
    const whole = element("div", { className: "utility" }, label, element("div", { className: "bar" }, fill), value);
    return { whole, fill, value };
  });
  $("utilities").replaceChildren(...cells.utilities.map(({ whole }) => whole));
}
function makeFigures() {
  const { table } = run,
    length = table.run_time_s ?? null;
  say(
    "summary",
    [
      length === null ? "" : length.toFixed(1) + " s",
      ...run.way,
      table.seed === undefined ? "" : "seed " + table.seed,
      !table.ended || table.ended === "complete" ? "" : "ended early: " + table.ended,
    ]
      .filter(Boolean)
      .join("  ·  "),
  );
  const shown = Object.entries(table).filter(
    ([name, value]) => value !== null && !["brain", "board", "arena", "ended"].includes(name),
  );
  $("table").replaceChildren(
    ...shown.map(([name, value]) => row(name.replace(/_(m|s)$/, " ($1)").replace(/_/g, " "), value)[0]),
  );
  hide("figures", !shown.length);
}
function makeRobots() {
  hide("robots", runs.length < 2);
  $("robot").replaceChildren(
    ...runs.map((one, i) =>
      element("option", {
        value: i + 1,
        textContent: "robot " + (i + 1) + ": " + one.brain + ", " + (one.table.robot ?? ""),
        selected: one === run,
      }),
    ),
  );
  $("robot").style.borderColor = $("robot").style.color = inText(run.colour);
}

// ---- the legend: only what there is ----
function makeLegend() {
  const entries = runs.map((one, i) => [
    swatch("line", readable(one.colour)),
    runs.length > 1 ? "robot " + (i + 1) : run.known ? "true path" : "path by odometry",
  ]);
  if (run.known && runs.length === 1) entries[0][1] += " (the simulator's truth)";
  if (run.estimate) entries.push([swatch("dashed", colours.estimate), "odometry"]);
  if (run.known) entries.push([swatch("contact", colours.contact), "true contact"]);
  if (run.has("whisker_left") || run.has("whisker_right"))
    entries.push([swatch("touch", colours.touch), "whisker touch"]);
  if (run.mind) for (const one of run.mind.behaviors) entries.push([swatch("block", readable(one.colour)), one.name]);
  if (run.mind && run.mind.cognitive.length) entries.push([swatch("line", colours.faint), "cognitive process"]);
  for (const kind of ["switch", "fault", "lost", "reset", "intervention"])
    if (run.events.some(event => event.kind === kind))
      entries.push([swatch(kind, eventColour({ kind })), EVENT_KINDS[kind]]);
  $("legend").replaceChildren(
    ...entries.map(([mark, text]) =>
      element("div", { className: "entry" }, mark, element("span", { textContent: text })),
    ),
  );
}
// A small canvas.
function swatch(form, colour) {
  const canvas = element("canvas", { width: 22 * ratio, height: 14 * ratio, ariaHidden: "true" }),
    c = canvas.getContext("2d"),
    y = 7 * ratio;
  c.strokeStyle = c.fillStyle = colour;
  c.lineWidth = 2 * ratio;
  if (form === "block") c.fillRect(3 * ratio, 2 * ratio, 16 * ratio, 10 * ratio);
  else if (form === "line" || form === "dashed") {
    if (form === "dashed") c.setLineDash([5 * ratio, 3 * ratio]);
    c.beginPath();
    c.moveTo(ratio, y);
    c.lineTo(21 * ratio, y);
    c.stroke();
  } else if (eventMark(c, form, 11 * ratio, y, 4.5 * ratio)) c.fill();
  else c.stroke();
  return canvas;
}

// ---- one moment ----
function bar({ style }, value) {
  style.left = (value < 0 ? 50 + 50 * Math.max(-1, value) : 50) + "%";
  style.width = Math.min(50, Math.abs(50 * value)) + "%";
}
const pingText = i => (run.ping.values[i] > 0 ? run.ping.values[i].toFixed(2) + " m" : "no echo");
const stateText = bits =>
  bits & 128 ? "driven by the board's own brain" : bits & 32 ? "stopped by dead-man" : bits & 64 ? "off" : "driven";
function tellMoment() {
  const i = tickOf(run),
    bits = run.flags.values[i],
    place = placeOf(run);
  say("clock", now.toFixed(2) + " / " + run.duration.toFixed(2) + " s");
  if (run.mind) tellMind();
  [
    ["left", run.left, 0],
    ["right", run.right, 1],
  ].forEach(([name, column, k]) => {
    const pulse = run.pulses ? run.pulses[k].values[i] : NaN;
    bar($(name + "Bar"), column.values[i]);
    say(name + "Text", signed(column.values[i]) + (pulse > 0 ? "   " + pulse.toFixed(0) + " µs" : ""));
  });
  say("state", stateText(bits));
  document.querySelectorAll(".lamp").forEach(lamp => {
    const on = !!(bits & Number(lamp.dataset.bit));
    lamp.classList.toggle("on", on);
    lamp.style.background = on ? colours[lamp.dataset.colour] : "";
    lamp.ariaLabel = lamp.dataset.name + (on ? ": on" : ": off");
  });
  say("ping", pingText(i));
  run.readings.forEach((reading, k) => tellReading(reading, cells.readings[k], i));
  [...run.numbers, ...run.texts].forEach((one, k) => {
    if (cells.shown[k]) cells.shown[k].textContent = shownText(one, now);
  });
  say("pose", asPose(place));
  if (run.estimate) {
    const ghost = poseAt(run.time.values, run.estimate, now);
    say("estimate", asPose(ghost));
    say("error", Math.hypot(ghost[0] - place[0], ghost[1] - place[1]).toFixed(2) + " m");
  }
}
function tellReading(reading, [valueCell, ageCell], i) {
  const value = reading.values.values[i],
    age = reading.ages.values[i];
  valueCell.textContent = Number.isNaN(value) ? "–" : minus(value.toFixed(reading.digits)) + " " + reading.unit;
  ageCell.textContent = Number.isNaN(age) ? "" : (age * 1000).toFixed(0) + " ms";
}
function tellMind() {
  const { mind } = run;
  if (!mind.time.length) return;
  const step = indexIn(mind.time.values, now + 1e-4),
    behavior = mind.behaviors[mind.motor.values[step]]; // times are rounded to float32
  say("behavior", behavior.name);
  $("behavior").style.color = inText(behavior.colour);
  processes().forEach((process, k) => {
    const { whole, fill, value } = cells.utilities[k],
      utility = process.utility.values[step] ?? NaN;
    whole.classList.toggle("active", process === behavior);
    bar(fill, utility || 0);
    value.textContent = Number.isNaN(utility) ? "–" : signed(utility);
  });
  if (!mind.switches.length) return;
  const [since, , reason] =
    mind.switches[
      indexIn(
        mind.switches.map(one => one[0]),
        mind.time.values[step] + 1e-3,
      )
    ];
  say("since", "since " + since.toFixed(2) + " s");
  say("reason", reason);
}
