// Which part of the arena is seen: scale in pixels for a metre, where the arena's origin lies, zoom, pan, follow.

const CANVASES = ["floor", "stage", "tracks", "cursor"];
const NEAREST = 60;
const FARTHEST = 0.25; // zoom, as a multiple of the scale at which all is seen
let scale = 1;
let shiftX = 0;
let shiftY = 0;
let ratio = 1;
let fitted = true;
let following = false;
const X = x => shiftX + x * scale;
const Y = y => shiftY - y * scale;
const backX = px => (px - shiftX) / scale;
const backY = py => (shiftY - py) / scale;

const PAD = { left: 34, right: 8, top: 8, bottom: 20 }; // the numbers stand at the left and below
function fitScale() {
  const [x0, y0, x1, y1] = bounds,
    { width, height } = $("stage");
  return Math.max(
    1e-6,
    Math.min(
      (width - (PAD.left + PAD.right) * ratio) / (x1 - x0),
      (height - (PAD.top + PAD.bottom) * ratio) / (y1 - y0),
    ),
  );
}
function centre(x, y) {
  shiftX = $("stage").width / 2 - x * scale;
  shiftY = $("stage").height / 2 + y * scale;
}
function fitView() {
  const [x0, y0, x1, y1] = bounds;
  scale = fitScale();
  centre((x0 + x1) / 2, (y0 + y1) / 2);
  shiftX += ((PAD.left - PAD.right) / 2) * ratio;
  shiftY += ((PAD.top - PAD.bottom) / 2) * ratio;
  fitted = true;
  setFollowing(false);
}
// About a point of the canvas.
function zoom(factor, px = $("stage").width / 2, py = $("stage").height / 2) {
  const x = backX(px),
    y = backY(py),
    all = fitScale();
  scale = Math.min(NEAREST * all, Math.max(FARTHEST * all, scale * factor));
  shiftX = px - x * scale;
  shiftY = py + y * scale;
  fitted = false;
  viewChanged();
}
function pan(dx, dy) {
  shiftX += dx;
  shiftY += dy;
  fitted = false;
  setFollowing(false);
  viewChanged();
}
function setFollowing(on) {
  following = on;
  $("follow").ariaPressed = String(on);
  if (on) {
    fitted = false;
    if (scale < 1.5 * fitScale()) scale = 2.5 * fitScale();
    viewChanged();
  }
}
// The canvases get the pixels that they take on the screen; what is seen stays in the middle.
function resize() {
  const x = backX($("stage").width / 2),
    y = backY($("stage").height / 2);
  ratio = devicePixelRatio || 1;
  for (const id of CANVASES) {
    const canvas = $(id);
    canvas.width = Math.round(canvas.clientWidth * ratio);
    canvas.height = Math.round(canvas.clientHeight * ratio);
  }
  if (fitted) fitView();
  else centre(x, y);
  viewChanged();
  tracksChanged();
  draw(); // at once: the canvases are empty now
}

// ---- wheel, fingers, mouse and keys on the arena ----
const fingers = new Map(); // where each pointer that is down is
function fingersMoved(event) {
  const before = [...fingers.values()],
    old = fingers.get(event.pointerId),
    at = { x: event.offsetX * ratio, y: event.offsetY * ratio };
  fingers.set(event.pointerId, at);
  const after = [...fingers.values()];
  if (after.length === 1) {
    pan(at.x - old.x, at.y - old.y);
    return;
  }
  const [a, b] = after,
    [c, d] = before,
    apart = (p, q) => Math.hypot(p.x - q.x, p.y - q.y);
  pan((a.x + b.x - c.x - d.x) / 2, (a.y + b.y - c.y - d.y) / 2);
  zoom(apart(a, b) / Math.max(1, apart(c, d)), (a.x + b.x) / 2, (a.y + b.y) / 2);
}
function listenToArena() {
  const stage = $("stage");
  stage.addEventListener(
    "wheel",
    e => {
      e.preventDefault();
      if (isDragging()) {
        turnGrabbed(e.deltaY > 0 ? -Math.PI / 12 : Math.PI / 12);
        return;
      }
      zoom(Math.exp(-e.deltaY * (e.deltaMode ? 0.05 : 0.0015)), e.offsetX * ratio, e.offsetY * ratio);
    },
    { passive: false },
  );
  stage.addEventListener("pointerdown", e => {
    stage.setPointerCapture(e.pointerId);
    if (fingers.size || !grab(e)) fingers.set(e.pointerId, { x: e.offsetX * ratio, y: e.offsetY * ratio });
  });
  stage.addEventListener("pointermove", e => {
    if (fingers.has(e.pointerId)) fingersMoved(e);
  });
  for (const end of ["pointerup", "pointercancel"]) stage.addEventListener(end, e => fingers.delete(e.pointerId));
  $("zoomIn").onclick = () => zoom(1.4);
  $("zoomOut").onclick = () => zoom(1 / 1.4);
  $("fit").onclick = () => {
    fitView();
    viewChanged();
  };
  $("follow").onclick = () => setFollowing(!following);
}
const PAN_KEYS = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
// True: it was one of the arena's keys.
function arenaKey(e) {
  if (e.key === "+" || e.key === "=") zoom(1.4);
  else if (e.key === "-") zoom(1 / 1.4);
  else if (e.key === "0") {
    fitView();
    viewChanged();
  } else if (e.key === "f" || e.key === "F") setFollowing(!following);
  else if (e.shiftKey && e.target === $("stage") && PAN_KEYS[e.key])
    pan(...PAN_KEYS[e.key].map(step => step * 60 * ratio));
  else return false;
  return true;
}
