// The arena from above. It paints display lists (boebot.devices.drawing), whatever they stand for, and what a run adds to
// them. Canvas "floor": what stands there, drawn when the view changes; "stage": all that is different at another moment.

const FONT = "system-ui, sans-serif";
const font = (c, size) => {
  c.font = size * ratio + "px " + FONT;
};

// ---- the painter ----
// From here on c draws in the frame of a pose: metres, x ahead, y left.
function into(c, [x, y, heading]) {
  c.translate(X(x), Y(y));
  c.scale(scale, -scale);
  c.rotate(heading);
}
const ofPoints = width => ((width * 4) / 3) * (ratio / scale); // a width in points, where c draws metres
const colourOf = (name, own) => (name === "robot" ? own : (colours[name] ?? readable(name)));
// One item, in the frame that c draws in. `own`: the colour of its robot; `one`, `i`: the robot and the tick whose signs
// and measurements it shows; without them it is as without any.
function paint(c, item, own, one, i) {
  const reach = item.reach_by ? one?.reading(item.reach_by)?.values.values[i] : 1;
  if (!(reach > 0) || (item.when && !one?.isOn(item.when, i))) return;
  const points = item.points,
    [u, v] = points[0];
  c.save();
  if (item.text) writeWords(c, item);
  if (item.turns && one?.robot.pivot) {
    const [x, y] = one.robot.pivot;
    c.translate(x, y);
    c.rotate(one.turret.values[i]);
    c.translate(-x, -y);
  }
  c.beginPath();
  for (const [x, y] of points) c.lineTo(u + reach * (x - u), v + reach * (y - v));
  if (item.closed) c.closePath();
  if (item.fill) {
    c.fillStyle = colourOf(item.fill, own);
    c.globalAlpha = item.alpha ?? 1;
    c.fill();
    c.globalAlpha = 1;
  }
  if (item.ink) {
    c.strokeStyle = colourOf(item.ink, own);
    c.lineWidth = item.wide_m || ofPoints(item.width ?? 1);
    c.setLineDash((item.dashes ?? []).map(length => length * c.lineWidth));
    c.stroke();
  }
  if (item.hatch) hatch(c);
  c.restore();
}
function paintAt(c, items, pose, own, one, i) {
  c.save();
  c.lineJoin = c.lineCap = "round";
  into(c, pose);
  for (const item of items) paint(c, item, own, one, i);
  c.restore();
}
// Fills the path with lines.
function hatch(c) {
  const { width, height } = $("floor");
  c.clip();
  c.setTransform(1, 0, 0, 1, 0, 0);
  c.setLineDash([]);
  c.lineWidth = 0.8 * ratio;
  c.beginPath();
  for (let d = -height; d < width; d += 7 * ratio) {
    c.moveTo(d, height);
    c.lineTo(d + height, 0);
  }
  c.stroke();
}
// Upright at its place in the arena; it can be read on lines, too.
function writeWords(c, { points, text, side }) {
  const [[x, y]] = points,
    lines = text.split("\n");
  c.setTransform(1, 0, 0, 1, 0, 0);
  font(c, 11);
  c.textAlign = "center";
  c.textBaseline = "middle";
  c.strokeStyle = colours.floor;
  c.lineJoin = "round";
  c.lineWidth = 3 * ratio;
  c.fillStyle = colours.ink;
  lines.forEach((words, k) => {
    const below = Y(y) + (13 * (k - (lines.length - 1) / 2) - 9 * (side ?? 0)) * ratio;
    c.strokeText(words, X(x), below);
    c.fillText(words, X(x), below);
  });
}

// ---- grid and numbers ----
const gridStep = () => Math.max(0.1, stepOf(Math.max($("stage").width / 16, 44 * ratio) / scale));
function drawGrid(c) {
  const { width, height } = $("floor"),
    step = gridStep();
  c.strokeStyle = colours.grid;
  c.lineWidth = ratio;
  c.beginPath();
  for (let k = Math.ceil(backX(0) / step); k * step <= backX(width); k++) {
    c.moveTo(X(k * step), 0);
    c.lineTo(X(k * step), height);
  }
  for (let k = Math.ceil(backY(height) / step); k * step <= backY(0); k++) {
    c.moveTo(0, Y(k * step));
    c.lineTo(width, Y(k * step));
  }
  c.stroke();
}
// Over what stands there.
function drawNumbers(c) {
  const { width, height } = $("floor"),
    step = gridStep(),
    digits = step < 1 ? 1 : 0;
  const number = v => minus((Math.abs(v) < step / 2 ? 0 : v).toFixed(digits));
  const write = (text, x, y) => {
    c.strokeText(text, x, y);
    c.fillText(text, x, y);
  }; // with a rim, over walls
  c.fillStyle = colours.faint;
  c.strokeStyle = colours.paper;
  c.lineWidth = 3 * ratio;
  c.lineJoin = "round";
  font(c, 11);
  c.textAlign = "center";
  c.textBaseline = "bottom";
  for (let k = Math.ceil(backX(0) / step) + 1; k * step < backX(width) - step / 2; k++)
    write(number(k * step), X(k * step), height - 3 * ratio);
  c.textAlign = "left";
  c.textBaseline = "middle";
  for (let k = Math.ceil(backY(height) / step) + 1; k * step <= backY(0) - step / 2; k++)
    write(number(k * step), 4 * ratio, Y(k * step));
  c.textAlign = "right";
  c.textBaseline = "bottom";
  write("m", width - 5 * ratio, height - 3 * ratio);
  c.textAlign = "left";
}

// ---- what stands, what moves ----
const ORIGIN = [0, 0, 0];
const GRID_LAYER = 0.5; // the grid lies above the floor and below all else
function drawFloor() {
  const c = $("floor").getContext("2d"),
    isBelow = item => (item.layer ?? 0) < GRID_LAYER;
  c.setTransform(1, 0, 0, 1, 0, 0);
  c.clearRect(0, 0, $("floor").width, $("floor").height);
  paintAt(c, plan.items.filter(isBelow), ORIGIN);
  drawGrid(c);
  paintAt(
    c,
    plan.items.filter(item => !isBelow(item)),
    ORIGIN,
  );
  c.setLineDash([5 * ratio, 3 * ratio]);
  c.strokeStyle = colours.moving;
  c.lineWidth = 1.2 * ratio;
  if (!pageIsLive) for (const one of moving) trace(c, one.time.values, one.pose, one.time.length - 1);
  c.setLineDash([]);
  drawNumbers(c);
}
function drawMoving(c) {
  for (const one of moving) if (one.time.length) paintAt(c, [one.item], one.at(now + run.begin));
}

// ---- what the brain sketched: of each layer the sketch that holds now, in its own frame ----
// A canvas with a pixel for each cell; unknown: none.
function gridImage(grid, colour, [free, occupied]) {
  const image = element("canvas", { width: grid.columns, height: grid.rows }),
    c = image.getContext("2d");
  const data = c.createImageData(grid.columns, grid.rows),
    rgb = channels(colour);
  bytes(grid.cells).forEach((cell, k) =>
    data.data.set([...rgb, cell === 255 ? 0 : 255 * (free + ((occupied - free) * cell) / 254)], 4 * k),
  );
  c.putImageData(data, 0, 0);
  return image;
}
// Grids lie below the robots, lines and points above them.
function drawSketches(c, above, place) {
  for (const layer of run.layers) {
    const sketch = layer.sketches[shownAt(layer.time.values, now)];
    if (!sketch) continue;
    c.save();
    into(c, sketch.origin || place);
    if (above) drawSketched(c, sketch, readable(layer.colour));
    else if (sketch.grid) drawSketchedGrid(c, sketch, readable(layer.colour));
    c.restore();
  }
}
function drawSketchedGrid(c, sketch, colour) {
  const grid = sketch.grid;
  if (sketch.colour !== colour) {
    sketch.image = gridImage(grid, colour, run.cell);
    sketch.colour = colour;
  }
  c.imageSmoothingEnabled = false;
  c.drawImage(sketch.image, grid.x, grid.y, grid.columns * grid.cell, grid.rows * grid.cell);
}
function drawSketched(c, sketch, colour) {
  sketch.lined ??= sketch.lines.map(floats);
  sketch.dots ??= floats(sketch.points);
  c.strokeStyle = c.fillStyle = colour;
  c.lineWidth = (1.8 * ratio) / scale;
  for (const points of sketch.lined) {
    c.beginPath();
    for (let k = 0; k < points.length; k += 2)
      k ? c.lineTo(points[k], points[k + 1]) : c.moveTo(points[k], points[k + 1]);
    c.stroke();
  }
  const r = (2 * ratio) / scale,
    dots = sketch.dots;
  c.beginPath();
  for (let k = 0; k < dots.length; k += 2) {
    c.moveTo(dots[k] + r, dots[k + 1]);
    c.arc(dots[k], dots[k + 1], r, 0, 7);
  }
  c.fill();
}

// ---- what lasers measured: the area of the sweep that holds now, where it was measured ----
function drawSwept(c, one) {
  for (const swept of one.swept) {
    const k = shownAt(swept.time.values, now - later(one)),
      n = swept.angles.length,
      far = swept.distances.values;
    if (k < 0) continue;
    const [x, y, heading] = swept.pose.map(column => column.values[k]);
    c.beginPath();
    c.moveTo(X(x), Y(y));
    for (let j = 0; j < n; j++) {
      const distance = (far[k * n + j] / 65535) * swept.reach,
        angle = heading + swept.angles[j];
      c.lineTo(X(x + distance * Math.cos(angle)), Y(y + distance * Math.sin(angle)));
    }
    c.closePath();
    c.fillStyle = c.strokeStyle = readable(one.colour);
    c.lineWidth = ratio;
    c.globalAlpha = 0.1;
    c.fill();
    c.globalAlpha = 0.4;
    c.stroke();
    c.globalAlpha = 1;
  }
}

// ---- robots ----
const SIGHTS = 2; // below this layer is what sensors see
const placeOf = one =>
  one.placed && now >= run.duration ? one.placed : poseAt(one.time.values, one.path, now - later(one));
const tickOf = one => indexIn(one.time.values, now - later(one));
function drawRobot(c, one, place, sees) {
  const i = tickOf(one),
    own = readable(one.colour),
    isSight = item => item.layer < SIGHTS;
  if (sees) {
    c.save();
    c.beginPath(); // no sensor sees through walls
    for (const points of plan.outlines) {
      points.forEach(([x, y], k) => (k ? c.lineTo(X(x), Y(y)) : c.moveTo(X(x), Y(y))));
      c.closePath();
    }
    if (plan.outlines.length) c.clip();
    paintAt(c, one.robot.items.filter(isSight), place, own, one, i);
    c.restore();
  }
  paintAt(
    c,
    one.robot.items.filter(item => !isSight(item)),
    place,
    own,
    one,
    i,
  );
}
function drawStage() {
  const stage = $("stage"),
    c = stage.getContext("2d"),
    place = placeOf(run);
  c.clearRect(0, 0, stage.width, stage.height);
  c.lineJoin = c.lineCap = "round";
  drawTrails(c);
  drawSwept(c, run);
  drawSketches(c, false, place);
  drawMoving(c);
  for (const other of others()) if (other.time.length) drawRobot(c, other, placeOf(other), false);
  if (run.estimate) paintAt(c, run.robot.ghost, poseAt(run.time.values, run.estimate, now));
  drawSketches(c, true, place);
  drawRobot(c, run, place, true);
  drawGrabbed(c);
}

// ---- paths ----
const POINTS_AT_MOST = 6000; // of all of them
function trace(c, times, columns, to) {
  const [xs, ys] = columns.map(column => column.values),
    step = Math.ceil(((to + 1) * runs.length) / POINTS_AT_MOST);
  c.beginPath();
  for (let i = 0, before = -1; before !== to; before = i, i = Math.min(to, i + step)) {
    if (before < 0 || jumps(times, columns, before, i)) c.moveTo(X(xs[i]), Y(ys[i]));
    else c.lineTo(X(xs[i]), Y(ys[i]));
  }
  c.stroke();
}
// So far, and faint the whole ones; where the body touched something, where a whisker did.
function drawTrails(c) {
  for (const one of runs) {
    if (!one.time.length) continue;
    c.strokeStyle = readable(one.colour);
    c.lineWidth = 2 * ratio;
    c.globalAlpha = 0.15;
    trace(c, one.time.values, one.path, one.last);
    c.globalAlpha = 0.85;
    trace(c, one.time.values, one.path, tickOf(one));
  }
  if (run.estimate) {
    c.strokeStyle = colours.estimate;
    c.lineWidth = 1.3 * ratio;
    c.setLineDash([5 * ratio, 3 * ratio]);
    trace(c, run.time.values, run.estimate, tickOf(run));
    c.setLineDash([]);
  }
  drawMarks(c);
  c.globalAlpha = 1;
}
function drawMarks(c) {
  font(c, 14);
  c.textAlign = "center";
  c.textBaseline = "middle";
  for (const { kind, time } of run.events) {
    if (kind !== "touch" && kind !== "contact") continue;
    const [mark, colour] = EVENTS[kind],
      [x, y] = poseAt(run.time.values, run.path, time);
    c.fillStyle = colours[colour];
    c.fillText(mark, X(x), Y(y));
  }
}
