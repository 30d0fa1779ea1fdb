// @ts-check
// Curves over one turn, with a cursor at the crank's angle.

import { children, multiples, put, roundStep, say, svg } from "./dom.js";
import { number, TURN } from "./interface.js";

/** @typedef {{name: string, style: string, values: ArrayLike<number>}} Curve */

const [LEFT, RIGHT, TOP, BOTTOM] = [46, 12, 34, 22];
const [LEAST_WIDTH, HEIGHT, TALL] = [260, 0.36, [150, 240]]; // pixels; height of the width, within limits
const READING = 74; // pixels that a curve's name and value take
const APART = 3; // samples between the points that are drawn: a degree and a half

/** One diagram over 0 to 360 degrees, in pixels of the window. */
export class Diagram {
  /** @param {SVGSVGElement} root @param {string} title with its unit */
  constructor(root, title) {
    this.root = root;
    this.frame = svg("g", { class: "grid" });
    this.postures = svg("g", { class: "postures" });
    this.curves = svg("g", { class: "curves" });
    this.legend = svg("g", { class: "legend" });
    this.cursor = svg("path", { class: "cursor" });
    this.readings = svg("g", { class: "readings" });
    this.root.append(
      svg("text", { x: 4, y: 12, class: "heading" }, title),
      this.frame,
      this.postures,
      this.curves,
      this.legend,
      this.cursor,
      this.readings,
    );
    /** @type {Curve[]} */
    this.shown = [];
    /** @type {number[]} */
    this.angles = [];
    this.digits = 0;
    this.low = Number.NaN;
    this.high = Number.NaN;
    /** Where the points that are drawn lie to the right, as text. @type {string[]} */
    this.across = [];
    this.width = 0;
    this.height = 0;
    this.resize(root.clientWidth);
  }

  /** The window has another size. @param {number} width pixels @returns {boolean} whether all is to be drawn anew */
  resize(width) {
    const next = Math.max(Math.round(width) || 640, LEAST_WIDTH);
    if (next === this.width) return false;
    this.width = next;
    this.height = Math.round(Math.min(Math.max(next * HEIGHT, TALL[0]), TALL[1]));
    put(this.root, { viewBox: `0 0 ${this.width} ${this.height}` });
    this.low = Number.NaN;
    this.across = [];
    return true;
  }

  /** @param {number} degrees */
  x(degrees) {
    return LEFT + (degrees / 360) * (this.width - LEFT - RIGHT);
  }

  /** @param {number} value */
  y(value) {
    return TOP + ((this.high - value) / (this.high - this.low)) * (this.height - TOP - BOTTOM);
  }

  /**
   * Curves with names first; those of variants after them; marks at chosen angles.
   * @param {Curve[]} curves @param {Curve[]} variants @param {number[]} angles rad
   */
  draw(curves, variants, angles) {
    this.shown = curves;
    let [low, high] = [0, 0];
    for (const { values } of [...curves, ...variants])
      for (let k = 0; k < values.length; k += 1) {
        if (values[k] < low) low = values[k];
        if (values[k] > high) high = values[k];
      }
    if (low === high) high = low + 1;
    const step = roundStep(low, high, 4);
    const [bottom, top] = [Math.floor(low / step + 1e-9) * step, Math.ceil(high / step - 1e-9) * step];
    if (bottom !== this.low || top !== this.high || angles !== this.angles) this.#scale(bottom, top, step, angles);
    const all = [...variants, ...curves];
    const paths = children(this.curves, all.length, () => svg("path", {}, svg("title")));
    for (const [k, { name, style, values }] of all.entries()) {
      put(paths[k], { class: `curve ${style}`, d: this.#path(values) });
      if (paths[k].firstElementChild) say(paths[k].firstElementChild, name);
    }
    const rows = children(this.legend, curves.length, () => svg("g", {}, svg("path"), svg("text")));
    for (const [k, { style }] of curves.entries()) {
      const x = LEFT + k * READING;
      put(rows[k].children[0], { class: `curve ${style}`, d: `M${x} 22H${x + 12}` });
      put(rows[k].children[1], { x: x + 16, y: 26 });
    }
  }

  /** @param {number} low @param {number} high @param {number} step @param {number[]} angles rad */
  #scale(low, high, step, angles) {
    this.low = low;
    this.high = high;
    this.angles = angles;
    const floor = this.height - BOTTOM;
    const right = this.width - RIGHT;
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    this.digits = digits + 2;
    this.frame.replaceChildren();
    for (const value of multiples(this.low, this.high, step)) {
      const y = this.y(value).toFixed(1);
      this.frame.append(
        svg("path", { d: `M${LEFT} ${y}H${right}`, class: Math.abs(value) < step / 9 ? "axis" : undefined }),
        svg("text", { x: LEFT - 5, y, dy: "0.35em", "text-anchor": "end" }, number(value, digits)),
      );
    }
    const apart = this.width < 400 ? 90 : 60;
    for (let degrees = 0; degrees <= 360; degrees += apart) {
      const x = this.x(degrees).toFixed(1);
      this.frame.append(
        svg("path", { d: `M${x} ${TOP}V${floor}` }),
        svg("text", { x, y: floor + 14, "text-anchor": degrees === 360 ? "end" : "middle" }, `${degrees}°`),
      );
    }
    this.postures.replaceChildren(
      ...angles.map((phi) => {
        const degrees = (((((phi * 360) / TURN) % 360) + 360) % 360).toFixed(1);
        const x = this.x(Number(degrees)).toFixed(1);
        return svg(
          "path",
          { d: `M${x} ${TOP}V${floor}` },
          svg("title", {}, `nozzle drawn at ${number(Number(degrees), 0)}°`),
        );
      }),
    );
  }

  /** Path data of one curve. @param {ArrayLike<number>} values */
  #path(values) {
    const last = values.length - 1;
    const count = Math.floor(last / APART) + 1;
    if (this.across.length !== count)
      this.across = Array.from(
        { length: count },
        (_, k) => `${Math.round(this.x((360 * k * APART) / last) * 10) / 10} `,
      );
    const scale = (this.height - TOP - BOTTOM) / (this.high - this.low);
    const zero = TOP + this.high * scale;
    const points = new Array(count);
    for (let k = 0; k < count; k += 1)
      points[k] = this.across[k] + Math.round((zero - values[k * APART] * scale) * 100) / 100;
    return `M${points.join("L")}`;
  }

  /** @param {number} phi rad */
  pose(phi) {
    const share = (((phi / TURN) % 1) + 1) % 1;
    const x = this.x(360 * share).toFixed(1);
    put(this.cursor, { d: `M${x} ${TOP}V${this.height - BOTTOM}` });
    const dots = children(this.readings, this.shown.length, () => svg("circle", { r: 3.5 }));
    for (const [k, { name, style, values }] of this.shown.entries()) {
      const value = values[Math.round(share * (values.length - 1))];
      put(dots[k], { class: `dot ${style}`, cx: x, cy: this.y(value).toFixed(1) });
      say(this.legend.children[k].children[1], `${name} ${number(value, this.digits)}`);
    }
  }

  /** The angle under the pointer. @param {PointerEvent} event */
  angleAt(event) {
    const box = this.root.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * this.width;
    return Math.min(Math.max((x - LEFT) / (this.width - LEFT - RIGHT), 0), 1) * TURN;
  }
}
