// The arena from above: what stands there (the canvas "floor", drawn when the view changes), what moves, what the brain
// sketched and what lasers measured (the canvas "stage", drawn anew for each moment).

const FONT = "system-ui, sans-serif";
const font = (c, size) => {
  c.font = size * ratio + "px " + FONT;
};
// Adds it to the path; in metres.
function line(c, points, closed = false) {
  points.forEach(([x, y], i) => (i ? c.lineTo(X(x), Y(y)) : c.moveTo(X(x), Y(y))));
  if (closed) c.closePath();
}
function polygon(c, points) {
  c.beginPath();
  line(c, points, true);
}
const outlines = () => plan.solids.filter(solid => solid.kind === "outline");

// Fills the path with lines: low things.
function hatch(c) {
  const { width, height } = c.canvas ?? $("floor");
  c.save();
  c.clip();
  c.strokeStyle = colours.edge;
  c.lineWidth = 0.8 * ratio;
  c.beginPath();
  for (let d = -height; d < width; d += 7 * ratio) {
    c.moveTo(d, height);
    c.lineTo(d + height, 0);
  }
  c.stroke();
  c.restore();
}
function drawSolid(c, solid, colour) {
  c.lineJoin = c.lineCap = "round";
  c.strokeStyle = colours.edge;
  c.lineWidth = (solid.kind === "wall" ? 2.4 : 1.8) * ratio;
  c.beginPath();
  if (solid.kind === "wall") {
    line(c, solid.points);
    if (solid.dull) c.strokeStyle = colours.dull;
    if (solid.low) c.setLineDash([6 * ratio, 4 * ratio]);
    c.stroke();
    c.setLineDash([]);
    return;
  }
  if (solid.kind === "disc") c.arc(X(solid.points[0][0]), Y(solid.points[0][1]), solid.radius * scale, 0, 7);
  else line(c, solid.points, true);
  c.fillStyle = colour || (solid.low ? colours.low : solid.dull ? colours.dull : colours.solid);
  c.fill();
  c.stroke();
  if (solid.low) hatch(c); // last: it leaves its own path behind
}

// ---- grid and numbers ----
const GRID_STEPS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500];
const gridStep = () =>
  GRID_STEPS.find(step => $("stage").width / scale / step <= 16 && step * scale >= 44 * ratio) || 1000;
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
function word(c, text, x, y) {
  font(c, 11);
  c.textAlign = "center";
  c.textBaseline = "middle";
  c.strokeStyle = colours.floor; // it can be read on lines, too
  c.lineJoin = "round";
  c.lineWidth = 3 * ratio;
  c.strokeText(text, X(x), Y(y));
  c.fillStyle = colours.ink;
  c.fillText(text, X(x), Y(y));
  c.textAlign = "left";
}
// A lamp.
function star(c, x, y) {
  c.beginPath();
  for (let k = 0; k < 10; k++) {
    const r = (k % 2 ? 3.6 : 9) * ratio,
      a = -Math.PI / 2 + (k * Math.PI) / 5;
    c.lineTo(X(x) + r * Math.cos(a), Y(y) + r * Math.sin(a));
  }
  c.closePath();
  c.fillStyle = colours.lamp;
  c.fill();
  c.strokeStyle = colours.edge;
  c.lineWidth = 1.2 * ratio;
  c.stroke();
}

// ---- what stands ----
function drawFloor() {
  const c = $("floor").getContext("2d");
  c.setTransform(1, 0, 0, 1, 0, 0);
  c.clearRect(0, 0, $("floor").width, $("floor").height);
  for (const outline of outlines()) {
    polygon(c, outline.points);
    c.fillStyle = colours.floor;
    c.fill();
  }
  drawGrid(c);
  plan.lines.forEach(one => drawPaint(c, one));
  plan.patches.forEach(patch => drawPatch(c, patch));
  if (plan.charger) drawCharger(c, ...plan.charger);
  for (const outline of outlines()) {
    polygon(c, outline.points);
    c.strokeStyle = colours.edge;
    c.lineJoin = "round";
    c.lineWidth = 3.5 * ratio;
    if (outline.low) c.setLineDash([8 * ratio, 4 * ratio]);
    c.stroke();
    c.setLineDash([]);
  }
  for (const solid of plan.solids)
    if (solid.kind !== "outline") {
      drawSolid(c, solid);
      if (solid.remarks) word(c, solid.remarks, solid.top[0], solid.top[1] + (8 * ratio) / scale);
    }
  for (const [x, y] of plan.lamps) star(c, x, y);
  c.setLineDash([5 * ratio, 3 * ratio]);
  c.strokeStyle = colours.moving;
  c.lineWidth = 1.2 * ratio;
  if (!pageIsLive) for (const one of moving) trace(c, one.time.values, one.pose, 0, one.time.length - 1);
  c.setLineDash([]);
  drawNumbers(c);
}
function drawPaint(c, paint) {
  c.beginPath();
  line(c, paint.points);
  c.lineCap = c.lineJoin = "round";
  c.lineWidth = paint.width * scale;
  c.strokeStyle = colours[paint.dark ? "paint-dark" : "paint-bright"];
  c.stroke();
}
function drawPatch(c, patch) {
  polygon(c, patch.points);
  c.fillStyle = patch.rough ? colours.rough : colours.smooth;
  c.fill();
  const [x, y] = [0, 1]
    .map(k => patch.points.map(point => point[k]))
    .map(values => (Math.min(...values) + Math.max(...values)) / 2);
  word(c, "grip " + patch.grip, x, y);
}
function drawCharger(c, x, y, radius) {
  c.beginPath();
  c.arc(X(x), Y(y), radius * scale, 0, 7);
  c.globalAlpha = 0.35;
  c.fillStyle = colours.charger;
  c.fill();
  c.globalAlpha = 1;
  c.strokeStyle = colours.charger;
  c.lineWidth = 1.5 * ratio;
  c.stroke();
  word(c, "charger", x, y - radius - (9 * ratio) / scale);
}

// ---- what moves ----
const solidAt = (solid, [x, y, turn]) => {
  const cos = Math.cos(turn),
    sin = Math.sin(turn);
  return { ...solid, points: solid.points.map(([a, b]) => [x + cos * a - sin * b, y + sin * a + cos * b]) };
};
function drawMoving(c) {
  for (const one of moving)
    if (one.time.length) drawSolid(c, solidAt(one.solid, one.at(now + run.begin)), colours.moving);
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
