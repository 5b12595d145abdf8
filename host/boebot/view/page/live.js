// The live view: gets a run that goes on from the server that the page came from, shows its newest moment, or an earlier
// one, and asks for what the run's `can` allows. What it does not allow is not on the page.

const FORMAT = 9; // of the data, as in page_data.py
const RETRY_S = [1, 1, 2, 4, 8]; // from one attempt to connect to the next one
let socket = null;
let attempts = 0; // to connect again
let live = null; // what can be done: see LiveView._live of boebot.live.live_view
let can = new Set();
let state = null; // how the run is now
let ended = null; // why it has ended; null: it goes on
let newest = true; // the newest moment is shown; or one has gone back
const arrivals = []; // [wall clock, newest time], both in s, of late

// ---- the connection ----
function connect() {
  const address = new URL("stream" + location.search, location.href);
  address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
  document.body.classList.toggle("waiting", !run); // there is nothing to show yet
  tellConnection("connecting …");
  socket = new WebSocket(address);
  socket.onopen = () => {
    attempts = 0;
    send({ type: "hello", format: FORMAT });
    send({ type: "visible", visible: !document.hidden });
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
  if (attempts >= RETRY_S.length) {
    tellConnection("Connection lost: boebot does not answer. Load the page again to try once more.", "lost");
    return;
  }
  tellConnection("Connection lost; trying again …", "lost");
  setTimeout(connect, 1000 * RETRY_S[attempts++]);
}
function send(message) {
  if (socket && socket.readyState === 1) socket.send(JSON.stringify(message));
}
document.addEventListener("visibilitychange", () => {
  letGo();
  send({ type: "visible", visible: !document.hidden });
});

const receive = {
  run(content) {
    const chosen = run ? runs.indexOf(run) : 0;
    live = content.live || { can: [], robots: [] };
    can = new Set(live.can);
    ended = null;
    newest = true;
    arrivals.length = 0;
    $("print").textContent = "";
    hide("printed", true);
    say("event", "");
    begin(content);
    document.body.classList.remove("waiting");
    run = runs[Math.min(chosen, runs.length - 1)];
    now = run.duration;
    makeControls();
    fitted = true;
    spanLength ??= 20;
    spanBegin = 0;
    chooseRobot(runs.indexOf(run));
    setControls(true);
    if (!ticking) {
      ticking = true;
      requestAnimationFrame(tick);
    }
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
let ticking = false;
let tickedAt = 0;
let tracksAt = 0;
// Simulated seconds per second of the wall clock, and seconds per chunk.
function rateOfLate() {
  if (arrivals.length < 2) return [0, 0];
  const [first, last] = [arrivals[0], arrivals.at(-1)];
  return [(last[1] - first[1]) / Math.max(1e-3, last[0] - first[0]), (last[1] - first[1]) / (arrivals.length - 1)];
}
function tick(stamp) {
  requestAnimationFrame(tick);
  const passed = Math.min(0.2, Math.max(0, (stamp - tickedAt) / 1000)),
    before = now;
  tickedAt = stamp;
  if (!run || !run.time.length) return;
  if (newest) now = nextMoment(passed);
  if (stamp - tracksAt > TRACKS_MS && (now !== before || !newest)) {
    tracksAt = stamp;
    tracksDirty ||= run.duration !== drawnDuration;
    tellTime();
  }
  if (now !== before || drawAsked || tracksDirty) draw(true);
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
hooks.sought = () => setNewest(false);
function setNewest(on) {
  newest = on;
  $("newest").ariaPressed = String(on);
  if (on) {
    letGoOfDrag();
    now = run.duration;
    trailChanged();
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
