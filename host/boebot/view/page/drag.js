// Moving robots and shapes: by dragging them, or by keys after "move". Escape leaves them where they are.

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

function isAt(thing, x, y) {
  const place = placeOfThing(thing);
  if (thing.kind === "robot")
    return Math.hypot(place[0] - x, place[1] - y) <= Math.max(runs[thing.index].robot.radius, (14 * ratio) / scale); // a finger is wide
  return within(solidAt(moving[thing.index].solid, place), x, y);
}
const canDrag = () => can.has("drag") && newest && ended === null;
hooks.dragging = () => grabbed !== null && !grabbed.byKeys;
hooks.grab = event => {
  // true: something was grabbed
  const x = backX(event.offsetX * ratio),
    y = backY(event.offsetY * ratio);
  const thing = canDrag() && event.button === 0 && things().find(one => isAt(one, x, y));
  if (!thing) return false;
  const pose = placeOfThing(thing);
  grabbed = { ...thing, pose, offset: [pose[0] - x, pose[1] - y], byKeys: false, moved: false };
  return true;
};
hooks.turn = step => {
  grabbed.pose[2] += step;
  grabbed.moved = true;
  requestDraw();
};
function dragTo(event) {
  if (!hooks.dragging()) return;
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
  if (moved) send({ type: kind === "robot" ? "place" : "shape", [kind]: index, pose });
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
  if (!canDrag()) {
    if (!newest) setNewest(true);
    else return;
  }
  const all = things(),
    current = grabbed
      ? all.findIndex(one => one.kind === grabbed.kind && one.index === grabbed.index) + 1
      : runs.indexOf(run);
  const thing = all[current % all.length];
  grabbed = { ...thing, pose: placeOfThing(thing), byKeys: true, moved: false };
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
hooks.key = e => dragKey(e) || driveKey(e) || (e.key === "End" && (setNewest(true), true));
hooks.drawOver = c => {
  // what is moved, where it would be
  if (!grabbed) return;
  if (grabbed.kind === "shape") {
    c.globalAlpha = 0.6;
    drawSolid(c, solidAt(moving[grabbed.index].solid, grabbed.pose), colours.accent);
    c.globalAlpha = 1;
    return;
  }
  const robot = runs[grabbed.index].robot;
  c.save();
  into(c, grabbed.pose);
  c.fillStyle = c.strokeStyle = colours.accent;
  c.lineWidth = (2 * ratio) / scale;
  bodyPath(c, robot);
  c.globalAlpha = 0.25;
  c.fill();
  c.globalAlpha = 1;
  c.setLineDash([(4 * ratio) / scale, (3 * ratio) / scale]);
  bodyPath(c, robot);
  c.moveTo(0, 0);
  c.lineTo(robot.front, 0);
  c.stroke();
  c.restore();
};
// A finger that holds something does not scroll the page.
const keepFinger = event => hooks.dragging() && event.preventDefault();
$("stage").addEventListener("touchstart", keepFinger, { passive: false });
$("stage").addEventListener("pointermove", dragTo);
$("stage").addEventListener("pointerup", () => {
  if (hooks.dragging()) put();
});
$("stage").addEventListener("pointercancel", () => {
  if (hooks.dragging()) letGoOfDrag();
});
