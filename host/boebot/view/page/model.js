// A robot's run as arrays that grow: a replay appends the whole run at once, a live view a few ticks at a time.

class Column {
  // numbers of one kind; `values` are those so far
  constructor(Type = Float32Array) {
    this.room = new Type(256);
    this.values = this.room.subarray(0, 0);
  }
  append(more) {
    const before = this.values.length,
      length = before + more.length;
    if (length > this.room.length) {
      const wider = new this.room.constructor(Math.max(length, 2 * this.room.length));
      wider.set(this.values);
      this.room = wider;
    }
    this.room.set(more, before);
    this.values = this.room.subarray(0, length);
  }
  // With what is not known.
  fill(length) {
    this.append(new this.room.constructor(Math.max(0, length - this.values.length)).fill(NaN));
  }
  get length() {
    return this.values.length;
  }
  get last() {
    return this.values[this.values.length - 1];
  }
}
const pose = () => [new Column(), new Column(), new Column()];
const appendEach = (columns, texts) => columns.forEach((column, k) => column.append(floats(texts[k])));

// Index of the last of rising times that is not after t; 0 where all are.
function indexIn(times, t) {
  let low = 0,
    high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t) low = middle;
    else high = middle - 1;
  }
  return low;
}
// The same, but -1 before the first; times are rounded to float32.
const shownAt = (times, t) => (times.length && times[0] <= t + 1e-4 ? indexIn(times, t + 1e-4) : -1);
// A robot that was put elsewhere by hand did not drive there.
const FASTEST = 3;
const REACH = 0.1; // m/s and m; farther it cannot have come
const jumps = (times, [xs, ys], i, j) =>
  Math.hypot(xs.values[j] - xs.values[i], ys.values[j] - ys.values[i]) > REACH + FASTEST * (times[j] - times[i]);
// A pose between those of index i and the next one, f of the way.
function mix(columns, i, f) {
  const [x, y, heading] = columns.map(column => column.values),
    j = Math.min(x.length - 1, i + 1),
    turn = heading[j] - heading[i];
  return [
    x[i] + (x[j] - x[i]) * f,
    y[i] + (y[j] - y[i]) * f,
    heading[i] + Math.atan2(Math.sin(turn), Math.cos(turn)) * f,
  ];
}
function poseAt(times, columns, t) {
  const i = indexIn(times, t),
    step = i < times.length - 1 ? times[i + 1] - times[i] : 1;
  const f = Math.min(1, Math.max(0, (t - times[i]) / step));
  return mix(columns, i, f > 0 && f < 1 && jumps(times, columns, i, i + 1) ? 0 : f);
}

class Run {
  constructor(about) {
    const { rows, ...still } = about; // what does not change: title, brain, begin, known, table, way, robot, colour, ...
    Object.assign(this, still);
    this.time = new Column();
    this.path = pose();
    this.estimate = about.has_estimate ? pose() : null;
    this.turret = new Column();
    this.left = new Column();
    this.right = new Column();
    this.state = new Column(Uint8Array);
    this.contact = new Column(Uint8Array);
    this.signs = about.signs.map(sign => ({ ...sign, values: new Column(Uint8Array) })); // of devices that are on or off
    this.readings = about.readings.map(one => ({ ...one, values: new Column(), ages: new Column() }));
    this.shownTime = new Column();
    this.numbers = [];
    this.texts = [];
    this.layers = [];
    this.swept = about.swept.map(one => ({
      reach: one.reach,
      angles: floats(one.angles),
      time: new Column(),
      pose: pose(),
      distances: new Column(Uint16Array),
    }));
    this.mind = about.mind && {
      behaviors: withUtility(about.mind.behaviors),
      cognitive: withUtility(about.mind.cognitive),
      time: new Column(),
      motor: new Column(Uint8Array),
      switches: [],
    };
    this.events = [];
    this.pins = [];
    this.printed = [];
    this.placed = null; // where it has been put while time stands still
    this.names = 0; // how many numbers, texts, layers and pins have come: a new one asks for new panels
    if (rows) this.append(rows);
  }
  get last() {
    return this.time.length - 1;
  }
  get duration() {
    return this.time.length ? this.time.last : 0;
  }
  reading(device) {
    return this.readings.find(one => one.name === device.replaceAll("_", " "));
  }
  // Whether a sign, or "contact", is on at a tick.
  isOn(name, i) {
    if (name === "contact") return this.contact.values[i] > 0;
    return this.signs.some(sign => sign.device === name && sign.values.values[i] > 0);
  }

  append(rows) {
    for (const name of ["time", "turret", "left", "right"]) this[name].append(floats(rows[name]));
    for (const name of ["state", "contact"]) this[name].append(bytes(rows[name]));
    rows.signs.forEach((values, k) => this.signs[k].values.append(bytes(values)));
    appendEach(this.path, rows.path);
    if (this.estimate && rows.estimate) appendEach(this.estimate, rows.estimate);
    rows.readings.forEach((one, k) => {
      this.readings[k].values.append(floats(one.values));
      this.readings[k].ages.append(floats(one.ages));
    });
    this.appendShown(rows.shown);
    rows.layers.forEach(layer => this.appendLayer(layer));
    rows.swept.forEach((one, k) => appendSweeps(this.swept[k], one));
    if (this.mind && rows.mind) this.appendMind(rows.mind);
    this.appendEvents(rows.events);
    rows.pins.forEach(pin => this.appendPin(pin));
    this.printed.push(...rows.printed);
  }
  appendShown(shown) {
    const before = this.shownTime.length,
      time = floats(shown.time);
    this.shownTime.append(time);
    for (const one of shown.numbers) {
      const known = this.named(this.numbers, one.name, () => ({ name: one.name, values: new Column() }));
      known.values.fill(before); // not shown before
      known.values.append(floats(one.values));
    }
    for (const one of shown.texts) {
      const known = this.named(this.texts, one.name, () => ({ name: one.name, values: [] }));
      while (known.values.length < before) known.values.push("");
      for (const index of one.index) known.values.push(one.words[index]);
    }
  }
  appendLayer(layer) {
    const known = this.named(this.layers, layer.name, () => ({
      name: layer.name,
      colour: LAYER_COLOURS[this.layers.length % LAYER_COLOURS.length],
      time: new Column(),
      sketches: [],
    }));
    known.time.append(floats(layer.time));
    known.sketches.push(...layer.sketches);
  }
  appendMind(mind) {
    this.mind.time.append(floats(mind.time));
    this.mind.motor.append(bytes(mind.motor));
    mind.behaviors.forEach((utility, k) => this.mind.behaviors[k].utility.append(floats(utility)));
    mind.cognitive.forEach((utility, k) => this.mind.cognitive[k].utility.append(floats(utility)));
    this.mind.switches.push(...mind.switches);
    for (const [time, name, reason] of mind.switches)
      this.events.push({ time, kind: "switch", text: name + (reason ? ": " + reason : ""), on: name });
  }
  appendEvents(events) {
    for (const [time, kind, text] of events) this.events.push({ time, kind, text });
    this.events.sort((a, b) => a.time - b.time);
  }
  appendPin(pin) {
    const known = this.named(this.pins, pin.name, () => ({
      name: pin.name,
      time: new Column(Float64Array),
      level: new Column(Uint8Array),
    }));
    known.time.append(new Float64Array(bytes(pin.time).buffer));
    known.level.append(bytes(pin.level));
  }
  named(list, name, make) {
    let known = list.find(one => one.name === name);
    if (!known) {
      known = make();
      list.push(known);
      this.names++;
    }
    return known;
  }
}
const withUtility = processes => processes.map(process => ({ ...process, utility: new Column() }));
function appendSweeps(swept, more) {
  swept.time.append(floats(more.time));
  appendEach(swept.pose, more.pose);
  swept.distances.append(new Uint16Array(bytes(more.distances).buffer));
}

class Moving {
  // a shape of the arena that moves; its times are on the clock of the truth
  constructor(about) {
    this.item = about;
    this.time = new Column();
    this.pose = pose();
  }
  append(more) {
    this.time.append(floats(more.time));
    appendEach(this.pose, more.pose);
  }
  at(time) {
    // straight and even between rows; headings are not wrapped
    const times = this.time.values,
      i = indexIn(times, time),
      j = Math.min(times.length - 1, i + 1);
    const f = j > i ? Math.min(1, Math.max(0, (time - times[i]) / (times[j] - times[i]))) : 0;
    return this.pose.map(({ values }) => values[i] + (values[j] - values[i]) * f);
  }
}

// ---- the run that the page shows ----
let plan = null;
let bounds = null;
let runs = [];
let moving = [];
let run = null; // the robot whose signals are shown: one of `runs`
let now = 0; // the moment that is shown, in seconds of that robot's clock

// A run begins, or the whole of one is here.
function begin(content) {
  plan = content.plan;
  bounds = content.bounds;
  runs = content.runs.map(about => new Run(about));
  moving = plan.moving.map(about => new Moving(about));
  content.moving.forEach((rows, k) => moving[k].append(rows));
}
const others = () => runs.filter(other => other !== run);
const later = other => other.begin - run.begin; // each robot counts time from its own first tick
