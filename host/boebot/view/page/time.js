// The moment that is shown: playing, scrubbing, going from event to event, by mouse and by keys; and drawing it.

let playing = false;
let floorDirty = true;
let drawAsked = false;

// ---- drawing: each part only if it has changed ----
function requestDraw() {
  drawAsked = true;
}
function viewChanged() {
  floorDirty = true;
  requestDraw();
}
const TELL_MS = 60; // numbers that change faster cannot be read
let toldAt = 0;
// In motion: as one of many frames.
function draw(inMotion = false) {
  drawAsked = false;
  if (!run || !run.time.length) return;
  if (following) {
    const [x, y] = placeOf(run);
    centre(x, y);
    floorDirty = true;
  }
  if (floorDirty) {
    drawFloor();
    floorDirty = false;
    $("stage").classList.toggle("zoomed", !fitted);
  }
  drawStage();
  keepCursorInside();
  if (tracksDirty) drawTracks();
  drawCursor();
  if (inMotion && performance.now() - toldAt < TELL_MS) {
    drawAsked = true; // the last of the frames is told, too
    return;
  }
  toldAt = performance.now();
  tellMoment();
  $("slider").value = tickOf(run);
  $("cursor").ariaValueNow = now.toFixed(2);
  $("cursor").ariaValueText = $("slider").ariaValueText = now.toFixed(2) + " seconds";
}

// ---- playing and scrubbing ----
function setPlaying(on) {
  if (on && now >= run.duration) now = 0;
  playing = on;
  $("play").textContent = on ? "Pause" : "Play";
}
// Each frame: a replay that plays goes on, a live page to its newest moment.
let tickedAt = 0;
function tick(stamp) {
  requestAnimationFrame(tick);
  const passed = Math.min(0.2, Math.max(0, (stamp - tickedAt) / 1000)),
    before = now;
  tickedAt = stamp;
  if (!run || !run.time.length) return;
  if (playing) now = Math.min(run.duration, now + passed * Number($("speed").value));
  if (playing && now >= run.duration) setPlaying(false);
  if (pageIsLive) tellNewest(stamp, passed);
  if (now !== before || drawAsked || tracksDirty) draw(playing || pageIsLive);
}
function seek(t) {
  if (pageIsLive) setNewest(false);
  now = Math.max(0, Math.min(run.duration, t));
  draw();
}
function goToEvent(forward) {
  const found = forward
    ? run.events.find(event => event.time > now + 5e-3)
    : run.events.findLast(event => event.time < now - 5e-3);
  if (found) seek(found.time);
  say("event", found ? eventText(found) : forward ? "no event after this" : "no event before this");
}
// The same moment, seen from another robot.
function chooseRobot(index) {
  const moment = now + run.begin;
  run = runs[index];
  now = Math.max(0, Math.min(run.duration, moment - run.begin));
  $("slider").max = run.last;
  $("cursor").ariaValueMax = run.duration;
  makePanels();
  makeParameters();
  makeInputs();
  makePins();
  if (state) tellState();
  resize();
}

// ---- keys ----
const STEP = 0.05;
const LEAP = 5; // s
// True: it was one of them.
function replayKey(e) {
  const step = e.shiftKey ? LEAP : STEP;
  if (e.key === " ") {
    if (pageIsLive || e.target.tagName === "BUTTON") return false; // a button takes it for itself
    setPlaying(!playing);
  } else if (e.key === "ArrowLeft") seek(now - step);
  else if (e.key === "ArrowRight") seek(now + step);
  else if (e.key === "Home") seek(0);
  else if (e.key === "End") pageIsLive ? setNewest(true) : seek(run.duration);
  else if (e.key === "n" || e.key === "N") goToEvent(true);
  else if (e.key === "p" || e.key === "P") goToEvent(false);
  else return false;
  return true;
}
const SCROLL_KEYS = ["ArrowUp", "ArrowDown", "PageUp", "PageDown", "Home", "End"];
function onKey(e) {
  if (!run || e.ctrlKey || e.metaKey || e.altKey) return;
  const { tagName, type, id } = e.target;
  if (["number", "text", "checkbox"].includes(type) || document.querySelector("dialog[open]")) return;
  if (tagName === "SELECT" || tagName === "PRE") return;
  if (type === "range" && id !== "slider" && e.key !== " ") return;
  if (id === "panels" && SCROLL_KEYS.includes(e.key)) return;
  if (e.target === $("cursor") && (e.key === "+" || e.key === "-")) {
    e.preventDefault();
    zoomTime(e.key === "+" ? 0.5 : 2);
    return;
  }
  if (dragKey(e) || driveKey(e) || arenaKey(e) || replayKey(e)) e.preventDefault();
}
function listenToTime() {
  $("play").onclick = () => setPlaying(!playing);
  $("slider").oninput = () => seek(run.time.values[$("slider").value]);
  $("before").onclick = () => goToEvent(false);
  $("after").onclick = () => goToEvent(true);
  $("robot").onchange = e => chooseRobot(Number(e.target.value) - 1);
  addEventListener("keydown", onKey);
}

// ---- the beginning: with the run that is in the page, or by asking the server for the one that goes on ----
function start() {
  readColours();
  listenToArena();
  listenToTracks();
  listenToPointer();
  listenToTime();
  const sizes = new ResizeObserver(() => run && resize()); // of the window, or a lane more
  for (const id of ["stage", "cursor"]) sizes.observe($(id));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    readColours();
    if (run) {
      namesShown = -1;
      makePanels();
      viewChanged();
      tracksChanged();
    }
  });
  requestAnimationFrame(tick);
  if (pageIsLive) {
    listenToControls();
    listenToHand();
    connect();
  } else show(page);
}
// #t=12.3 in the address opens the page at that moment, #robot=2&t=12.3 with another robot's signals.
function show(content) {
  begin(content);
  const chosen = Number((/[#&]robot=(\d+)/.exec(location.hash) || [0, 1])[1]),
    at = /[#&]t=([\d.]+)/.exec(location.hash);
  run = runs[Math.min(runs.length, Math.max(1, chosen)) - 1];
  now = at ? Math.min(run.duration, Number(at[1])) : 0;
  chooseRobot(runs.indexOf(run));
}
start();
