// @ts-check
// The tab for the simulation engineer.

import { Coupling, DURATION, RUNGS, STEPS_MS } from "./coupling.js";
import { byId, html, line, put, say, svg } from "./dom.js";
import { number, RATE, TURN } from "./interface.js";

/** @typedef {import("./fmi.js").Fmu} Fmu */
/** @typedef {import("./interface.js").Catalogue} Catalogue */
/** @typedef {import("./design.js").Design} Design */

const CHART = { width: 640, height: 340, left: 66, right: 12, top: 12, bottom: 40 };
const LEAST = 1e-9; // mm, the bottom of the diagram

/** @typedef {{id: string, title: string, unit: string, min: number, max: number, step: number, value: number, isLog?: boolean}} Setting */

/** @type {Setting[]} */
const SETTINGS = [
  { id: "step", title: "communication step", unit: "ms", min: 0.5, max: 20, step: 0.01, value: 10, isLog: true },
  { id: "share", title: "ripple of the crank's speed", unit: "%", min: 0, max: 50, step: 1, value: 10 },
  { id: "frequency", title: "ripples a second", unit: "Hz", min: 0, max: 10, step: 0.1, value: 3 },
];

/** Draws on the tab, and computes while it is open. */
export class CouplingPage {
  /** @param {Fmu} fmu @param {Catalogue} catalogue */
  constructor(fmu, catalogue) {
    this.coupling = new Coupling(fmu, catalogue);
    this.table = /** @type {HTMLTableElement} */ (byId("coupling-table"));
    this.note = byId("coupling-note");
    this.chart = /** @type {SVGSVGElement} */ (byId("error-over-step"));
    this.stepped = /** @type {SVGSVGElement} */ (byId("stepped"));
    put(this.chart, { viewBox: `0 0 ${CHART.width} ${CHART.height}` });
    /** @type {Record<string, number>} */
    this.values = Object.fromEntries(SETTINGS.map((setting) => [setting.id, setting.value]));
    this.generation = 0;
    /** Worst error in mm by rung and step in ms. @type {Map<string, number>} */
    this.known = new Map();
    /** @type {Design | undefined} */
    this.design = undefined;
    const panel = byId("coupling-controls");
    for (const setting of SETTINGS) panel.append(this.#row(setting));
  }

  /** @param {Setting} setting */
  #row(setting) {
    const id = `coupling-${setting.id}`;
    const place = (/** @type {number} */ value) => (setting.isLog ? Math.log10(value) : value);
    const slider = html("input", {
      type: "range",
      min: place(setting.min),
      max: place(setting.max),
      step: "any",
      value: place(setting.value),
      "aria-label": setting.title,
    });
    const field = html("input", {
      type: "number",
      id,
      min: setting.min,
      max: setting.max,
      step: "any",
      value: setting.value,
    });
    const take = (/** @type {number} */ value) => {
      if (!Number.isFinite(value)) return;
      const rounded = Math.round(Math.min(Math.max(value, setting.min), setting.max) / setting.step) * setting.step;
      this.values[setting.id] = Number(rounded.toPrecision(6));
      slider.value = String(place(this.values[setting.id]));
      field.value = String(this.values[setting.id]);
      put(slider, { "aria-valuetext": `${this.values[setting.id]} ${setting.unit}` });
      this.show(this.design);
    };
    slider.addEventListener("input", () => take(setting.isLog ? 10 ** Number(slider.value) : Number(slider.value)));
    field.addEventListener("change", () => take(Number(field.value)));
    return html(
      "p",
      { class: "setting" },
      html("label", { for: id }, setting.title),
      " ",
      slider,
      " ",
      field,
      ` ${setting.unit}`,
    );
  }

  /** @param {Design | undefined} design one that closes */
  show(design) {
    if (!design) return;
    this.design = design;
    this.generation += 1;
    this.known.clear();
    this.#path(design);
    this.#errors(design, this.generation);
  }

  /** @param {Design} design */
  #ripple(design) {
    return { rate: design[RATE], share: this.values.share / 100, frequency: this.values.frequency };
  }

  /** Worst errors of all rungs at one step. @param {Design} design @param {number} stepMs */
  #measure(design, stepMs) {
    const step = stepMs / 1e3;
    const ripple = this.#ripple(design);
    const truth = this.coupling.where(design, ripple, step, Math.round(DURATION / step));
    for (const rung of RUNGS)
      this.known.set(`${rung.key} ${stepMs}`, this.coupling.run(design, ripple, rung, step, truth).worst * 1e3);
  }

  /** The chosen step at once, the others one by one while nothing else is wanted. @param {Design} design @param {number} generation */
  async #errors(design, generation) {
    const chosen = this.values.step;
    for (const stepMs of [chosen, ...[...STEPS_MS].reverse().filter((each) => each !== chosen)]) {
      this.#measure(design, stepMs);
      this.#table();
      this.#diagram();
      await new Promise((resolve) => setTimeout(resolve));
      if (generation !== this.generation) return;
    }
    this.chart.dataset.done = String(generation);
  }

  /** The tip after each step of the second turn: truth, held angle, best prediction. @param {Design} design */
  #path(design) {
    const step = this.values.step / 1e3;
    const ripple = this.#ripple(design);
    const turns = Math.ceil((2.1 * TURN) / ripple.rate / step);
    const truth = this.coupling.where(design, ripple, step, turns);
    const fine = this.coupling.where({ ...design }, { ...ripple, share: 0 }, TURN / ripple.rate / 360, 361);
    const first = Math.floor(TURN / ripple.rate / step);
    const apart = Math.max(3, Math.round(0.03 / step)); // steps: the held angle's place is that of a step before
    const mm = (/** @type {Float64Array} */ values, /** @type {number} */ sign) =>
      values.map((value) => sign * value * 1e3);
    const box = [
      Math.min(...mm(fine.x, 1)) - 30,
      Math.min(...mm(fine.y, -1)) - 30,
      Math.max(...mm(fine.x, 1)) + 30,
      Math.max(...mm(fine.y, -1)) + 30,
    ];
    put(this.stepped, { viewBox: `${box[0]} ${box[1]} ${box[2] - box[0]} ${box[3] - box[1]}` });
    const marks = RUNGS.flatMap((rung, index) => {
      if (!["held", "angle"].includes(rung.key)) return [];
      const run = this.coupling.run(design, ripple, rung, step, truth);
      const group = svg("g", { class: `rung${index}` }, svg("title", {}, rung.title));
      for (let k = first; k < turns; k += apart) {
        const [x, y, tx, ty] = [run.x[k], run.y[k], truth.x[k], truth.y[k]].map((value) => value * 1e3);
        group.append(svg("path", { d: line([x, tx], [-y, -ty]), "stroke-width": 0.8 }));
        group.append(svg("circle", { cx: x.toFixed(2), cy: (-y).toFixed(2), r: 2.2 }));
      }
      return [group];
    });
    const places = svg("g", {}, svg("title", {}, "where the tip truly is"));
    for (let k = first; k < turns; k += apart)
      places.append(
        svg("circle", {
          class: "truth",
          cx: (truth.x[k] * 1e3).toFixed(2),
          cy: (-truth.y[k] * 1e3).toFixed(2),
          r: 3.6,
        }),
      );
    this.stepped.replaceChildren(
      svg("path", { class: "truth", d: line(mm(fine.x, 1), mm(fine.y, -1)) }),
      ...marks,
      places,
    );
    say(
      this.note,
      "Circles: where the tip truly is after some of the steps; dots: where the FMU puts it, red with the inputs held, violet predicted from the angle alone. A line joins those of one instant. Worst errors are over 12 s, after five steps.",
    );
  }

  #table() {
    const chosen = this.values.step;
    this.table.tHead?.replaceChildren(
      html(
        "tr",
        {},
        html("th", { scope: "col" }, "what the master gives"),
        html("th", { scope: "col" }, `worst error at ${chosen} ms`),
      ),
    );
    this.table.tBodies[0].replaceChildren(
      ...RUNGS.map((rung, index) => {
        const worst = this.known.get(`${rung.key} ${chosen}`);
        const swatch = svg(
          "svg",
          { class: `swatch rung${index}`, viewBox: "0 0 12 4", "aria-hidden": "true" },
          svg("rect", { width: 12, height: 4 }),
        );
        return html(
          "tr",
          {},
          html("th", { scope: "row" }, swatch, rung.title),
          html("td", { "data-rung": rung.key, "data-value": worst }, worst === undefined ? "…" : millimetres(worst)),
        );
      }),
    );
  }

  #diagram() {
    const { width, height, left, right, top, bottom } = CHART;
    const [low, high] = [-9, 3];
    const [first, last] = [STEPS_MS[0], STEPS_MS[STEPS_MS.length - 1]];
    const x = (/** @type {number} */ ms) =>
      left + (Math.log(ms / first) / Math.log(last / first)) * (width - left - right);
    const y = (/** @type {number} */ mm) =>
      top + ((high - Math.log10(Math.max(mm, LEAST))) / (high - low)) * (height - top - bottom);
    const grid = svg("g", { class: "grid" });
    for (let power = low; power <= high; power += 2)
      grid.append(
        svg("path", { d: `M${left} ${y(10 ** power)}H${width - right}` }),
        svg(
          "text",
          { x: left - 5, y: y(10 ** power), dy: "0.35em", "text-anchor": "end" },
          power >= -3 ? `${10 ** power} mm` : `1e${power}`,
        ),
      );
    for (const ms of STEPS_MS)
      grid.append(
        svg("path", { d: `M${x(ms)} ${top}V${height - bottom}` }),
        svg("text", { x: x(ms), y: height - bottom + 15, "text-anchor": "middle" }, String(ms)),
      );
    grid.append(
      svg("text", { x: (left + width - right) / 2, y: height - 6, "text-anchor": "middle" }, "communication step, ms"),
    );
    const steps = [...new Set([...STEPS_MS, this.values.step])].sort((a, b) => a - b);
    const curves = RUNGS.map((rung, index) => {
      const points = steps.filter((ms) => this.known.has(`${rung.key} ${ms}`));
      const errors = points.map((ms) => this.known.get(`${rung.key} ${ms}`) ?? 0);
      return svg(
        "g",
        { class: `rung rung${index}` },
        svg("title", {}, rung.title),
        svg("path", { d: line(points.map(x), errors.map(y)) }),
        ...points.map((ms, k) => svg("circle", { cx: x(ms), cy: y(errors[k]), r: ms === this.values.step ? 5 : 2.5 })),
      );
    });
    const cursor = svg("path", { class: "cursor", d: `M${x(this.values.step)} ${top}V${height - bottom}` });
    this.chart.replaceChildren(grid, cursor, ...curves);
  }
}

/** @param {number} mm */
function millimetres(mm) {
  if (mm === 0) return "0 mm";
  if (mm >= 0.01) return `${number(mm, mm >= 10 ? 1 : mm >= 1 ? 2 : 3)} mm`;
  return `${mm.toExponential(1).replace("-", "−")} mm`;
}
