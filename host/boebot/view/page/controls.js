// What one can do to a run that goes on, beside driving and moving: pause, step, speed, restart, parameters; and what the
// server tells of it: how fast it goes, the link, printed text.

// ---- controls: only what can be done ----
function makeControls() {
  const make = (id, text, title, onclick, more = {}) =>
    element("button", { id, textContent: text, title, onclick, className: "live", ...more });
  document.querySelectorAll("#controls .live, #tools .live").forEach(it => it.remove());
  hide("play", true);
  hide("wholeLabel", true);
  hide("speedLabel", !can.has("speed"));
  const buttons = [];
  if (can.has("hand"))
    buttons.push(make("stop", "Stop", "Emergency stop of this robot (space)", stopRobot, { className: "live alert" }));
  if (can.has("pause"))
    buttons.push(
      make(
        "pause",
        "Pause",
        "Pause the run, or go on",
        () => send({ type: state && state.paused ? "resume" : "pause" }),
        { className: "live main" },
      ),
    );
  if (can.has("step"))
    buttons.push(
      make("step", "Step", "One step of the brain, then pause", () => {
        setNewest(true);
        send({ type: "step" });
      }),
    );
  if (can.has("restart")) buttons.push(make("restart", "Restart …", "Begin the run anew", askRestart));
  $("controls").prepend(...buttons);
  $("clock").after(
    make("newest", "Live", "Show the newest moment (End)", () => setNewest(true), { ariaPressed: "true" }),
  );
  if (can.has("drag"))
    $("tools").append(
      make("move", "move", "Move a robot or a shape (M); or drag it, and turn it by the wheel", pickUp),
    );
  if (can.has("speed")) makeSpeeds();
  makeDrive();
}
const SPEEDS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50];
function makeSpeeds() {
  $("speed").replaceChildren(
    ...SPEEDS.map(v => element("option", { value: v, textContent: v + " ×" })),
    element("option", { value: "", textContent: "fastest" }),
  );
  $("speed").onchange = () => send({ type: "speed", speed: $("speed").value === "" ? null : Number($("speed").value) });
}
function tellSpeed() {
  if (!can.has("speed") || document.activeElement === $("speed")) return;
  const value = state.speed === null ? "" : String(state.speed);
  if (![...$("speed").options].some(option => option.value === value))
    $("speed").append(element("option", { value, textContent: value + " ×" }));
  $("speed").value = value;
}
// Off: nothing can be asked for, except another run where there may be one.
function setControls(on) {
  const again = ended !== null && on;
  document.querySelectorAll(".live, #speed, #drive button, #drive input, #parameters input").forEach(it => {
    it.disabled = it.id === "newest" ? false : it.id === "restart" ? !(on || again) : !on || ended !== null;
  });
}

// ---- another run ----
const RESTART = `<form><h2>Begin the run anew</h2>
  <div class="seed"><label for="seed">seed</label><input type="number" id="seed" min="0" step="1">
    <button type="button" id="anotherSeed">another</button></div>
  <div id="choices"><h3>Imperfections of the simulated robot, and what is so without each</h3><div class="choices"></div></div>
  <div class="buttons"><button type="button" id="cancel">Cancel</button><button class="main">Restart</button></div></form>`;
function askRestart() {
  const dialog = element("dialog", { id: "restartDialog", ariaLabel: "Restart", innerHTML: RESTART });
  document.body.append(dialog);
  const imperfections = live.imperfections || [];
  const boxes = imperfections.map(one => element("input", { type: "checkbox", name: one.name, checked: !one.off }));
  dialog.querySelector(".choices").append(...imperfections.map((one, k) => choice(one, boxes[k])));
  hide("choices", !boxes.length);
  $("seed").value = live.seed ?? 0;
  $("anotherSeed").onclick = () => ($("seed").value = Math.floor(Math.random() * 1e6));
  $("cancel").onclick = () => dialog.close();
  dialog.onclose = () => dialog.remove();
  dialog.querySelector("form").onsubmit = event => {
    event.preventDefault();
    const seed = Math.max(0, Math.round(Number($("seed").value) || 0));
    send({ type: "restart", seed, without: boxes.filter(box => !box.checked).map(box => box.name) });
    dialog.close();
  };
  dialog.showModal();
  $("seed").select();
}
function choice(imperfection, box) {
  const text = element("span", {}, element("b", { textContent: imperfection.name }), " " + (imperfection.text || ""));
  return element("label", { className: "choice" }, box, text);
}

// ---- what is told of the run ----
// Screen readers hear it where it is of another kind, not with each new rate.
function tellConnection(text, kind = "") {
  const it = $("connection");
  if (it.dataset.kind !== kind) say("announced", text);
  it.hidden = false;
  it.dataset.kind = kind;
  say("connection", text);
}
function tellState() {
  if (ended !== null) tellConnection(endedText(), "ended");
  else if (state) {
    const rate = state.paused
      ? "paused"
      : state.rate === null
        ? "live"
        : "live, " + (state.rate < 9.95 ? state.rate.toFixed(1) : state.rate.toFixed(0)) + " × real time";
    tellConnection(
      [rate, state.touched ? "touched: " + state.touched : ""].filter(Boolean).join("  ·  "),
      state.paused ? "paused" : "live",
    );
  }
  if (!state) return;
  if ($("pause")) {
    const text = state.paused ? "Resume" : "Pause";
    if ($("pause").textContent !== text) $("pause").textContent = text;
  }
  tellSpeed();
  tellDrive();
  tellParameters();
  tellLink();
}
function notice(sentence) {
  const it = $("notice");
  it.textContent = sentence;
  it.hidden = false;
  clearTimeout(notice.timer);
  notice.timer = setTimeout(() => {
    it.hidden = true;
  }, 6000);
}
const PRINTED = 20000; // letters that stay
function tellPrinted(text) {
  if (!text) return;
  const it = $("print"),
    atEnd = it.scrollTop + it.clientHeight > it.scrollHeight - 8;
  it.textContent = (it.textContent + text).slice(-PRINTED);
  hide("printed", false);
  if (atEnd) it.scrollTop = it.scrollHeight;
}
function robotState() {
  return (state && state.robots && state.robots[runs.indexOf(run)]) || {};
}
let linkCells = null;
function tellLink() {
  const { link } = robotState(),
    load = robotState().load ?? (run.load && run.load.length ? run.load.last : null);
  hide("linkCard", !link && load == null);
  if (!link && load == null) return;
  if (!linkCells) {
    linkCells = Object.fromEntries(
      [
        "lost frames",
        "damaged frames",
        "round trip",
        "sessions lost",
        "resets",
        "load of the bus",
        "errors on the bus",
        "lost on the bus",
        "load of the tick",
      ].map(name => [name, row(name, " ")]),
    );
    $("linkCard").append(...Object.values(linkCells).map(([it]) => it));
  }
  const values = {
    "lost frames": link?.lost,
    "damaged frames": link?.bad,
    "round trip": link?.round_trip_s == null ? null : (1000 * link.round_trip_s).toFixed(1) + " ms",
    "sessions lost": link?.sessions_lost,
    resets: link?.resets,
    "load of the bus": link?.bus?.load == null ? null : (100 * link.bus.load).toFixed(1) + " %",
    "errors on the bus": link?.bus?.errors,
    "lost on the bus": link?.bus?.lost,
    "load of the tick": load == null ? null : (100 * load).toFixed(0) + " %",
  };
  for (const [name, [it, cell]] of Object.entries(linkCells)) {
    it.hidden = values[name] == null;
    cell.textContent = values[name] ?? "";
  }
}

// ---- a brain's parameters ----
let sliders = [];
function makeParameters() {
  const list = (live && live.robots[runs.indexOf(run)]?.parameters) || [];
  hide("parameters", !can.has("parameters") || !list.length);
  sliders = list.map(makeSlider);
  const utilities = element("details", {}, element("summary", { textContent: "Utilities" }));
  $("parameters").replaceChildren($("parameters").querySelector("h2"));
  for (const { parameter, whole } of sliders) (parameter.name.includes(".utility.") ? utilities : $("parameters")).append(whole);
  $("parameters").append(utilities);
}
function makeSlider(parameter) {
  const range = parameter.least != null && parameter.most != null,
    output = element("span", { className: "value" });
  const input = element(
    "input",
    range ? { type: "range", min: parameter.least, max: parameter.most, step: "any" } : { type: "number", step: "any" },
  );
  const one = { parameter, input, output, changed: -Infinity, due: null };
  input.value = parameter.value;
  input.ariaLabel = parameter.name + (parameter.unit ? ", " + parameter.unit : "");
  input.oninput = () => {
    one.changed = performance.now();
    tellSlider(one);
    sendSoon(one);
  };
  one.whole = element(
    "label",
    { className: "parameter", title: parameter.text || "" },
    element("span", { textContent: parameter.name }),
    output,
    input,
  );
  tellSlider(one);
  return one;
}
function tellSlider({ parameter, input, output }) {
  output.textContent = short(Number(input.value)) + (parameter.unit ? " " + parameter.unit : "");
}
// Ten times a second at most, and the last value surely.
function sendSoon(one) {
  const robot = runs.indexOf(run);
  one.due ??= setTimeout(() => {
    one.due = null;
    send({ type: "parameter", robot, name: one.parameter.name, value: Number(one.input.value) });
  }, 100);
}
function tellParameters() {
  const values = robotState().parameters || {};
  for (const one of sliders) {
    const value = values[one.parameter.name];
    if (value === undefined || performance.now() - one.changed < 1000 || Number(one.input.value) === value) continue;
    one.input.value = value;
    tellSlider(one);
  }
}
hooks.chosen = () => {
  makeParameters();
  if (state) tellState();
};
