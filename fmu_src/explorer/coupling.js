// @ts-check
// What a simulation engineer wants to know: the FMU stepped as a co-simulation master steps it, and how far its tip then
// is from where the crank's true motion puts it. Inputs set before a step belong to its start, outputs after it to its
// end. A rung is what the master gives of the crank.

import { RATE, TURN } from "./interface.js";

/** @typedef {import("./fmi.js").Fmu} Fmu */
/** @typedef {import("./fmi.js").Block} Block */
/** @typedef {import("./interface.js").Catalogue} Catalogue */
/** @typedef {import("./design.js").Design} Design */
/** How the crank turns: its mean rate in rad/s, how much of it swings, and how often a second. @typedef {{rate: number, share: number, frequency: number}} Ripple */
/** @typedef {{key: string, title: string, inputs: number, atStepEnd?: boolean, ofStepEnd?: boolean}} Rung */

/** @type {Rung[]} */
export const RUNGS = [
  { key: "held", title: "held: the inputs used as they are", inputs: 3, atStepEnd: true },
  { key: "angle_speed", title: "angle and speed", inputs: 2 },
  { key: "angle_speed_acceleration", title: "angle, speed and acceleration", inputs: 3 },
  { key: "angle", title: "angle alone", inputs: 1 },
  {
    key: "at_step_end",
    title: "angle of the step's end (crank.at_step_end)",
    inputs: 1,
    atStepEnd: true,
    ofStepEnd: true,
  },
];

export const STEPS_MS = [0.5, 1, 2, 5, 10, 20];
export const DURATION = 12; // s: turn and ripple have then met in every way
const START_UP = 5; // steps, until every history is full

/** Angle, speed and acceleration of the crank. @param {Ripple} ripple @param {number} time s @returns {[number, number, number]} */
export function motion({ rate, share, frequency }, time) {
  const pulse = TURN * frequency;
  return [
    rate * (time + (pulse > 0 ? (share * (1 - Math.cos(pulse * time))) / pulse : 0)),
    rate * (1 + share * Math.sin(pulse * time)),
    rate * share * pulse * Math.cos(pulse * time),
  ];
}

/** One run. @typedef {object} Run
 * @property {Float64Array} x of the tip after each step, m @property {Float64Array} y
 * @property {Float64Array} error distance from the true place, m
 * @property {number} worst after the start-up, m */

/** Two instances: one that is stepped, one that says where the tip really is. */
export class Coupling {
  /** @param {Fmu} fmu @param {Catalogue} catalogue */
  constructor(fmu, catalogue) {
    const reference = (/** @type {string} */ name) => catalogue.reference(name);
    this.driven = fmu.instance("driven");
    this.truth = fmu.instance("truth");
    this.parameterNames = catalogue.parameters.map((q) => q.name);
    this.parameters = fmu.block(this.parameterNames.map(reference));
    const crank = ["crank.phi", RATE, "crank.a"].map(reference);
    this.inputs = [0, 1, 2, 3].map((count) => fmu.block(crank.slice(0, count)));
    this.tip = fmu.block(["tip.x", "tip.y"].map(reference));
    this.atStepEnd = reference("crank.at_step_end");
  }

  /** The tip where the crank truly is, after each step. @param {Design} design @param {Ripple} ripple @param {number} step s @param {number} count */
  where(design, ripple, step, count) {
    this.truth.reset().enter();
    this.#take(this.truth, design);
    const [x, y] = [new Float64Array(count), new Float64Array(count)];
    for (let k = 0; k < count; k += 1) {
      this.inputs[3].view.set(motion(ripple, (k + 1) * step));
      this.truth.set(this.inputs[3]);
      [x[k], y[k]] = this.truth.get(this.tip);
    }
    return { x, y };
  }

  /** @param {import("./fmi.js").Instance} instance @param {Design} design */
  #take(instance, design) {
    this.parameters.view.set(this.parameterNames.map((name) => design[name]));
    instance.set(this.parameters);
  }

  /**
   * Steps of `step` seconds with what a rung gives.
   * @param {Design} design @param {Ripple} ripple @param {Rung} rung @param {number} step s
   * @param {{x: Float64Array, y: Float64Array}} truth from `where` @returns {Run}
   */
  run(design, ripple, rung, step, truth) {
    const count = truth.x.length;
    const inputs = this.inputs[rung.inputs];
    const give = (/** @type {number} */ time) => {
      inputs.view.set(motion(ripple, time).slice(0, rung.inputs));
      this.driven.set(inputs);
    };
    this.driven.reset();
    if (rung.atStepEnd) this.driven.setBoolean(this.atStepEnd, true);
    this.driven.enter();
    this.#take(this.driven, design);
    give(0);
    this.driven.exit();
    const found = { x: new Float64Array(count), y: new Float64Array(count), error: new Float64Array(count), worst: 0 };
    for (let k = 0; k < count; k += 1) {
      give((k + (rung.ofStepEnd ? 1 : 0)) * step);
      this.driven.doStep(k * step, step);
      const [x, y] = this.driven.get(this.tip);
      found.x[k] = x;
      found.y[k] = y;
      found.error[k] = Math.hypot(x - truth.x[k], y - truth.y[k]);
      if (k >= START_UP) found.worst = Math.max(found.worst, found.error[k]);
    }
    return found;
  }
}
