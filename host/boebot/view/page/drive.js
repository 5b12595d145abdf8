// Driving by hand: keys, arrows on the screen, a gamepad; and the emergency stop. While something is held the server is
// told again and again; it stops the robot when it hears nothing for 0.3 s.

const AGAIN_MS = 80;
const DEAD_ZONE = 0.12;
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
let pads = false;
let padStops = false; // its button for that is down

// Motor signals for what is held, by keys or arrows or else by the gamepad.
function wanted() {
  const power = Number($("power")?.value ?? 60) / 100;
  let ahead = held.has("ahead") - held.has("back"),
    turn = held.has("left") - held.has("right");
  if (!held.size) [ahead, turn] = padSticks();
  if (!held.size && !ahead && !turn) return null;
  const left = ahead - TURN * turn,
    right = ahead + TURN * turn,
    most = Math.max(1, Math.abs(left), Math.abs(right));
  return [left, right].map(v => Math.round(((1000 * v) / most) * power) / 1000);
}
// Ahead and turn, each -1 to 1.
function padSticks() {
  const pad = pads && [...navigator.getGamepads()].find(one => one && one.connected);
  if (!pad) return [0, 0];
  const stops = !!pad.buttons[1]?.pressed;
  if (stops && !padStops) stopRobot(); // once for each time that it is pressed
  padStops = stops;
  if (stops) return [0, 0];
  const stick = v => (Math.abs(v) < DEAD_ZONE ? 0 : -v);
  return [stick(pad.axes[1]), stick(pad.axes[0])];
}
let driving = false;
function sayHand() {
  const signals = wanted();
  if (signals) {
    driving = true;
    if (!newest) setNewest(true);
    send({ type: "hand", robot: runs.indexOf(run), left: signals[0], right: signals[1] });
  } else if (driving) {
    driving = false;
    send({ type: "hand", robot: runs.indexOf(run), left: 0, right: 0 });
  }
  if (!signals && !pads) {
    clearInterval(handTimer);
    handTimer = null;
  }
}
function hold(name, on) {
  if (!can.has("hand") || ended !== null || held.has(name) === on) return;
  if (on) held.add(name);
  else held.delete(name);
  $("drive").querySelector(`[data-way=${name}]`)?.classList.toggle("held", on);
  sayHand();
  if (held.size || pads) handTimer ??= setInterval(sayHand, AGAIN_MS);
}
function letGo() {
  for (const name of [...held]) hold(name, false);
}
function stopRobot() {
  letGo();
  driving = false;
  send({ type: "stop", robot: runs.indexOf(run) });
}
addEventListener("blur", letGo);
addEventListener("gamepadconnected", () => {
  pads = true;
  if (can.has("hand")) handTimer ??= setInterval(sayHand, AGAIN_MS);
});
addEventListener("gamepaddisconnected", () => {
  pads = [...navigator.getGamepads()].some(Boolean);
});

// ---- the panel ----
const WAYS = [
  ["ahead", "▲", "Ahead"],
  ["left", "◀", "Left"],
  ["right", "▶", "Right"],
  ["back", "▼", "Back"],
];
function makeDrive() {
  hide("drive", !can.has("hand"));
  if (!can.has("hand")) return;
  const arrows = WAYS.map(([name, sign, label]) => {
    const it = element("button", { className: "way " + name, textContent: sign, ariaLabel: label + ", while held" });
    it.dataset.way = name;
    it.onpointerdown = event => {
      it.setPointerCapture(event.pointerId);
      hold(name, true);
    };
    it.onpointerup = it.onpointercancel = it.onblur = () => hold(name, false);
    it.onkeydown = event => {
      if (event.key === "Enter") {
        event.preventDefault();
        hold(name, true);
      }
    };
    it.onkeyup = event => {
      if (event.key === "Enter") hold(name, false);
    };
    it.oncontextmenu = event => event.preventDefault(); // of a long press
    return it;
  });
  const halt = element("button", { className: "alert halt", textContent: "Stop", onclick: stopRobot });
  const power = element("input", {
    type: "range",
    id: "power",
    min: 10,
    max: 100,
    value: $("power")?.value ?? 60,
    ariaLabel: "Speed by hand, in percent",
  });
  $("drive").replaceChildren(
    element("h2", { textContent: "Drive by hand" }),
    element("div", { className: "pad" }, ...arrows, halt),
    element("label", { className: "power" }, "speed ", power),
    element("p", { id: "driver" }),
    element(
      "div",
      { className: "buttons" },
      element("button", {
        id: "release",
        textContent: "Let the brain drive",
        onclick: () => {
          letGo();
          send({ type: "release", robot: runs.indexOf(run) });
        },
      }),
      element("button", {
        id: "arm",
        textContent: "Let the motors go again",
        onclick: () => send({ type: "arm", robot: runs.indexOf(run) }),
      }),
    ),
    element("p", { className: "hint", textContent: "W A S D, arrow keys or a gamepad drive; space stops." }),
  );
}
function tellDrive() {
  if (!can.has("hand")) return;
  const { latched } = robotState(),
    driver = robotState().driver ?? state.driver;
  say(
    "driver",
    latched
      ? "Stopped; its motors are off."
      : driver === "you"
        ? "You drive."
        : driver === "another"
          ? "Another page drives by hand."
          : "Its brain drives.",
  );
  $("driver").classList.toggle("alerted", !!latched);
  hide("arm", !latched);
  hide("release", !!latched); // one in the other's place
  $("release").disabled = driver !== "you" || ended !== null;
  $("arm").disabled = ended !== null;
}

// ---- keys: true, if it was one of these ----
function driveKey(e) {
  if (e.key === " ") {
    if (e.repeat) return can.has("hand") || can.has("pause"); // said once, however long it is held
    if (can.has("hand")) {
      stopRobot();
      return true;
    }
    if (can.has("pause")) {
      $("pause").click();
      return true;
    }
    return false;
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
