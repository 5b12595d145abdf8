// Values under the pointer, in the lanes and on the arena.

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
        ? box.lane.name
        : "",
  );
  requestDraw();
}
const NEAR = 9; // pixels
function hoverArena(event) {
  const x = backX(event.offsetX * ratio),
    y = backY(event.offsetY * ratio),
    lines = [];
  runs.forEach((one, i) => {
    if (one.time.length) lines.push(...aboutRobot(one, i, x, y));
  });
  if (!lines.length) lines.push(...aboutPath(x, y));
  for (const solid of plan.solids)
    if (solid.remarks && solid.kind !== "outline" && within(solid, x, y)) lines.push(solid.remarks);
  lines.push(minus(x.toFixed(2)) + ", " + minus(y.toFixed(2)) + " m");
  tip(event, lines.join("\n"));
}
function aboutRobot(one, i, x, y) {
  const place = placeOf(one);
  if (Math.hypot(place[0] - x, place[1] - y) > one.robot.radius) return [];
  return [(runs.length > 1 ? "robot " + (i + 1) + ": " : "") + one.brain, "at " + asPose(place)];
}
// When the robot was there.
function aboutPath(x, y) {
  const i = nearestTick(run, x, y);
  if (i < 0) return [];
  return ["here at " + run.time.values[i].toFixed(2) + " s"];
}
// Of the path so far, or of the whole one where that is shown; -1: none is near.
function nearestTick(one, x, y) {
  const [xs, ys] = one.path.map(column => column.values),
    end = $("whole").checked ? one.last : tickOf(one);
  let best = ((NEAR * ratio) / scale) ** 2,
    found = -1;
  for (let i = 0; i <= end; i++) {
    const far = (xs[i] - x) ** 2 + (ys[i] - y) ** 2;
    if (far < best) {
      best = far;
      found = i;
    }
  }
  return found;
}
function within(solid, x, y) {
  if (solid.kind === "disc") return Math.hypot(solid.points[0][0] - x, solid.points[0][1] - y) <= solid.radius;
  let inside = false;
  solid.points.forEach(([ax, ay], i) => {
    const [bx, by] = solid.points[(i + 1) % solid.points.length];
    if (ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax)) inside = !inside;
  });
  return inside;
}
function listenToPointer() {
  $("cursor").addEventListener("pointermove", hoverTracks);
  $("stage").addEventListener("pointermove", event => {
    if (hooks.dragging()) tip(event, ""); // it would say where the thing still is
    else if (fingers.size < 2) hoverArena(event);
  });
  for (const id of ["cursor", "stage"])
    $(id).addEventListener("pointerleave", event => {
      hoverTime = null;
      tip(event, "");
      requestDraw();
    });
}
