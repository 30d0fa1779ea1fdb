// @ts-check
// A row for each quantity: slider, number, unit, and the derivative of the chosen figure.

import { publishedDesign, quantityOf } from "./design.js";
import { html, put, say } from "./dom.js";
import { LEVEL, number, PHASE, PHASED, plain } from "./interface.js";

/** @typedef {import("./interface.js").Catalogue} Catalogue */
/** @typedef {import("./interface.js").Quantity} Quantity */
/** @typedef {import("./design.js").Design} Design */
/** @typedef {import("./figures.js").Figure} Figure */
/** @typedef {import("./figures.js").Kind} Kind */
/** @typedef {{quantity: Quantity, row: HTMLElement, slider: HTMLInputElement, field: HTMLInputElement, slope: HTMLElement, factor: number, display: string, value: number | undefined}} Row
 * value: what the row shows, SI; NaN where that is not known */

const GROUPS = {
  geometry: "Lengths, pivots and angles",
  operation: "Planting",
  body: "Mass of the links",
  gravity: "Weight",
};

/** The panel of all rows. Those of a group that is closed are made when it is opened. */
export class Controls {
  /** @param {HTMLElement} panel @param {Catalogue} catalogue */
  constructor(panel, catalogue) {
    this.catalogue = catalogue;
    /** Values in SI units; done: the slider was let go, or a number typed. @type {(values: Record<string, number>, done: boolean) => void} */
    this.change = () => {};
    /** @type {(text: string) => void} */
    this.complain = () => {};
    /** A group was opened, whose rows show nothing yet. */
    this.opened = () => {};
    this.published = publishedDesign(catalogue);
    this.held = html("input", { type: "checkbox", id: "surface-held" });
    /** @type {Map<string, Row>} */
    this.rows = new Map();
    const order = [...catalogue.parameters];
    order.splice(order.findIndex((q) => q.name === PHASED) + 1, 0, catalogue.phase);
    const all = [...catalogue.operation, ...order];
    for (const name of new Set(all.map((q) => q.group))) {
      const title = /** @type {Record<string, string>} */ (GROUPS)[name] ?? name;
      const isOpen = name === "geometry" || name === "operation";
      const group = html("details", { class: "group", open: isOpen }, html("summary", {}, title));
      const fill = () =>
        group.append(...this.#before(name), ...all.filter((q) => q.group === name).map((q) => this.#row(q)));
      if (isOpen) fill();
      else {
        const first = () => {
          fill();
          this.opened();
        };
        group.addEventListener("toggle", first, { once: true });
      }
      panel.append(group);
    }
    this.rows.get(LEVEL)?.row.after(
      html(
        "label",
        {
          class: "quiet held",
          title: "Else the surface stays at its depth over the lowest point, whatever the design",
        },
        this.held,
        html("span", {}, "keep the ridge's surface where it is in the machine"),
      ),
    );
  }

  /** What stands before the rows of a group. @param {string} group @returns {HTMLElement[]} */
  #before(group) {
    const { notes } = this.catalogue.published;
    const found = notes[group] ? [html("p", { class: "quiet" }, notes[group])] : [];
    if (group === "body") {
      const { text, values } = this.catalogue.declared.masses;
      const use = html("button", { type: "button", id: "masses", title: text }, "Fill in an example");
      use.addEventListener("click", () => this.change(values, true));
      found.push(html("p", {}, use));
    }
    return found;
  }

  /** @param {Quantity} quantity */
  #row(quantity) {
    const { display, factor } = this.catalogue.shown(quantity.unit);
    const id = `value-${quantity.name}`;
    const described = `${quantity.text}${display ? `, in ${display}` : ""}`;
    const slider = html("input", {
      type: "range",
      "aria-label": `${quantity.symbol}, ${described}`,
      "data-slider": quantity.name,
    });
    const field = html("input", {
      type: "text",
      inputmode: "decimal",
      id,
      autocomplete: "off",
      title: described,
      "data-field": quantity.name,
    });
    const slope = html("span", { class: "slope", "data-slope": quantity.name });
    const row = html(
      "div",
      { class: "control", "data-control": quantity.name },
      html("label", { for: id, title: described }, quantity.symbol),
      slider,
      field,
      html("span", { class: "unit" }, display),
      slope,
    );
    /** @type {Row} */
    const made = { quantity, row, slider, field, slope, factor, display, value: Number.NaN };
    this.rows.set(quantity.name, made);
    slider.step = "any";
    slider.addEventListener("input", () => this.#slid(made, false));
    slider.addEventListener("change", () => this.#slid(made, true));
    slider.addEventListener("keydown", (event) => this.#key(made, event));
    slider.addEventListener("dblclick", () => this.change({ [quantity.name]: quantity.start }, true));
    field.addEventListener("change", () => this.#typed(made));
    return row;
  }

  /** Sliders give a tenth of what is shown; the last digits are for numbers. @param {Row} row @param {boolean} done */
  #slid(row, done) {
    row.value = Number.NaN;
    const shown = Math.round(Number(row.slider.value) * 10 * finer(row)) / (10 * finer(row));
    this.change({ [row.quantity.name]: shown / row.factor }, done);
  }

  /** Arrows: one mm, degree, …; with Shift a tenth; Home and End as sliders have them. @param {Row} row @param {KeyboardEvent} event */
  #key(row, event) {
    const sign = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (sign === undefined) return;
    event.preventDefault();
    row.value = Number.NaN;
    const step = (sign * (event.shiftKey ? 0.1 : 1)) / finer(row);
    const shown = Math.round((Number(row.slider.value) + step) * 100 * finer(row)) / (100 * finer(row));
    // At once, for a key that comes before the next picture.
    put(row.slider, { min: Math.min(Number(row.slider.min), shown), max: Math.max(Number(row.slider.max), shown) });
    row.slider.value = String(shown);
    this.change({ [row.quantity.name]: shown / row.factor }, true);
  }

  /** @param {Row} row */
  #typed(row) {
    const text = row.field.value.trim().replace(",", ".").replace("−", "-");
    const value = text === "" ? Number.NaN : Number(text);
    const isNumber = Number.isFinite(value);
    row.value = Number.NaN; // what the field shows may be refused
    put(row.field, { "aria-invalid": isNumber ? undefined : "true" });
    if (isNumber) this.change({ [row.quantity.name]: value / row.factor }, true);
    else this.complain(`${row.quantity.symbol}: "${row.field.value}" is no number`);
  }

  /** Show a design. @param {Design} design */
  design(design) {
    this.held.checked = LEVEL in design;
    for (const [name, row] of this.rows) {
      const value = quantityOf(design, name);
      if (value === row.value) continue;
      row.value = value;
      row.row.hidden = value === undefined;
      if (value === undefined) continue;
      const shown = value * row.factor;
      const [low, high] = row.quantity.slider.map((limit) => limit * row.factor);
      put(row.slider, { min: Math.min(low, shown), max: Math.max(high, shown) });
      if (row.slider.value !== String(shown)) row.slider.value = String(shown);
      put(row.slider, { "aria-valuetext": `${number(shown, 2)} ${row.display}` });
      if (document.activeElement !== row.field || row.field.getAttribute("aria-invalid") !== "true")
        row.field.value = plain(value, row.factor);
      const start = name === PHASE ? this.catalogue.phase.start : this.published[name];
      row.row.classList.toggle("changed", start !== undefined && Math.abs(value - start) > 1e-12 * Math.abs(start));
    }
  }

  /**
   * Show how a figure changes with each quantity, and which way helps.
   * @param {Kind} kind @param {Figure | undefined} figure @param {number} aim 1: larger, -1: smaller, 0: nearer to 0
   */
  slopes(kind, figure, aim) {
    const better = aim === 0 ? -Math.sign(figure?.value ?? 0) : aim;
    for (const [name, row] of this.rows) {
      const by = figure?.by[name === PHASE ? PHASED : name];
      const isKnown = by !== undefined && Number.isFinite(by) && Number.isFinite(figure?.value ?? Number.NaN);
      const slope = isKnown ? (by * kind.factor) / row.factor : 0;
      const unit = row.display
        ? `${kind.display || "1"}/${row.display === "turns/min" ? "rpm" : row.display}`
        : kind.display;
      say(row.slope, isKnown ? `${slope < 0 ? "" : "+"}${significant(slope)}` : "–");
      const sign = isKnown && Math.abs(slope) > 1e-12 ? Math.sign(slope * better) : 0;
      row.slope.classList.toggle("helps-more", sign > 0);
      row.slope.classList.toggle("helps-less", sign < 0);
      const words = sign > 0 ? "more helps" : sign < 0 ? "less helps" : "no influence";
      put(row.slope, {
        title: isKnown ? `${kind.title}: ${slope} ${unit}; ${words}` : "",
        "data-value": isKnown ? by : undefined,
      });
      put(row.field, {
        "aria-description": isKnown ? `${kind.title} changes by ${significant(slope)} ${unit}; ${words}` : undefined,
      });
    }
  }
}

/** Where one of the shown unit is much: kilograms, kg·m². @param {Row} row */
function finer(row) {
  const width = (row.quantity.slider[1] - row.quantity.slider[0]) * row.factor;
  return 10 ** Math.max(0, Math.ceil(Math.log10(20 / width)));
}

/** Three digits that count. @param {number} value */
export function significant(value) {
  if (Math.abs(value) < 5e-5) return number(0, 3);
  return number(value, Math.max(0, Math.min(4, 2 - Math.floor(Math.log10(Math.abs(value))))));
}
