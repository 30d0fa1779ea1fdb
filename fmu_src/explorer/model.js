// @ts-check
// The linkage as the FMU answers it: one pose, a whole turn, gradients. Nothing is solved here.

import { machineSpeed } from "./design.js";
import { Refusal } from "./fmi.js";
import { RATE, SPACING, TURN } from "./interface.js";

/** @typedef {import("./fmi.js").Fmu} Fmu */
/** @typedef {import("./fmi.js").Block} Block */
/** @typedef {import("./interface.js").Catalogue} Catalogue */
/** @typedef {import("./design.js").Design} Design */
/** @typedef {{x: number, y: number}} Point m, x forward, y up, relative to the machine */

/** Where a dyad cannot close. @typedef {{dyad: string, phi: number, miss: number, message: string}} Gap
 * miss in mm: how much too far apart (positive) or too near its ends are */

/** A whole turn. @typedef {object} Turn
 * @property {Float64Array} phi rad, from 0 to one turn, both included
 * @property {Record<string, Float64Array>} outputs by name: those that curves and figures are made of, or all
 * @property {Gap[]} gaps the poses that cannot be reached; where there are any, outputs are not whole
 */

/** What is differentiated by; angle: the place of crank.phi. @typedef {{names: string[], block: Block, angle: number}} Knowns */

export const SAMPLES = 720;
const GAP = /dyad (\w+) at crank\.phi = (\S+) rad(?:, where distance \w+ is (\S+) mm too (long|short))?/;

/** One instance in initialization mode, where outputs follow what is set. */
export class Model {
  /** @param {Fmu} fmu @param {Catalogue} catalogue */
  constructor(fmu, catalogue) {
    this.catalogue = catalogue;
    this.instance = fmu.instance("explorer").enter();
    const block = (/** @type {string[]} */ names) => fmu.block(names.map((name) => catalogue.reference(name)));
    /** All that is told of a pose. */
    this.names = catalogue.computed((v) => v.kind === "output" || v.name.startsWith("joint.")).map((v) => v.name);
    this.outputs = block(this.names);
    /** What curves and figures are made of, by place. */
    this.curveNames = [...GRADED, INERTIA].filter((name) => catalogue.variables.has(name));
    this.place = new Map(this.curveNames.map((name, k) => [name, k]));
    this.curves = block(this.curveNames);
    this.points = block([...MOVING].flatMap((joint) => [`joint.${joint}.x`, `joint.${joint}.y`]));
    this.parameterNames = catalogue.parameters.map((q) => q.name);
    this.parameters = fmu.block(catalogue.parameters.map((q) => catalogue.reference(q.name)));
    this.inputs = fmu.block(["crank.phi", RATE, "machine.v", "machine.s"].map((name) => catalogue.reference(name)));
    /** What figures depend on, and what they are differentiated by: parameters, the angle, the rate. */
    this.unknownNames = GRADED.filter((name) => catalogue.variables.has(name));
    this.unknowns = block(this.unknownNames);
    this.block = block;
    /** @type {Knowns | undefined} */
    this.found = undefined;
    /** The design that the FMU has. @type {Design | undefined} */
    this.taken = undefined;
    this.rate = 0;
    this.spacing = 0;
    this.speed = 0;
  }

  /** By what the FMU has derivatives; asked when they are first wanted. */
  get knowns() {
    if (!this.found) {
      const all = [...this.parameterNames, "crank.phi", RATE];
      const isKnown = (/** @type {string[]} */ some) => this.#differentiates(this.block(some));
      const names = isKnown(all) ? all : all.filter((name) => isKnown([name]));
      this.found = { names, block: this.block(names), angle: names.indexOf("crank.phi") };
    }
    return this.found;
  }

  /** Whether the FMU has derivatives by all of these variables. @param {Block} knowns */
  #differentiates(knowns) {
    try {
      this.instance.adjoint(this.unknowns, knowns);
      return true;
    } catch (problem) {
      if (problem instanceof Refusal) return false;
      throw problem;
    }
  }

  /** Take another design. Throws Refusal where a value is out of its range. @param {Design} design */
  take(design) {
    if (design === this.taken) return;
    this.taken = undefined;
    this.parameters.view.set(this.parameterNames.map((name) => design[name]));
    this.instance.set(this.parameters);
    this.rate = design[RATE];
    this.spacing = design[SPACING];
    this.speed = machineSpeed(design);
    this.taken = design;
  }

  /** Set the crank's angle, its rate, and the machine where it then is. @param {number} phi rad */
  turnTo(phi) {
    const values = this.inputs.view;
    values[0] = phi;
    values[1] = this.rate;
    values[2] = this.speed;
    values[3] = (this.spacing * phi) / TURN;
    this.instance.set(this.inputs);
  }

  /**
   * What curves and figures are made of at an angle, in the order of `curveNames`; valid until the next call. Throws
   * Refusal where the pose cannot be reached.
   * @param {number} phi rad @param {Block} block other variables, where others are wanted
   */
  at(phi, block = this.curves) {
    this.turnTo(phi);
    return this.instance.get(block);
  }

  /** All outputs at an angle, by name. @param {number} phi rad @returns {Record<string, number>} */
  pose(phi) {
    const values = this.at(phi, this.outputs);
    return Object.fromEntries(this.names.map((name, k) => [name, values[k]]));
  }

  /** The points of the linkage at an angle, by letter. @param {number} phi rad @returns {Record<string, Point>} */
  joints(phi) {
    const values = this.at(phi, this.points);
    /** @type {Record<string, Point>} */
    const found = { O: { x: 0, y: 0 } };
    for (let k = 0; k < MOVING.length; k += 1) found[MOVING[k]] = { x: values[2 * k], y: values[2 * k + 1] };
    return found;
  }

  /** One turn at equal angles, of every output. @returns {Turn} */
  table() {
    return this.turn(SAMPLES, this.names, this.outputs);
  }

  /** One turn at equal angles. @param {number} samples @param {string[]} names @param {Block} block their variables @returns {Turn} */
  turn(samples = SAMPLES, names = this.curveNames, block = this.curves) {
    const phi = new Float64Array(samples + 1);
    const columns = names.map(() => new Float64Array(samples + 1).fill(Number.NaN));
    /** @type {Gap[]} */
    const gaps = [];
    for (let k = 0; k <= samples; k += 1) {
      phi[k] = (TURN * k) / samples;
      try {
        const values = this.at(phi[k], block);
        for (let c = 0; c < columns.length; c += 1) columns[c][k] = values[c];
      } catch (problem) {
        if (!(problem instanceof Refusal)) throw problem;
        gaps.push(gapOf(problem.message, phi[k]));
      }
    }
    return { phi, outputs: Object.fromEntries(names.map((name, c) => [name, columns[c]])), gaps };
  }

  /**
   * The gradient of a weighted sum of outputs at an angle, by `knowns.names`.
   * @param {number} phi rad @param {Record<string, number>} weights by output
   * @returns {Float64Array} valid until the next call
   */
  gradient(phi, weights) {
    const knowns = this.knowns.block;
    this.turnTo(phi);
    const seeds = this.unknowns.view;
    this.unknownNames.forEach((name, k) => {
      seeds[k] = weights[name] ?? 0;
    });
    return this.instance.adjoint(this.unknowns, knowns);
  }
}

/** Outputs that figures are made of. */
const GRADED = ["tip.x", "tip.y", "tip.vx", "tip.vy", "tip.ax", "tip.ay", "tip.angle", "assembly.margin", "crank.tau"];
const INERTIA = "crank.inertia";
const MOVING = "ABCDEFGHIJ"; // points that the FMU tells; O is the origin

/** What the component's message tells of a pose that it cannot reach. @param {string} message @param {number} phi @returns {Gap} */
export function gapOf(message, phi) {
  const found = GAP.exec(message);
  const miss = found?.[3] ? Number(found[3]) * (found[4] === "long" ? 1 : -1) : 0;
  return { dyad: found?.[1] ?? "?", phi, miss, message };
}

/** The gap that misses by most. @param {Gap[]} gaps */
export function worst(gaps) {
  return gaps.reduce((a, b) => (Math.abs(b.miss) > Math.abs(a.miss) ? b : a));
}
