// @ts-check
// A design: the values of all quantities, in SI units, and the history of what the user did to it.

import { DEPTH, FROM, LEVEL, PHASE, PHASED, RATE, SPACING, TURN } from "./interface.js";

/** @typedef {import("./interface.js").Catalogue} Catalogue */
/** Values by name, SI. Of the ridge's two ways there is one: ridge.depth or ridge.y. @typedef {Readonly<Record<string, number>>} Design */

/** A value that is not accepted; `message` is for people. */
export class Unacceptable extends Error {}

/** The published design. @param {Catalogue} catalogue @returns {Design} */
export function publishedDesign(catalogue) {
  const quantities = [...catalogue.parameters, ...catalogue.operation].filter((q) => q.name !== LEVEL);
  return Object.freeze(Object.fromEntries(quantities.map((q) => [q.name, q.start])));
}

/**
 * A design with other values. theta41 moves phi4; one of ridge.depth and ridge.y takes the other's place.
 * @param {Catalogue} catalogue @param {Design} design @param {Record<string, number>} values SI
 * @returns {Design}
 */
export function changed(catalogue, design, values) {
  /** @type {Record<string, number>} */
  const next = { ...design };
  for (const [name, value] of Object.entries(values)) {
    const quantity = catalogue.quantities.get(name);
    if (!quantity) throw new Unacceptable(`${name}: there is no such quantity`);
    if (typeof value !== "number" || !Number.isFinite(value)) throw new Unacceptable(`${name}: ${value} is no number`);
    const [least, greatest] = quantity.limits;
    if (value < least || value > greatest) {
      const { display, factor } = catalogue.shown(quantity.unit);
      throw new Unacceptable(
        `${quantity.symbol} = ${value * factor} ${display}: it must be from ${least * factor} to ${greatest * factor}`,
      );
    }
    if (name === DEPTH) delete next[LEVEL];
    if (name === LEVEL) delete next[DEPTH];
    if (name !== PHASE) next[name] = value;
  }
  if (PHASE in values) next[PHASED] = next[FROM] + values[PHASE];
  return Object.freeze(next);
}

/** Speed of the machine in m/s that gives the spacing. @param {Design} design */
export function machineSpeed(design) {
  return (design[SPACING] * design[RATE]) / TURN;
}

/** The value of a quantity in a design, theta41 too. @param {Design} design @param {string} name */
export function quantityOf(design, name) {
  return name === PHASE ? design[PHASED] - design[FROM] : design[name];
}

/** What differs from the published design. @param {Catalogue} catalogue @param {Design} design */
export function differences(catalogue, design) {
  const published = publishedDesign(catalogue);
  return Object.fromEntries(Object.entries(design).filter(([name, value]) => published[name] !== value));
}

/** @param {Design} one @param {Design} other */
export function same(one, other) {
  const names = Object.keys(one);
  return names.length === Object.keys(other).length && names.every((name) => one[name] === other[name]);
}

/** What was, what is, and what was undone. */
export class History {
  /** @type {Design[]} */
  past = [];
  /** @type {Design[]} */
  future = [];

  /** @param {Design} design */
  constructor(design) {
    this.present = design;
  }

  /** Go on to another design; what was undone is gone. @param {Design} design */
  push(design) {
    if (same(design, this.present)) return;
    this.past.push(this.present);
    this.present = design;
    this.future = [];
  }

  /** @returns {boolean} whether there was something to undo */
  undo() {
    const before = this.past.pop();
    if (before) {
      this.future.push(this.present);
      this.present = before;
    }
    return before !== undefined;
  }

  /** @returns {boolean} whether there was something to do again */
  redo() {
    const after = this.future.pop();
    if (after) {
      this.past.push(this.present);
      this.present = after;
    }
    return after !== undefined;
  }
}
