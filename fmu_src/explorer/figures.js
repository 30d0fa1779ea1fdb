// @ts-check
// The figures of a design, each with its exact derivative by every quantity.
//
// Extremes and crossings are found between the samples of a turn and then to rounding, by the FMU. A figure's
// derivative is the sum of adjoint derivatives at the poses that it is made of. The pose of an extreme may move without
// changing it; that of a crossing, or of the lowest point for what is read there, moves by the implicit function theorem.

import { DEPTH, LEVEL, RATE, SPACING, TURN } from "./interface.js";

/** @typedef {import("./model.js").Model} Model */
/** @typedef {import("./model.js").Turn} Turn */
/** @typedef {import("./design.js").Design} Design */

/** One figure: its value at once, its derivatives when they are first asked for. */
export class Figure {
  /** @type {Record<string, number> | undefined} */
  #by;
  #derive;

  /** @param {number} value SI; NaN where the design has none, such as a hole where the tip stays above the ridge @param {() => Record<string, number>} derive */
  constructor(value, derive) {
    this.value = value;
    this.#derive = derive;
  }

  /** Derivative by each quantity, SI. */
  get by() {
    this.#by ??= this.#derive();
    return this.#by;
  }
}

/** What a figure is, for tables. @typedef {object} Kind
 * @property {string} key @property {string} title @property {string} text
 * @property {string} unit SI @property {string} display @property {number} factor @property {number} digits
 * @property {number} aim 1: larger is better, -1: smaller, 0: nearer to zero */

/** @type {Kind[]} */
export const KINDS = [
  {
    key: "height",
    title: "height",
    text: "Height of the static trajectory: highest less lowest point of the tip",
    unit: "m",
    display: "mm",
    factor: 1e3,
    digits: 2,
    aim: 1,
  },
  {
    key: "hole",
    title: "hole",
    text: "Length of the hole: from where the tip enters the ridge's surface to where it leaves it, along the row",
    unit: "m",
    display: "mm",
    factor: 1e3,
    digits: 2,
    aim: -1,
  },
  {
    key: "swept",
    title: "swept width",
    text: "Width that the nozzle's axis sweeps at the ridge's surface while the tip is below it",
    unit: "m",
    display: "mm",
    factor: 1e3,
    digits: 2,
    aim: -1,
  },
  {
    key: "lean",
    title: "lean",
    text: "Lean of the nozzle at the lowest point: how far its axis is from upright, positive where the tip points forward",
    unit: "rad",
    display: "°",
    factor: 360 / TURN,
    digits: 2,
    aim: 0,
  },
  {
    key: "ground_speed",
    title: "ground speed",
    text: "Speed of the tip over ground, forward, at the lowest point: 0 sets the plant where it stands",
    unit: "m/s",
    display: "mm/s",
    factor: 1e3,
    digits: 1,
    aim: 0,
  },
  {
    key: "margin",
    title: "margin",
    text: "Least assembly.margin over the whole turn: the smaller sine of the transmission angles, 0 at a dead point",
    unit: "1",
    display: "",
    factor: 1,
    digits: 4,
    aim: 1,
  },
  {
    key: "peak_acceleration",
    title: "peak acceleration",
    text: "Greatest acceleration of the tip relative to the machine",
    unit: "m/s2",
    display: "m/s²",
    factor: 1,
    digits: 2,
    aim: -1,
  },
  {
    key: "peak_torque",
    title: "peak torque",
    text: "Greatest magnitude of the torque that the drive must give, at a steady rate",
    unit: "N.m",
    display: "N·m",
    factor: 1,
    digits: 3,
    aim: -1,
  },
]; // prettier-ignore

/**
 * All figures of a design whose whole turn can be made.
 * @param {Model} model which has taken the design @param {Design} design @param {Turn} turn
 * @returns {Record<string, Figure>}
 */
export function figures(model, design, turn) {
  return new Measurer(model, design, turn).all();
}

/** @typedef {(values: Float64Array) => number} Signal */
/** Weighted outputs at an angle. @typedef {[number, Record<string, number>]} Part */
/** Where something goes through the ridge's surface: the tip, or the nozzle's axis above it. @typedef {{phi: number, x: number, isTip: boolean}} Place */

class Measurer {
  /** @param {Model} model @param {Design} design @param {Turn} turn */
  constructor(model, design, turn) {
    this.model = model;
    this.design = design;
    this.turn = turn;
    this.step = turn.phi[1] - turn.phi[0];
    this.last = turn.phi.length - 1; // the first pose once more
    const at = (/** @type {string} */ name) => model.place.get(name) ?? -1;
    this.x = at("tip.x");
    this.y = at("tip.y");
    this.vx = at("tip.vx");
    this.vy = at("tip.vy");
    this.ax = at("tip.ax");
    this.ay = at("tip.ay");
    this.angle = at("tip.angle");
    this.margin = at("assembly.margin");
    this.tau = at("crank.tau");
  }

  /** @returns {Record<string, Figure>} */
  all() {
    const y = this.turn.outputs["tip.y"];
    const top = this.level(extreme(y, this.last, 1));
    const bottom = this.level(extreme(y, this.last, -1));
    const lowest = this.read(bottom, this.y);
    /** @type {Record<string, Figure>} */
    const found = {
      height: this.sum(this.read(top, this.y) - lowest, () => [
        [top, { "tip.y": 1 }],
        [bottom, { "tip.y": -1 }],
      ]),
      ...this.inTheRidge(bottom, lowest),
      lean: this.atBottom(bottom, this.angle, "tip.angle", Math.PI / 2),
      ground_speed: this.groundSpeed(bottom),
      margin: this.leastMargin(),
      peak_acceleration: this.peak(
        (v) => Math.hypot(v[this.ax], v[this.ay]),
        (v, size) => ({ "tip.ax": v[this.ax] / size, "tip.ay": v[this.ay] / size }),
        this.turn.outputs["tip.ax"].map((ax, k) => Math.hypot(ax, this.turn.outputs["tip.ay"][k])),
      ),
    };
    if (this.turn.outputs["crank.tau"]?.some((value) => value !== 0))
      found.peak_torque = this.peak(
        (v) => Math.abs(v[this.tau]),
        (v) => ({ "crank.tau": Math.sign(v[this.tau]) }),
        this.turn.outputs["crank.tau"].map(Math.abs),
      );
    return found;
  }

  /** One output at an angle. @param {number} phi @param {number} place */
  read(phi, place) {
    return this.model.at(phi)[place];
  }

  /** The angle next to a sample at which the tip moves level: tip.vy is 0. @param {number} k */
  level(k) {
    const { phi } = this.turn;
    return root((angle) => this.read(angle, this.vy), phi[k] - this.step, phi[k] + this.step);
  }

  /**
   * A figure whose derivatives are those of weighted outputs at some poses, and others.
   * @param {number} value @param {() => Part[]} parts @param {(by: Record<string, number>) => void} add the others
   */
  sum(value, parts, add = () => {}) {
    return new Figure(value, () => {
      const { model, design } = this;
      model.take(design);
      const { names, angle } = model.knowns;
      const total = new Float64Array(names.length);
      for (const [phi, weights] of parts()) {
        const part = model.gradient(phi, weights);
        for (let k = 0; k < total.length; k += 1) total[k] += part[k];
      }
      /** @type {Record<string, number>} */
      const by = { [SPACING]: 0, [DEPTH in design ? DEPTH : LEVEL]: 0 };
      for (const [k, name] of names.entries()) if (k !== angle) by[name] = total[k];
      add(by);
      return by;
    });
  }

  /** Derivative of weighted outputs by the crank's angle. @param {number} phi @param {Record<string, number>} weights */
  slope(phi, weights) {
    return this.model.gradient(phi, weights)[this.model.knowns.angle];
  }

  /** What is read at the lowest point, which moves. @param {number} phi @param {number} place @param {string} name @param {number} offset @param {(by: Record<string, number>) => void} [add] */
  atBottom(phi, place, name, offset, add) {
    const parts = () => {
      const moved = -this.slope(phi, { [name]: 1 }) / this.slope(phi, { "tip.vy": 1 });
      return [/** @type {Part} */ ([phi, { [name]: 1, "tip.vy": moved }])];
    };
    return this.sum(this.read(phi, place) + offset, parts, add);
  }

  /** @param {number} phi */
  groundSpeed(phi) {
    const { rate, spacing, speed } = this.model;
    return this.atBottom(phi, this.vx, "tip.vx", speed, (by) => {
      by[SPACING] += rate / TURN;
      by[RATE] += spacing / TURN;
    });
  }

  /** The greatest value of a signal. @param {Signal} signal @param {(v: Float64Array, value: number) => Record<string, number>} weights @param {Float64Array} samples */
  peak(signal, weights, samples) {
    const k = extreme(samples, this.last, 1);
    const phi = summit((angle) => signal(this.model.at(angle)), this.turn.phi[k], this.step);
    const values = this.model.at(phi).slice();
    const value = signal(values);
    return this.sum(value, () => [[phi, weights(values, value)]]);
  }

  leastMargin() {
    const samples = this.turn.outputs["assembly.margin"];
    const k = extreme(samples, this.last, -1);
    const phi = summit((angle) => -this.read(angle, this.margin), this.turn.phi[k], this.step);
    return this.sum(this.read(phi, this.margin), () => [[phi, { "assembly.margin": 1 }]]);
  }

  /** Hole and swept width. @param {number} bottom @param {number} lowest */
  inTheRidge(bottom, lowest) {
    const none = new Figure(Number.NaN, () => ({}));
    const surface = ridgeSurface(this.design, lowest);
    const crossings = this.crossings(bottom, surface);
    if (!crossings) return { hole: none, swept: none };
    const [entry, exit] = crossings.map((phi) => ({ phi, x: this.along(phi), isTip: true }));
    const hole = this.difference(bottom, surface, exit, entry);
    // while the tip is in the ridge the nozzle's axis crosses the surface above it
    let [least, most] = entry.x < exit.x ? [entry, exit] : [exit, entry];
    const inside = [];
    for (let phi = crossings[0] + this.step / 2; phi < crossings[1]; phi += this.step) inside.push(phi);
    const where = (/** @type {number} */ phi) => this.axisAt(phi, surface);
    const xs = inside.map(where);
    if (inside.length > 2)
      for (const sign of [-1, 1]) {
        const k = xs.reduce((best, x, i) => (sign * x > sign * xs[best] ? i : best), 0);
        const phi = summit((angle) => sign * where(angle), inside[k], this.step, crossings);
        if (crossings.includes(phi)) continue; // the tip itself, whose pose moves with the crossing
        const place = { phi, x: where(phi), isTip: false };
        if (sign < 0 && place.x < least.x) least = place;
        if (sign > 0 && place.x > most.x) most = place;
      }
    return { hole, swept: this.difference(bottom, surface, most, least) };
  }

  /** Where the tip goes through the surface before and after the lowest point. @param {number} bottom @param {number} surface */
  crossings(bottom, surface) {
    const over = (/** @type {number} */ phi) => this.read(phi, this.y) - surface;
    if (over(bottom) >= 0) return null;
    const found = [];
    for (const side of [-1, 1]) {
      let [inside, outside] = [bottom, bottom + side * this.step];
      while (over(outside) < 0) {
        if (Math.abs(outside - bottom) > TURN) return null; // it never leaves
        [inside, outside] = [outside, outside + side * this.step];
      }
      found.push(root(over, inside, outside));
    }
    return found;
  }

  /** The tip along the row. @param {number} phi */
  along(phi) {
    return this.read(phi, this.x) + (this.model.spacing * phi) / TURN;
  }

  /** The nozzle's axis on the surface, along the row. @param {number} phi @param {number} surface */
  axisAt(phi, surface) {
    const values = this.model.at(phi);
    return (
      values[this.x] +
      (this.model.spacing * phi) / TURN +
      (surface - values[this.y]) * (Math.cos(values[this.angle]) / Math.sin(values[this.angle]))
    );
  }

  /**
   * How a place on the surface moves: its weighted outputs, and with the surface's height. That of the tip is at a
   * crossing, whose pose moves too.
   * @param {Place} place @param {number} surface @param {number} sign @returns {{part: Part, raised: number}}
   */
  moved({ phi, isTip }, surface, sign) {
    const values = this.model.at(phi);
    if (isTip) {
      const rise = (values[this.vx] + this.model.speed) / values[this.vy];
      return { part: [phi, { "tip.x": sign, "tip.y": -sign * rise }], raised: sign * rise };
    }
    const sine = Math.sin(values[this.angle]);
    const cot = Math.cos(values[this.angle]) / sine;
    const turned = (values[this.y] - surface) / sine ** 2;
    return { part: [phi, { "tip.x": sign, "tip.y": -sign * cot, "tip.angle": sign * turned }], raised: sign * cot };
  }

  /**
   * How far one place on the surface is ahead of another. A surface at a depth goes with the lowest point.
   * @param {number} bottom @param {number} surface @param {Place} front @param {Place} back
   */
  difference(bottom, surface, front, back) {
    const { design } = this;
    let raised = 0;
    const parts = () => {
      const ends = [this.moved(front, surface, 1), this.moved(back, surface, -1)];
      raised = ends[0].raised + ends[1].raised;
      const found = ends.map((end) => end.part);
      if (DEPTH in design) found.push([bottom, { "tip.y": raised }]);
      return found;
    };
    return this.sum(front.x - back.x, parts, (by) => {
      by[SPACING] += (front.phi - back.phi) / TURN;
      by[DEPTH in design ? DEPTH : LEVEL] += raised;
    });
  }
}

/** Height of the ridge's surface over O. @param {Design} design @param {number} lowest of the tip */
export function ridgeSurface(design, lowest) {
  return DEPTH in design ? lowest + design[DEPTH] : design[LEVEL];
}

/** The place of the greatest (sign 1) or least of the first `count` samples. @param {Float64Array} samples @param {number} count @param {number} sign */
function extreme(samples, count, sign) {
  let best = 0;
  for (let k = 1; k < count; k += 1) if (sign * samples[k] > sign * samples[best]) best = k;
  return best;
}

/**
 * Where a function changes its sign between a and b, to rounding: the secant where it stays within the bracket and
 * shrinks it, else its middle.
 * @param {(x: number) => number} f @param {number} a @param {number} b
 */
export function root(f, a, b) {
  let [fa, fb] = [f(a), f(b)];
  if (fa === 0) return a;
  if (fb === 0) return b;
  if (fa > 0 === fb > 0) return Math.abs(fa) < Math.abs(fb) ? a : b;
  for (let k = 0; k < 60; k += 1) {
    let x = b - (fb * (b - a)) / (fb - fa);
    if (k % 3 === 2 || !(x > Math.min(a, b) && x < Math.max(a, b))) x = 0.5 * (a + b);
    if (x === a || x === b) break;
    const fx = f(x);
    if (fx === 0) return x;
    if (fx > 0 === fa > 0) [a, fa] = [x, fx];
    else [b, fb] = [x, fx];
  }
  return Math.abs(fa) < Math.abs(fb) ? a : b;
}

/**
 * Where a function is greatest near x: parabolas through three points, until they move it no more than its value can
 * tell; within limits, where they are given.
 * @param {(x: number) => number} f @param {number} x @param {number} step @param {readonly number[]} limits
 */
export function summit(f, x, step, limits = [-Infinity, Infinity]) {
  const within = (/** @type {number} */ at) => Math.min(Math.max(at, limits[0]), limits[1]);
  let h = step;
  for (let k = 0; k < 12 && h > 1e-6; k += 1) {
    const [before, here, after] = [f(within(x - h)), f(x), f(within(x + h))];
    const bend = before - 2 * here + after;
    const shift = bend < 0 ? (0.5 * h * (before - after)) / bend : 0;
    const next = within(x + Math.max(-h, Math.min(h, shift)));
    if (f(next) >= here) x = next;
    h /= 4;
  }
  return x;
}
