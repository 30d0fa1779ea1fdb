// @ts-check
// Curves over one turn, with a cursor at the crank's angle.

import { line, put, svg, ticks } from "./dom.js";
import { number, TURN } from "./interface.js";

/** @typedef {{name: string, style: string, values: ArrayLike<number>}} Curve */

const [WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM] = [640, 176, 46, 12, 22, 26];

const APART = 3; // samples between the points that are drawn: a degree and a half

/** One diagram over 0 to 360 degrees. */
export class Diagram {
  /** @param {SVGSVGElement} root @param {string} title with its unit */
  constructor(root, title) {
    this.root = put(root, { viewBox: `0 0 ${WIDTH} ${HEIGHT}` });
    this.frame = svg("g", { class: "grid" });
    this.curves = svg("g", { class: "curves" });
    this.legend = svg("g", { class: "legend" });
    this.cursor = svg("path", { class: "cursor" });
    this.readings = svg("g", { class: "readings" });
    this.root.append(
      svg("text", { x: LEFT, y: 12, class: "heading" }, title),
      this.frame,
      this.curves,
      this.legend,
      this.cursor,
      this.readings,
    );
    /** @type {Curve[]} */
    this.shown = [];
    this.low = Number.NaN;
    this.high = Number.NaN;
  }

  /** @param {number} degrees */
  x(degrees) {
    return LEFT + (degrees / 360) * (WIDTH - LEFT - RIGHT);
  }

  /** @param {number} value */
  y(value) {
    return TOP + ((this.high - value) / (this.high - this.low)) * (HEIGHT - TOP - BOTTOM);
  }

  /** Curves with names first; those of variants after them. @param {Curve[]} curves @param {Curve[]} variants */
  draw(curves, variants) {
    this.shown = curves;
    let [low, high] = [0, 0];
    for (const { values } of [...curves, ...variants])
      for (let k = 0; k < values.length; k += 1) [low, high] = [Math.min(low, values[k]), Math.max(high, values[k])];
    if (low === high) high = low + 1;
    const marks = ticks(low, high, 4);
    const step = marks[1] - marks[0] || 1;
    const [bottom, top] = [Math.floor(low / step - 1e-9) * step, Math.ceil(high / step - 1e-9) * step];
    if (bottom !== this.low || top !== this.high) this.#scale(bottom, top, step);
    this.curves.replaceChildren(...[...variants, ...curves].map((curve) => this.curve(curve)));
    let x = WIDTH - RIGHT;
    this.legend.replaceChildren();
    for (const { name, style } of [...curves].reverse()) {
      x -= 12 + 7 * name.length + 18;
      this.legend.append(
        svg("path", { class: `curve ${style}`, d: `M${x} 8H${x + 16}` }),
        svg("text", { x: x + 20, y: 12 }, name),
      );
    }
  }

  /** @param {number} low @param {number} high @param {number} step */
  #scale(low, high, step) {
    this.low = low;
    this.high = high;
    this.frame.replaceChildren();
    for (const value of ticks(this.low, this.high, 4)) {
      const y = this.y(value).toFixed(1);
      this.frame.append(
        svg("path", { d: `M${LEFT} ${y}H${WIDTH - RIGHT}`, class: Math.abs(value) < step / 9 ? "axis" : undefined }),
        svg(
          "text",
          { x: LEFT - 5, y, dy: "0.35em", "text-anchor": "end" },
          number(value, Math.max(0, -Math.floor(Math.log10(step) + 1e-9))),
        ),
      );
    }
    for (let degrees = 0; degrees <= 360; degrees += 60) {
      const x = this.x(degrees).toFixed(1);
      this.frame.append(
        svg("path", { d: `M${x} ${TOP}V${HEIGHT - BOTTOM}` }),
        svg("text", { x, y: HEIGHT - BOTTOM + 14, "text-anchor": degrees === 360 ? "end" : "middle" }, `${degrees}°`),
      );
    }
  }

  /** @param {Curve} curve */
  curve({ name, style, values }) {
    const last = values.length - 1;
    const count = Math.floor(last / APART) + 1;
    const xs = new Float64Array(count);
    const ys = new Float64Array(count);
    for (let k = 0; k < count; k += 1) [xs[k], ys[k]] = [this.x((360 * k * APART) / last), this.y(values[k * APART])];
    return svg("path", { class: `curve ${style}`, d: line(xs, ys) }, svg("title", {}, name));
  }

  /** @param {number} phi rad */
  pose(phi) {
    const share = (((phi / TURN) % 1) + 1) % 1;
    const x = this.x(360 * share);
    put(this.cursor, { d: `M${x.toFixed(1)} ${TOP}V${HEIGHT - BOTTOM}` });
    this.readings.replaceChildren(
      ...this.shown.map(({ style, values }) => {
        const value = values[Math.round(share * (values.length - 1))];
        return svg("circle", { class: `dot ${style}`, cx: x.toFixed(1), cy: this.y(value).toFixed(1), r: 3.5 });
      }),
    );
  }

  /** The angle under the pointer. @param {PointerEvent} event */
  angleAt(event) {
    const box = this.root.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * WIDTH;
    return Math.min(Math.max((x - LEFT) / (WIDTH - LEFT - RIGHT), 0), 1) * TURN;
  }
}
