// The robots from above, what their sensors see, and their paths.

// From here on c draws in the frame of a pose: metres, x ahead, y left.
function into(c, [x, y, heading]) {
  c.translate(X(x), Y(y));
  c.scale(scale, -scale);
  c.rotate(heading);
}

// ---- in the robot's frame ----
const PAIRS = { infrared_left: 4, infrared_right: 8 };
const WHISKERS = { whisker_left: 1, whisker_right: 2 }; // bits of the flags
const CONTACT_BIT = 16;
// A cone or a ray.
function drawSight(c, one, shape, bits, distance, angle) {
  const [x, y] = shape.position,
    pair = PAIRS[shape.device],
    axis = one.robot.shapes.find(other => other.form === "axis");
  c.save();
  if (shape.turns && axis) {
    const [u, v] = axis.position;
    c.translate(u, v);
    c.rotate(angle);
    c.translate(-u, -v);
  }
  const echo = shape.device === "ping" && distance > 0,
    far = Math.min(echo ? distance : 0.35, shape.reach);
  if (shape.form === "ray") {
    c.strokeStyle = colours.ink;
    c.lineWidth = (1.2 * ratio) / scale;
    c.setLineDash([(3 * ratio) / scale, (3 * ratio) / scale]);
    c.beginPath();
    c.moveTo(x, y);
    c.lineTo(x + far * Math.cos(shape.heading), y + far * Math.sin(shape.heading));
    c.stroke();
  } else {
    const first = shape.heading - shape.opening / 2,
      end = shape.heading + shape.opening / 2;
    c.globalAlpha = bits & pair ? 0.5 : echo ? 0.14 : 0.6 * shape.shade;
    c.fillStyle = pair ? colours.charger : echo ? colours.end : colours.faint;
    c.beginPath();
    c.moveTo(x, y);
    c.arc(x, y, far, first, end);
    c.closePath();
    c.fill();
    c.globalAlpha = 1;
    if (echo) {
      c.strokeStyle = colours.end;
      c.lineWidth = (2 * ratio) / scale;
      c.beginPath();
      c.arc(x, y, distance, first, end);
      c.stroke();
    }
  }
  c.restore();
}
// A small sensor and which way it looks.
function drawSpot(c, shape) {
  const [x, y] = shape.position;
  c.strokeStyle = c.fillStyle = colours.ink;
  c.lineWidth = (2 * ratio) / scale;
  c.beginPath();
  if (shape.heading === null) {
    c.arc(x, y, 0.004, 0, 7);
    c.fill();
    return;
  }
  c.moveTo(x, y);
  c.lineTo(x + 0.04 * Math.cos(shape.heading), y + 0.04 * Math.sin(shape.heading));
  c.stroke();
}
function bodyPath(c, robot) {
  c.beginPath();
  if (!robot.outline.length) {
    c.arc(0, 0, robot.radius, 0, 7);
    return;
  }
  robot.outline.forEach(([x, y], i) => (i ? c.lineTo(x, y) : c.moveTo(x, y)));
  c.closePath();
}
function drawBody(c, robot, bits, colour) {
  const edge = bits & CONTACT_BIT ? colours.contact : colour,
    front = robot.front;
  bodyPath(c, robot);
  c.fillStyle = colours.body;
  c.fill();
  c.lineWidth = (2.2 * ratio) / scale;
  c.strokeStyle = edge;
  c.stroke();
  c.beginPath();
  c.moveTo(0.9 * front, 0);
  c.lineTo(0.35 * front, 0.32 * front);
  c.lineTo(0.35 * front, -0.32 * front);
  c.fillStyle = edge;
  c.fill();
  c.fillStyle = colours.ink;
  for (const side of [-1, 1]) c.fillRect(-robot.wheel, (side * robot.track) / 2 - 0.006, 2 * robot.wheel, 0.012);
  for (const shape of robot.shapes)
    if (shape.form === "stroke") {
      const on = bits & WHISKERS[shape.device];
      c.lineCap = "round";
      c.lineWidth = ((on ? 4 : 1.8) * ratio) / scale;
      c.strokeStyle = on ? colours.touch : colours.ink;
      c.beginPath();
      c.moveTo(...shape.begin);
      c.lineTo(...shape.end);
      c.stroke();
    }
}

// ---- in the arena ----
const placeOf = one =>
  one.placed && now >= run.duration ? one.placed : poseAt(one.time.values, one.path, now - later(one));
const tickOf = one => indexIn(one.time.values, now - later(one));
function drawSights(c, one, place, i) {
  c.save();
  const walls = outlines();
  if (walls.length) {
    c.beginPath(); // no sensor sees through walls
    for (const outline of walls) line(c, outline.points, true);
    c.clip();
  }
  into(c, place);
  for (const shape of one.robot.shapes)
    if (shape.form === "cone" || shape.form === "ray")
      drawSight(c, one, shape, one.flags.values[i], one.ping.values[i], one.turret.values[i]);
  c.restore();
}
function drawRobot(c, one, place, i, spots) {
  c.save();
  into(c, place);
  drawBody(c, one.robot, one.flags.values[i], readable(one.colour));
  if (spots) for (const shape of one.robot.shapes) if (shape.form === "spot") drawSpot(c, shape);
  c.restore();
}
// Where odometry has it.
function drawGhost(c, one, place) {
  c.save();
  into(c, place);
  c.strokeStyle = colours.estimate;
  c.lineWidth = (1.6 * ratio) / scale;
  c.setLineDash([(5 * ratio) / scale, (3 * ratio) / scale]);
  bodyPath(c, one.robot);
  c.moveTo(0, 0);
  c.lineTo(one.robot.front, 0);
  c.stroke();
  c.restore();
}

// ---- the canvas "stage": all that is different at another moment ----
function drawStage() {
  const stage = $("stage"),
    c = stage.getContext("2d"),
    i = tickOf(run),
    place = placeOf(run);
  c.clearRect(0, 0, stage.width, stage.height);
  c.lineJoin = c.lineCap = "round";
  drawSwept(c, run);
  drawSketches(c, false, place);
  drawMoving(c);
  for (const other of others()) if (other.time.length) drawRobot(c, other, placeOf(other), tickOf(other), false);
  if (run.estimate) drawGhost(c, run, poseAt(run.time.values, run.estimate, now));
  drawSketches(c, true, place);
  drawSights(c, run, place, i);
  drawRobot(c, run, place, i, true);
  hooks.drawOver(c);
}

// ---- the canvas "trail": paths so far. While time goes on, only what is new is drawn ----
const POINTS_AT_MOST = 20000; // of a path that is drawn as a whole
function trace(c, times, columns, from, to) {
  const [xs, ys] = columns.map(column => column.values),
    step = Math.ceil((to - from + 1) / POINTS_AT_MOST);
  c.beginPath();
  for (let i = from, before = -1; before !== to; before = i, i = Math.min(to, i + step)) {
    if (before < 0 || jumps(times, columns, before, i)) c.moveTo(X(xs[i]), Y(ys[i]));
    else c.lineTo(X(xs[i]), Y(ys[i]));
  }
  c.stroke();
}
let drawn = new Map(); // of each robot up to which tick its path is drawn
let dashAt = 0; // how far the dashes of the estimate have come, in pixels
let marked = [0, 0]; // how many contacts and touches are drawn
function trailChanged() {
  drawn = new Map();
}
function drawTrail() {
  const trail = $("trail"),
    c = trail.getContext("2d");
  const back = runs.some(one => drawn.has(one) && tickOf(one) < drawn.get(one));
  if (back || !drawn.has(run)) {
    c.clearRect(0, 0, trail.width, trail.height);
    trailChanged();
    dashAt = 0;
    marked = [0, 0];
    if ($("whole").checked) drawWhole(c);
  }
  c.lineJoin = c.lineCap = "round";
  for (const one of runs) if (one.time.length) drawTrailOf(c, one);
  if ($("whole").checked) drawMarks(c);
}
// The whole paths, faint.
function drawWhole(c) {
  c.globalAlpha = 0.18;
  c.lineWidth = 2 * ratio;
  c.lineJoin = c.lineCap = "round";
  for (const one of runs) {
    c.strokeStyle = readable(one.colour);
    trace(c, one.time.values, one.path, 0, one.last);
  }
  c.globalAlpha = 1;
}
function drawTrailOf(c, one) {
  const from = drawn.get(one) ?? 0,
    to = tickOf(one);
  if (to > from || !drawn.has(one)) {
    c.strokeStyle = readable(one.colour);
    c.lineWidth = 2 * ratio;
    trace(c, one.time.values, one.path, from, to);
    if (one === run && one.estimate) traceEstimate(c, one, from, to);
  }
  drawn.set(one, to);
}
// Dashes go on where the last piece ended.
function traceEstimate(c, one, from, to) {
  c.strokeStyle = colours.estimate;
  c.lineWidth = 1.3 * ratio;
  c.setLineDash([5 * ratio, 3 * ratio]);
  c.lineCap = "butt";
  c.lineDashOffset = dashAt;
  trace(c, one.time.values, one.estimate, from, to);
  const [xs, ys] = one.estimate.map(column => column.values);
  for (let i = from + 1; i <= to; i++) dashAt += Math.hypot(xs[i] - xs[i - 1], ys[i] - ys[i - 1]) * scale;
  dashAt %= 8 * ratio;
  c.setLineDash([]);
  c.lineCap = "round";
  c.lineDashOffset = 0;
}
// Where the body touched something, where a whisker did.
function drawMarks(c) {
  c.strokeStyle = colours.touch;
  c.lineWidth = 1.4 * ratio;
  for (const [x, y] of run.touches.slice(marked[1])) {
    c.beginPath();
    c.arc(X(x), Y(y), 3.5 * ratio, 0, 7);
    c.stroke();
  }
  c.strokeStyle = colours.contact;
  c.lineWidth = 2 * ratio;
  for (const [x, y] of run.contacts.slice(marked[0])) {
    const r = 4 * ratio;
    c.beginPath();
    c.moveTo(X(x) - r, Y(y) - r);
    c.lineTo(X(x) + r, Y(y) + r);
    c.moveTo(X(x) + r, Y(y) - r);
    c.lineTo(X(x) - r, Y(y) + r);
    c.stroke();
  }
  marked = [run.contacts.length, run.touches.length];
}
