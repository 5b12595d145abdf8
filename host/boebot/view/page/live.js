// The live view: gets a run that goes on from the server that the page came from, shows its newest moment, or an earlier
// one, and asks for what the run's `can` allows. What it does not allow is not on the page.

let socket = null;
let live = null; // what can be done: see LiveView._live of boebot.live.live_view
let ownNumber = 0; // of this page
let can = new Set();
let state = null; // how the run is now
let ended = null; // why it has ended; null: it goes on
let newest = true; // the newest moment is shown; or one has gone back
const arrivals = []; // [wall clock, newest time], both in s, of late

// ---- the connection ----
function connect() {
  const address = new URL("stream" + location.search, location.href);
  address.protocol = location.protocol.replace("http", "ws");
  document.body.classList.toggle("waiting", !run); // there is nothing to show yet
  tellConnection("connecting …");
  socket = new WebSocket(address);
  socket.onopen = () => {
    send({ type: "hello" });
  };
  socket.onmessage = event => {
    const message = JSON.parse(event.data);
    receive[message.type]?.(message);
  };
  socket.onclose = disconnected;
}
function disconnected(event) {
  letGo();
  setControls(false);
  if (event.code === 1008 && event.reason) {
    tellConnection(event.reason, "lost"); // asked again it would say the same
    return;
  }
  if (ended !== null) {
    tellConnection(endedText() + " boebot has closed this view; what was shown stays here.", "ended");
    return;
  }
  tellConnection("Connection lost: boebot does not answer. Load the page again to try once more.", "lost");
}
function send(message) {
  if (socket && socket.readyState === 1) socket.send(JSON.stringify(message));
}
// What is to be done to a robot: the one that is chosen, or another.
const act = (deed, robot = runs.indexOf(run)) => send({ type: "do", robot, deed });
const receive = {
  run(content) {
    const chosen = run ? runs.indexOf(run) : 0;
    ownNumber = content.page;
    live = content.live || { can: [], robots: [] };
    can = new Set(live.can);
    ended = null;
    arrivals.length = 0;
    $("print").textContent = "";
    hide("printed", true);
    tellPrinted(content.printed);
    say("event", "");
    begin(content);
    document.body.classList.remove("waiting");
    run = runs[Math.min(chosen, runs.length - 1)];
    setNewest(true);
    makeControls();
    fitted = true;
    spanLength ??= 20;
    spanBegin = 0;
    chooseRobot(runs.indexOf(run));
    setControls(true);
    if (can.has("type")) hide("printed", false);
  },
  chunk(message) {
    message.runs.forEach((rows, k) => {
      runs[k].placed = null;
      runs[k].append(rows);
    });
    message.moving.forEach((rows, k) => moving[k].append(rows));
    growBounds();
    makeShown();
    tellPrinted(message.printed);
    if (!message.state) return; // of the past
    arrivals.push([performance.now() / 1000, run.duration]);
    while (arrivals.length > 2 && arrivals.at(-1)[0] - arrivals[0][0] > 1) arrivals.shift();
    receive.state(message);
  },
  state(message) {
    state = message.state;
    if (message.type === "state" && state.paused) {
      // what has been put elsewhere meanwhile is there now
      state.robots.forEach((robot, k) => {
        runs[k].placed = robot.pose ?? null;
      });
      requestDraw();
    }
    tellState();
  },
  end(message) {
    ended = message.ended;
    message.tables.forEach((table, k) => {
      if (table) runs[k].table = table;
    });
    makeFigures();
    letGo();
    setControls(message.again);
    tellState();
  },
  refused(message) {
    notice(message.sentence);
  },
};
function endedText() {
  return ended === "complete" ? "The run is over." : "The run has ended: " + ended + (/[.!]$/.test(ended) ? "" : ".");
}

const TRACKS_MS = 120; // the lanes need not be drawn as often as the arena

// ---- the newest moment, about a chunk behind what has come: so poses in between are known, and robots move evenly ----
let tracksAt = 0;
// Simulated seconds per second of the wall clock, and seconds per chunk.
function rateOfLate() {
  if (arrivals.length < 2) return [0, 0];
  const [first, last] = [arrivals[0], arrivals.at(-1)];
  return [(last[1] - first[1]) / Math.max(1e-3, last[0] - first[0]), (last[1] - first[1]) / (arrivals.length - 1)];
}
function tellNewest(stamp, passed) {
  const before = now;
  if (newest) now = nextMoment(passed);
  if (stamp - tracksAt > TRACKS_MS && (now !== before || !newest)) {
    tracksAt = stamp;
    tracksDirty ||= run.duration !== drawnDuration;
    tellTime();
  }
}
let drawnDuration = -1;
function nextMoment(passed) {
  const [rate, chunk] = rateOfLate(),
    head = run.duration;
  if (ended !== null || !arrivals.length || (state && state.paused))
    return Math.min(head, now + Math.max(0.02, (head - now) * 8 * passed)); // up to the very last
  if (state && state.speed === null && live.can.includes("speed")) return head; // a run that hurries is not slowed by drawing
  const since = performance.now() / 1000 - arrivals.at(-1)[0],
    goal = head + rate * Math.min(since, 0.2) - 1.6 * chunk;
  if (Math.abs(goal - now) > 6 * chunk + 0.3 * rate) return Math.max(0, Math.min(head, goal)); // far off: at once
  return Math.min(head, Math.max(now, now + passed * rate + (goal - now) * Math.min(1, 4 * passed)));
}
function tellTime() {
  drawnDuration = run.duration;
  $("slider").max = run.last;
  $("cursor").ariaValueMax = run.duration.toFixed(2);
}
function setNewest(on) {
  newest = on;
  $("newest").ariaPressed = String(on);
  if (on) {
    letGoOfDrag();
    now = run.duration;
    requestDraw();
  }
}
// In an open field a robot may leave what is seen.
function growBounds() {
  const [x0, y0, x1, y1] = bounds,
    edge = 0.1 * (x1 - x0);
  for (const one of runs) {
    const x = one.path[0].last,
      y = one.path[1].last;
    if (x > x0 && x < x1 && y > y0 && y < y1) continue;
    bounds = [Math.min(x0, x - edge), Math.min(y0, y - edge), Math.max(x1, x + edge), Math.max(y1, y + edge)];
    if (fitted) {
      fitView();
      viewChanged();
    }
  }
}

// ---- controls: only what can be done ----
function makeControls() {
  document.querySelectorAll("[data-can]").forEach(it => {
    it.hidden = !can.has(it.dataset.can);
  });
  hide("newest", false);
  hide("play", true);
  hide("speedLabel", !can.has("speed"));
}
function listenToControls() {
  $("stop").onclick = $("halt").onclick = stopRobot;
  $("pause").onclick = () => send({ type: state && state.paused ? "resume" : "pause" });
  $("step").onclick = () => {
    setNewest(true);
    send({ type: "step" });
  };
  $("restart").onclick = askRestart;
  $("anotherSeed").onclick = () => ($("seed").value = Math.floor(Math.random() * 1e6));
  $("cancel").onclick = () => $("restartDialog").close();
  $("restartDialog").querySelector("form").onsubmit = restart;
  $("newest").onclick = () => setNewest(true);
  $("speed").append(element("option", { value: "", textContent: "fastest" }));
  $("speed").onchange = () => send({ type: "speed", speed: $("speed").value === "" ? null : Number($("speed").value) });
  $("move").onclick = pickUp;
  document.addEventListener("visibilitychange", letGo);
}
function tellSpeed() {
  if (!can.has("speed") || document.activeElement === $("speed")) return;
  const value = state.speed === null ? "" : String(state.speed);
  if (![...$("speed").options].some(option => option.value === value))
    $("speed").append(element("option", { value, textContent: value }));
  $("speed").value = value;
}
// Off: nothing can be asked for, except another run where there may be one.
function setControls(on) {
  const again = ended !== null && on;
  document.querySelectorAll(".live, #speed, #drive button, #drive input, #parameters input, #inputs button, #inputs input").forEach(it => {
    it.disabled = it.id === "newest" ? false : it.id === "restart" ? !(on || again) : !on || ended !== null;
  });
}

// ---- another run ----
function askRestart() {
  const imperfections = live.imperfections || [];
  $("restartDialog")
    .querySelector(".choices")
    .replaceChildren(
      ...imperfections.map(({ name, text, off }) =>
        element(
          "label",
          { className: "choice" },
          element("input", { type: "checkbox", name, checked: !off }),
          element("span", {}, element("b", { textContent: name }), " " + (text || "")),
        ),
      ),
    );
  hide("choices", !imperfections.length);
  $("seed").value = live.seed ?? 0;
  $("restartDialog").showModal();
  $("seed").select();
}
function restart() {
  const off = [...$("restartDialog").querySelectorAll("input[type=checkbox]:not(:checked)")].map(box => box.name);
  send({ type: "restart", seed: Math.max(0, Math.round(Number($("seed").value) || 0)), without: off });
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
    const times = rateOfLate()[0],
      rate = state.paused ? "paused" : "live, " + times.toFixed(times < 9.95 ? 1 : 0) + " × real time";
    tellConnection(
      [rate, state.touched ? "touched: " + state.touched : ""].filter(Boolean).join("  ·  "),
      state.paused ? "paused" : "live",
    );
  }
  if (!state) return;
  say("pause", state.paused ? "Resume" : "Pause");
  tellSpeed();
  tellDrive();
  tellParameters();
  tellInputs();
  tellLink();
  tellPins();
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
$("typing").addEventListener("submit", e => {
  e.preventDefault();
  act({ kind: "typed", text: $("typed").value + "\n" });
  $("typed").value = "";
});
function robotState() {
  return (state && state.robots && state.robots[runs.indexOf(run)]) || {};
}
let linkTold = "";
function tellLink() {
  const known = Object.entries(robotState().link ?? {});
  if (linkTold === String(known)) return;
  linkTold = String(known);
  hide("linkCard", !known.length);
  $("link").replaceChildren(...known.map(([name, value]) => row(name, value)[0]));
}

// ---- pins: what the program does to each, or what it reads there ----
let pinCells = [];
function makePins() {
  const rows = (live?.robots[runs.indexOf(run)]?.pins ?? []).map(name => row(name));
  pinCells = rows.map(([, cell]) => cell);
  $("pinRows").replaceChildren(...rows.map(([it]) => it));
  hide("pins", true);
}
function tellPins() {
  const pins = robotState().pins ?? [];
  if (!pins.length) return;
  hide("pins", false);
  pins.forEach((pin, k) => {
    const text = pinNow(pin);
    if (pinCells[k] && pinCells[k].textContent !== text) pinCells[k].textContent = text;
  });
}
function pinNow([does, level, share, rate, volts]) {
  const word = level ? "high" : "low";
  if (share !== null) return "out " + (100 * share).toFixed(1) + " %, " + short(rate) + " Hz";
  if (does < 2) return "out " + word;
  if (volts !== null) return "in " + volts.toFixed(2) + " V";
  return "in " + word + (does === 3 ? ", pulled up" : "");
}

// ---- a brain's parameters ----
let sliders = [];
function makeParameters() {
  const list = (live && live.robots[runs.indexOf(run)]?.parameters) || [];
  hide("parameters", !can.has("parameters") || !list.length);
  const robot = runs.indexOf(run);
  sliders = list.map(one => makeSlider(one, value => act({ kind: "parameter", name: one.name, value }, robot)));
  const isUtility = ({ parameter }) => parameter.name.includes(".utility."),
    own = sliders.filter(one => !isUtility(one));
  $("ownParameters").replaceChildren(...own.map(({ whole }) => whole));
  $("utilityParameters").replaceChildren(...sliders.filter(isUtility).map(({ whole }) => whole));
}
function makeSlider(parameter, send) {
  const output = element("span", { className: "value" }),
    input = element("input", { type: "range", min: parameter.least, max: parameter.most, step: "any", disabled: ended !== null });
  const one = { parameter, input, output, send, changed: -Infinity, due: null };
  input.value = parameter.value;
  input.ariaLabel = parameter.name;
  input.oninput = () => {
    one.changed = performance.now();
    tellSlider(one);
    sendSoon(one);
  };
  one.whole = element(
    "label",
    { className: "parameter" },
    element("span", { textContent: parameter.name }),
    output,
    input,
  );
  tellSlider(one);
  return one;
}
function tellSlider({ input, output }) {
  output.textContent = short(Number(input.value));
}
// Ten times a second at most, and the last value surely.
function sendSoon(one) {
  one.due ??= setTimeout(() => {
    one.due = null;
    one.send(Number(one.input.value));
  }, 100);
}
function tellParameters() {
  const values = robotState().parameters || {};
  for (const one of sliders) followSlider(one, values[one.parameter.name]);
}
function followSlider(one, value) {
  if (value === undefined || performance.now() - one.changed < 1000 || Number(one.input.value) === value) return;
  one.input.value = value;
  tellSlider(one);
}

// ---- buttons, switches and knobs at its board: each shows how it stands in the newest row ----
let inputs = [];
function makeInputs() {
  const list = (live && live.robots[runs.indexOf(run)]?.inputs) || [];
  hide("inputs", !list.length);
  inputs = list.map(makeInput);
  $("inputRows").replaceChildren(...inputs.map(({ whole }) => whole));
}
function makeInput({ name, kind }) {
  const title = name.replaceAll("_", " "),
    robot = runs.indexOf(run);
  const set = value => act({ kind: "set", part: name, value }, robot);
  if (kind === "button") {
    const whole = element("button", { textContent: title, disabled: ended !== null, title: "Pressed while it is held" });
    let held = false;
    onHold(whole, [" ", "Enter"], on => {
      if (on !== held) set((held = on) ? 1 : 0);
    });
    return { whole, tell: i => (whole.ariaPressed = String(run.isOn(name, i))) };
  }
  if (kind === "slider") {
    const one = makeSlider({ name: title, least: 0, most: 1, value: 0 }, set);
    return { whole: one.whole, tell: i => followSlider(one, run.reading(name).values.values[i] / 100) };
  }
  const input = element("input", { type: "checkbox", disabled: ended !== null, ariaLabel: title });
  let changed = -Infinity;
  input.oninput = () => {
    changed = performance.now();
    set(Number(input.checked));
  };
  const whole = element("label", { className: "choice" }, element("span", { textContent: title }), input);
  return { whole, tell: i => performance.now() - changed < 1000 || (input.checked = run.isOn(name, i)) };
}
function tellInputs() {
  if (run.last >= 0) for (const one of inputs) one.tell(run.last);
}
