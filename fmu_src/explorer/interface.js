// @ts-check
// What the exporter puts into the page from interface.toml: every name, unit, range, start value and text of it, and
// the few variables that only the page has, which belong to no FMU: spacing, ridge and the paper's theta41.

/**
 * @typedef {object} Variable
 * @property {string} name
 * @property {string} kind input, output, local, parameter, independent, derivative
 * @property {string} text
 * @property {number} reference value reference
 * @property {string} [unit] missing for Booleans
 * @property {number | boolean} [start]
 * @property {[number, number]} [range]
 * @property {number} [smallest] least magnitude but 0
 * @property {string[]} [initially] parameters that an output depends on
 */

/**
 * @typedef {object} Family a figure of the paper's section 4: one parameter moves
 * @property {number} figure
 * @property {string} name
 * @property {string} title
 * @property {number[]} values in display units
 */

/**
 * @typedef {object} Interface
 * @property {{name: string, token: string, version: string, turnsPerMinute: number, plantSpacing: number}} model
 * @property {Record<string, {display: string, factor: number, exponents: Record<string, number>}>} units
 * @property {Variable[]} variables
 * @property {{ridgeDepth: number, postures: number[], families: Family[], notes: Record<string, string>}} published
 * @property {{text: string, values: Record<string, number>}} masses an example, SI
 */

/** A number that the user may change. @typedef {object} Quantity
 * @property {string} name
 * @property {string} symbol as the paper writes it
 * @property {string} group
 * @property {string} text
 * @property {string} unit SI
 * @property {number} start SI
 * @property {[number, number]} limits SI, what is accepted
 * @property {[number, number]} slider SI, what the slider covers
 */

export const TURN = 2 * Math.PI;
export const RATE = "crank.w";
export const SPACING = "plant.spacing";
export const DEPTH = "ridge.depth";
export const LEVEL = "ridge.y";
export const PHASE = "theta41";
export const FROM = "geometry.phi1";
export const PHASED = "geometry.phi4";

/** What people read and type for an SI unit. @type {Record<string, [string, number]>} */
const SHOWN = {
  "rad/s": ["turns/min", 60 / TURN],
  rad: ["°", 360 / TURN],
  "m/s2": ["m/s²", 1],
  "kg.m2": ["kg·m²", 1],
  "N.m": ["N·m", 1],
  1: ["", 1],
};

/** How far a slider goes from the start value at least, in SI units; else half of the value. @type {Record<string, number>} */
const REACH = { m: 0.02, rad: Math.PI, kg: 2, "kg.m2": 0.01, "m/s2": 10 };

/** The catalogue of all that has a name in the page. */
export class Catalogue {
  /** @param {Interface} declared */
  constructor(declared) {
    this.declared = declared;
    this.model = declared.model;
    this.published = declared.published;
    /** @type {Map<string, Variable>} */
    this.variables = new Map(declared.variables.map((v) => [v.name, v]));
    const shaping = new Set(declared.variables.flatMap((v) => v.initially ?? []));
    /** Real parameters that an output depends on: what shapes the motion. */
    this.parameters = declared.variables
      .filter((v) => v.kind === "parameter" && v.unit !== undefined && shaping.has(v.name))
      .map((v) => this.#quantity(v));
    const rate = (this.model.turnsPerMinute * TURN) / 60;
    /** What the page adds to them. @type {Quantity[]} */
    this.operation = [
      {
        name: RATE,
        symbol: "N",
        group: "operation",
        unit: "rad/s",
        start: rate,
        limits: [1e-3, 100],
        slider: [rate / 3, 2 * rate],
        text: "Planting rate: turns of the cranks a minute, one plant a turn",
      },
      {
        name: SPACING,
        symbol: "S",
        group: "operation",
        unit: "m",
        start: this.model.plantSpacing,
        limits: [0, 10],
        slider: [0, 0.8],
        text: "Plant spacing: how far the machine travels in one turn",
      },
      {
        name: DEPTH,
        symbol: "depth",
        group: "operation",
        unit: "m",
        start: this.published.ridgeDepth,
        limits: [1e-4, 10],
        slider: [0.01, 0.2],
        text: "Planting depth: the ridge's surface above the lowest point of the tip",
      },
      {
        name: LEVEL,
        symbol: "surface",
        group: "operation",
        unit: "m",
        start: 0,
        limits: [-10, 10],
        slider: [-0.6, 0],
        text: "The ridge's surface above O, fixed to the machine",
      },
    ];
    const [from, phased] = [this.#start(FROM), this.#start(PHASED)];
    /** The paper's phase difference: another way to set phi4. @type {Quantity} */
    this.phase = {
      name: PHASE,
      symbol: "θ41",
      group: "geometry",
      unit: "rad",
      start: phased - from,
      limits: [-1e3, 1e3],
      slider: [0, TURN],
      text: "Phase difference of the cranks, phi4 − phi1: moves phi4 (paper, section 4.2)",
    };
    /** @type {Map<string, Quantity>} */
    this.quantities = new Map([...this.parameters, ...this.operation, this.phase].map((q) => [q.name, q]));
  }

  /** @param {string} name */
  #start(name) {
    return Number(this.variables.get(name)?.start);
  }

  /** @param {Variable} v @returns {Quantity} */
  #quantity(v) {
    const start = Number(v.start);
    const unit = v.unit ?? "1";
    const limits = v.range ?? [-1e60, 1e60];
    const reach = Math.max(Math.abs(start) / 2, REACH[unit] ?? 1);
    const [group, symbol = group] = v.name.split(/\.(.*)/, 2);
    return {
      name: v.name,
      group,
      symbol: greek(symbol),
      text: v.text,
      unit,
      start,
      limits,
      slider: [Math.max(start - reach, v.range?.[0] ?? -1e60), Math.min(start + reach, v.range?.[1] ?? 1e60)],
    };
  }

  /** Outputs, and locals where the FMU has them, whose names have this form. @param {(v: Variable) => boolean} wanted */
  computed(wanted) {
    return this.declared.variables.filter((v) => (v.kind === "output" || v.kind === "local") && wanted(v));
  }

  /** @param {string} name */
  reference(name) {
    const found = this.variables.get(name);
    if (!found) throw new Error(`there is no variable ${name}`);
    return found.reference;
  }

  /** The unit that is shown for an SI unit, and what a value is multiplied with. @param {string} unit */
  shown(unit) {
    const [display, factor] = SHOWN[unit] ?? [];
    if (display !== undefined && factor !== undefined) return { display, factor };
    return this.declared.units[unit] ?? { display: unit, factor: 1 };
  }
}

/** phi1 as φ1: the paper's letters. @param {string} symbol */
export function greek(symbol) {
  return symbol.replace("phi", "φ").replace("theta", "θ");
}

/** A number for people: so many digits behind the point, a real minus, no -0. @param {number} value @param {number} digits */
export function number(value, digits) {
  const text = value.toFixed(digits);
  return (/^-0(\.0*)?$/.test(text) ? text.slice(1) : text).replace("-", "−");
}

/** A number for a field: what was typed comes back, 50 mm is not 50.00000000000001. @param {number} value SI @param {number} factor */
export function plain(value, factor) {
  const shown = value * factor;
  const short = Number(shown.toPrecision(12));
  return String(short / factor === value || Math.abs(short - shown) <= 1e-12 * Math.abs(shown) ? short : shown);
}
