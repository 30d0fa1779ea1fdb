// @ts-check
// The linkage as the FMU answers it: one pose, a whole turn, gradients. Nothing is solved here; only where the FMU does
// not tell a joint is it found from the nozzle's place and direction along the rigid links.

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
 * @property {Record<string, Float64Array>} outputs by name
 * @property {Gap[]} gaps the poses that cannot be reached; where there are any, outputs are not whole
 */

export const SAMPLES = 720;
const GAP = /dyad (\w+) at crank\.phi = (\S+) rad(?:, where distance \w+ is (\S+) mm too (long|short))?/;

/** One instance in initialization mode, where outputs follow what is set. */
export class Model {
  /** @param {Fmu} fmu @param {Catalogue} catalogue */
  constructor(fmu, catalogue) {
    this.catalogue = catalogue;
    this.instance = fmu.instance("explorer").enter();
    const computed = catalogue.computed((v) => v.kind === "output" || v.name.startsWith("joint."));
    /** What is read of a pose, by place. */
    this.names = computed.map((v) => v.name);
    this.place = new Map(this.names.map((name, k) => [name, k]));
    this.outputs = fmu.block(computed.map((v) => v.reference));
    this.parameterNames = catalogue.parameters.map((q) => q.name);
    this.parameters = fmu.block(catalogue.parameters.map((q) => catalogue.reference(q.name)));
    this.inputs = fmu.block(["crank.phi", RATE, "machine.v", "machine.s"].map((name) => catalogue.reference(name)));
    /** What figures depend on, and what they are differentiated by: parameters, the angle, the rate. */
    this.unknownNames = GRADED.filter((name) => catalogue.variables.has(name));
    this.unknowns = fmu.block(this.unknownNames.map((name) => catalogue.reference(name)));
    const known = [...this.parameterNames, "crank.phi", RATE].filter((name) => this.#differentiates(fmu, name));
    this.knownNames = known;
    this.knowns = fmu.block(known.map((name) => catalogue.reference(name)));
    this.angle = known.indexOf("crank.phi");
    this.rate = 0;
    this.spacing = 0;
    this.speed = 0;
  }

  /** Whether the FMU has derivatives by a variable. @param {Fmu} fmu @param {string} name */
  #differentiates(fmu, name) {
    try {
      this.instance.adjoint(this.unknowns, fmu.block([this.catalogue.reference(name)]));
      return true;
    } catch (problem) {
      if (problem instanceof Refusal) return false;
      throw problem;
    }
  }

  /** Take another design. Throws Refusal where a value is out of its range. @param {Design} design */
  take(design) {
    this.parameters.view.set(this.parameterNames.map((name) => design[name]));
    this.instance.set(this.parameters);
    this.rate = design[RATE];
    this.spacing = design[SPACING];
    this.speed = machineSpeed(design);
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
   * All outputs at an angle, in the order of `names`; valid until the next call. Throws Refusal where the pose cannot be
   * reached.
   * @param {number} phi rad
   */
  at(phi) {
    this.turnTo(phi);
    return this.instance.get(this.outputs);
  }

  /** All outputs at an angle, by name. @param {number} phi rad @returns {Record<string, number>} */
  pose(phi) {
    const values = this.at(phi);
    return Object.fromEntries(this.names.map((name, k) => [name, values[k]]));
  }

  /** One turn at equal angles. @param {number} samples @returns {Turn} */
  turn(samples = SAMPLES) {
    const phi = new Float64Array(samples + 1);
    const columns = this.names.map(() => new Float64Array(samples + 1).fill(Number.NaN));
    /** @type {Gap[]} */
    const gaps = [];
    for (let k = 0; k <= samples; k += 1) {
      phi[k] = (TURN * k) / samples;
      try {
        const values = this.at(phi[k]);
        for (let c = 0; c < columns.length; c += 1) columns[c][k] = values[c];
      } catch (problem) {
        if (!(problem instanceof Refusal)) throw problem;
        gaps.push(gapOf(problem.message, phi[k]));
      }
    }
    return { phi, outputs: Object.fromEntries(this.names.map((name, c) => [name, columns[c]])), gaps };
  }

  /**
   * The gradient of a weighted sum of outputs at an angle, by `knownNames`.
   * @param {number} phi rad @param {Record<string, number>} weights by output
   * @returns {Float64Array} valid until the next call
   */
  gradient(phi, weights) {
    this.turnTo(phi);
    const seeds = this.unknowns.view;
    this.unknownNames.forEach((name, k) => {
      seeds[k] = weights[name] ?? 0;
    });
    return this.instance.adjoint(this.unknowns, this.knowns);
  }
}

/** Outputs that figures are made of. */
const GRADED = ["tip.x", "tip.y", "tip.vx", "tip.vy", "tip.ax", "tip.ay", "tip.angle", "assembly.margin", "crank.tau"];

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

/**
 * The joints of a pose. Where the FMU has local variables joint.*, they are these; else A and D follow from the cranks,
 * and from the tip J and the nozzle's direction I, H, E, F and B along the rigid links EF and DBE.
 * @param {Design} design @param {number} phi @param {(name: string) => number} read an output
 * @returns {Record<string, Point>}
 */
export function joints(design, phi, read) {
  const g = (/** @type {string} */ name) => design[`geometry.${name}`];
  const on = (/** @type {Point} */ from, /** @type {number} */ length, /** @type {number} */ angle) => ({
    x: from.x + length * Math.cos(angle),
    y: from.y + length * Math.sin(angle),
  });
  const O = { x: 0, y: 0 };
  const C = { x: g("XC"), y: g("YC") };
  const G = { x: g("XG"), y: g("YG") };
  const A = on(O, g("L1"), g("phi1") - phi);
  const D = on(C, g("L4"), g("phi4") - phi);
  const J = { x: read("tip.x"), y: read("tip.y") };
  const nozzle = read("tip.angle");
  const HI = nozzle - g("theta9");
  const EF = HI - g("theta8") + Math.PI;
  const I = on(J, -g("L9"), nozzle);
  const H = on(I, -g("L8"), HI);
  const E = on(H, -g("L6") / 2, EF);
  const F = on(H, g("L6") / 2, EF);
  const DE = Math.atan2(E.y - D.y, E.x - D.x);
  const B = on(D, g("L3"), DE + g("theta3"));
  return { O, A, B, C, D, E, F, G, H, I, J };
}
