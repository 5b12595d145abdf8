// What people do by hand to a run that goes on. Driving: keys, arrows on the screen; and the emergency stop.
// While something is held the server hears of it again and again; it stops the robot when it hears nothing for 0.3 s.

const AGAIN_MS = 80;
const TURN = 0.6; // how much of the speed a turn takes
const KEYS = {
  w: "ahead",
  a: "left",
  s: "back",
  d: "right",
  arrowup: "ahead",
  arrowleft: "left",
  arrowdown: "back",
  arrowright: "right",
};
const held = new Set(); // of "ahead", "left", "back", "right"
let handTimer = null;

// Motor signals for what is held.
function wanted() {
  const power = Number($("power").value) / 100,
    ahead = held.has("ahead") - held.has("back"),
    turn = held.has("left") - held.has("right"),
    left = ahead - TURN * turn,
    right = ahead + TURN * turn,
    most = Math.max(1, Math.abs(left), Math.abs(right));
  return [left, right].map(v => Math.round(((1000 * v) / most) * power) / 1000);
}
function sayHand() {
  const [left, right] = wanted();
  if (held.size && !newest) setNewest(true);
  act({ kind: "hand", left, right });
}
function hold(name, on) {
  if (held.has(name) === on || (on && (!can.has("hand") || ended !== null))) return;
  if (on) held.add(name);
  else held.delete(name);
  $("drive").querySelector(`[data-way=${name}]`)?.classList.toggle("held", on);
  sayHand();
  if (held.size) handTimer ??= setInterval(sayHand, AGAIN_MS);
  else {
    clearInterval(handTimer);
    handTimer = null;
  }
}
function letGo() {
  for (const name of [...held]) hold(name, false);
}
function stopRobot() {
  letGo();
  act({ kind: "stop" });
}
addEventListener("blur", letGo);

// ---- the panel ----
function listenToHand() {
  for (const it of document.querySelectorAll("[data-way]")) onHold(it, ["Enter"], on => hold(it.dataset.way, on));
  $("release").onclick = () => {
    letGo();
    act({ kind: "release" });
  };
  $("arm").onclick = () => act({ kind: "arm" });
}
function tellDrive() {
  if (!can.has("hand")) return;
  const { latched, driver } = robotState();
  say(
    "driver",
    latched
      ? "Stopped; its motors are off."
      : driver === ownNumber
        ? "You drive."
        : driver
          ? "Another page drives by hand."
          : "Its brain drives.",
  );
  $("driver").classList.toggle("alerted", !!latched);
  hide("arm", !latched);
  hide("release", !!latched); // one in the other's place
  $("release").disabled = driver !== ownNumber || ended !== null;
  $("arm").disabled = ended !== null;
}

// ---- keys: true, if it was one of these ----
function driveKey(e) {
  if (e.key === " ") {
    const does = can.has("hand") ? stopRobot : can.has("pause") ? () => $("pause").click() : null;
    if (does && !e.repeat) does(); // once, however long it is held
    return does !== null;
  }
  const way = KEYS[e.key.toLowerCase()],
    scrubs = e.target === $("cursor") || e.target === $("slider");
  if (!way || !can.has("hand") || (e.key.startsWith("Arrow") && (scrubs || e.shiftKey))) return false;
  hold(way, true);
  return true;
}
addEventListener("keyup", e => {
  const way = KEYS[e.key.toLowerCase()];
  if (way && held.has(way)) hold(way, false);
  if (e.key === " " && can.has("hand")) e.preventDefault(); // a button that has the focus is not pressed by the stop
});

// ---- moving robots and shapes: by dragging them, or by keys after "move"; Escape leaves them where they are ----
const MOVE_M = 0.05;
const NUDGE_M = 0.01;
const TURN_RAD = Math.PI / 12;
let grabbed = null; // {kind: "robot" or "shape", index, pose, offset, byKeys}
const things = () => [
  ...runs.map((_, index) => ({ kind: "robot", index })),
  ...moving.map((_, index) => ({ kind: "shape", index })),
];
const placeOfThing = ({ kind, index }) => (kind === "robot" ? placeOf(runs[index]) : moving[index].at(now + run.begin));
const nameOf = ({ kind, index }) =>
  kind === "shape" ? "shape " + (index + 1) : runs.length > 1 ? "robot " + (index + 1) : "the robot";

function within(points, x, y) {
  let inside = false;
  points.forEach(([ax, ay], i) => {
    const [bx, by] = points[(i + 1) % points.length];
    if (ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax)) inside = !inside;
  });
  return inside;
}
function isAt(thing, x, y) {
  const place = placeOfThing(thing);
  if (thing.kind === "robot")
    return Math.hypot(place[0] - x, place[1] - y) <= Math.max(runs[thing.index].robot.radius, (14 * ratio) / scale); // a finger is wide
  const [far, aside, cos, sin] = [x - place[0], y - place[1], Math.cos(place[2]), Math.sin(place[2])];
  return within(moving[thing.index].item.points, cos * far + sin * aside, cos * aside - sin * far);
}
const canDrag = () => can.has("drag") && newest && ended === null;
const isDragging = () => grabbed !== null && !grabbed.byKeys;
// True: something was grabbed.
function grab(event) {
  const x = backX(event.offsetX * ratio),
    y = backY(event.offsetY * ratio);
  const thing = canDrag() && event.button === 0 && things().find(one => isAt(one, x, y));
  if (!thing) return false;
  const pose = [...placeOfThing(thing)];
  grabbed = { ...thing, pose, offset: [pose[0] - x, pose[1] - y], byKeys: false, moved: false };
  return true;
}
function turnGrabbed(step) {
  grabbed.pose[2] += step;
  grabbed.moved = true;
  requestDraw();
}
function dragTo(event) {
  if (!isDragging()) return;
  grabbed.pose[0] = backX(event.offsetX * ratio) + grabbed.offset[0];
  grabbed.pose[1] = backY(event.offsetY * ratio) + grabbed.offset[1];
  grabbed.moved = true;
  requestDraw();
}
// Asks the run to have it there.
function put() {
  const { kind, index, pose, moved } = grabbed;
  grabbed = null;
  requestDraw();
  say("event", "");
  const [x, y, heading] = pose;
  if (moved && kind === "robot") act({ kind: "place", x, y, heading }, index);
  else if (moved) act({ kind: "shape", index, x, y, heading }, 0);
}
function letGoOfDrag() {
  if (grabbed) {
    grabbed = null;
    say("event", "");
    requestDraw();
  }
}
// The next thing after the one that is picked up, at first the chosen robot.
function pickUp() {
  if (!newest) setNewest(true);
  if (!canDrag()) return;
  const all = things(),
    current = grabbed
      ? all.findIndex(one => one.kind === grabbed.kind && one.index === grabbed.index) + 1
      : runs.indexOf(run);
  const thing = all[current % all.length];
  grabbed = { ...thing, pose: [...placeOfThing(thing)], byKeys: true, moved: false };
  say(
    "event",
    "Moving " +
      nameOf(thing) +
      ": arrow keys, Q and E turn it, Enter puts it there, Escape leaves it, M takes the next.",
  );
  requestDraw();
}
// True, if it was one of these.
function dragKey(e) {
  if ((e.key === "m" || e.key === "M") && can.has("drag")) {
    pickUp();
    return true;
  }
  if (!grabbed) return false;
  const step = e.shiftKey ? NUDGE_M : MOVE_M,
    way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[e.key];
  if (way) {
    grabbed.pose[0] += way[0] * step;
    grabbed.pose[1] += way[1] * step;
  } else if (e.key === "q" || e.key === "Q") grabbed.pose[2] += TURN_RAD;
  else if (e.key === "e" || e.key === "E") grabbed.pose[2] -= TURN_RAD;
  else if (e.key === "Enter") {
    put();
    return true;
  } else if (e.key === "Escape") {
    letGoOfDrag();
    return true;
  } else return false;
  grabbed.moved = true;
  requestDraw();
  return true;
}
// What is moved, where it would be.
function drawGrabbed(c) {
  if (!grabbed) return;
  const { kind, index, pose } = grabbed,
    items = kind === "shape" ? [{ ...moving[index].item, fill: "accent", alpha: 0.6 }] : runs[index].robot.ghost;
  paintAt(
    c,
    items.map(item => ({ ...item, ink: "accent" })),
    pose,
  );
}
// A finger that holds something does not scroll the page.
const keepFinger = event => isDragging() && event.preventDefault();
$("stage").addEventListener("touchstart", keepFinger, { passive: false });
$("stage").addEventListener("pointermove", dragTo);
$("stage").addEventListener("pointerup", () => {
  if (isDragging()) put();
});
$("stage").addEventListener("pointercancel", () => {
  if (isDragging()) letGoOfDrag();
});
