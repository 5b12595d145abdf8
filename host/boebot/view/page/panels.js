// The panels beside the arena: signals of the chosen robot at the moment that is shown, its figures.

let cells = { lamps: [], readings: [], shown: [], utilities: [] }; // what is written anew for each moment
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
  cells.lamps = run.signs.map(({ device }) => element("div", { className: "lamp", textContent: device.replaceAll("_", " ") }));
  cells.lamps.forEach(lamp => lamp.setAttribute("role", "img"));
  $("lamps").replaceChildren(...cells.lamps);
  hide("sensors", !run.signs.length);
  say("shownName", run.program ? "What it shows" : "What the brain shows");
  hide("mind", !run.mind);
  hide("motors", run.program); // it does not say what they get
  if (!pageIsLive) hide("printed", !run.printed.length);
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

// ---- one moment ----
function bar({ style }, value) {
  style.left = (value < 0 ? 50 + 50 * Math.max(-1, value) : 50) + "%";
  style.width = Math.min(50, Math.abs(50 * value)) + "%";
}
const STATES = ["driven", "off", "stopped by dead-man", "driven by the board's own brain"]; // as of page_data.py
function tellMoment() {
  const i = tickOf(run),
    place = placeOf(run);
  say("clock", now.toFixed(2) + " / " + run.duration.toFixed(2) + " s");
  if (run.mind) tellMind();
  for (const name of ["left", "right"]) {
    bar($(name + "Bar"), run[name].values[i]);
    say(name + "Text", signed(run[name].values[i]));
  }
  say("state", STATES[run.state.values[i]]);
  run.signs.forEach(({ values, colour }, k) => {
    const lamp = cells.lamps[k],
      on = values.values[i] > 0;
    lamp.classList.toggle("on", on);
    lamp.style.background = on ? colourOf(colour) : "";
    lamp.ariaLabel = lamp.textContent + (on ? ": on" : ": off");
  });
  run.readings.forEach((reading, k) => {
    const [valueCell, ageCell] = cells.readings[k],
      age = reading.ages.values[i];
    valueCell.textContent = readingText(reading, i);
    ageCell.textContent = Number.isNaN(age) ? "" : (age * 1000).toFixed(0) + " ms";
  });
  [...run.numbers, ...run.texts].forEach((one, k) => {
    if (cells.shown[k]) cells.shown[k].textContent = shownText(one, now);
  });
  if (!pageIsLive && run.program) tellPrintedBy(now);
  say("pose", asPose(place));
  if (run.estimate) {
    const ghost = poseAt(run.time.values, run.estimate, now);
    say("estimate", asPose(ghost));
    say("error", Math.hypot(ghost[0] - place[0], ghost[1] - place[1]).toFixed(2) + " m");
  }
}
const LINES = 200; // before the moment that is shown
function tellPrintedBy(time) {
  let end = run.printed.length;
  while (end > 0 && run.printed[end - 1][0] > time) end--;
  const lines = run.printed.slice(Math.max(0, end - LINES), end),
    text = lines.map(([at, line]) => at.toFixed(4).padStart(9) + "  " + line).join("\n");
  if ($("print").textContent === text) return;
  $("print").textContent = text;
  $("print").scrollTop = $("print").scrollHeight;
}
function readingText({ values, digits, unit }, i) {
  const value = values.values[i];
  return Number.isNaN(value) ? "–" : minus(value.toFixed(digits)) + " " + unit;
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
  const switched = mind.switches.map(([time]) => time),
    [since, , reason] = mind.switches[indexIn(switched, mind.time.values[step] + 1e-3)];
  say("since", "since " + since.toFixed(2) + " s");
  say("reason", reason);
}

// ---- values under the pointer, in the lanes ----
function tip(event, lines) {
  const it = $("tip");
  it.textContent = lines;
  it.hidden = !lines;
  if (!lines) return;
  const x = Math.min(event.clientX + 14, innerWidth - it.offsetWidth - 8),
    y = event.clientY + 18 + it.offsetHeight > innerHeight ? event.clientY - it.offsetHeight - 12 : event.clientY + 18;
  it.style.transform = `translate(${Math.max(4, x)}px, ${Math.max(4, y)}px)`;
}
function hoverTracks(event) {
  const t = timeOfPixel(event.offsetX),
    [from, to] = span();
  const box = laneBoxes().find(one => event.offsetY * ratio >= one.top && event.offsetY * ratio < one.top + one.height);
  const inside = event.offsetX >= GUTTER && t >= from && t <= Math.min(to, run.duration);
  hoverTime = inside ? t : null;
  tip(
    event,
    inside
      ? (to - from < 0.5 ? t.toFixed(5) : t.toFixed(2)) +
          " s" +
          (box ? "\n" + box.lane.name + ": " + box.lane.at(t) : "")
      : box
        ? (box.lane.legend ?? box.lane.name)
        : "",
  );
  requestDraw();
}
function listenToPointer() {
  $("cursor").addEventListener("pointermove", hoverTracks);
  $("cursor").addEventListener("pointerleave", event => {
    hoverTime = null;
    tip(event, "");
    requestDraw();
  });
}
