// @ts-check
// The page: what the user does, and what is drawn of it.

import { Controls } from "./controls.js";
import { CouplingPage } from "./coupling_page.js";
import { Diagram } from "./curves.js";
import { changed, History, machineSpeed, publishedDesign, quantityOf, same, Unacceptable } from "./design.js";
import { byId, children, html, put, say, svg } from "./dom.js";
import { fromFragment, open, toCsv, toDxf, toFragment, toJson, toSsv, toSvg } from "./exchange.js";
import { figures, KINDS, ridgeSurface } from "./figures.js";
import { Fmu, Refusal } from "./fmi.js";
import { Catalogue, DEPTH, LEVEL, number, RATE, TURN } from "./interface.js";
import { Model, worst } from "./model.js";
import { describe, GroundView, MachineView } from "./views.js";

/** @typedef {import("./design.js").Design} Design */
/** @typedef {import("./model.js").Turn} Turn */
/** @typedef {import("./model.js").Gap} Gap */
/** @typedef {import("./model.js").Point} Point */
/** @typedef {import("./figures.js").Figure} Figure */
/** A design with all that was computed of it. @typedef {{design: Design, turn: Turn, figures: Record<string, Figure>}} Solved */
/** @typedef {Solved & {name: string, style: string, visible: boolean, ofFamily: boolean}} Variant */

const STYLES = 6;
const COARSE = 180; // samples of a turn where only closing is asked
const PRESET_NONE = "";
const REST = 120; // ms without a move, after which a slider that is held is taken to rest
const DIAGRAMS = /** @type {const} */ ({
  speed: "speed of the tip, m/s",
  acceleration: "acceleration of the tip, m/s²",
  torque: "torque of the drive, N·m",
  inertia: "reflected inertia, kg·m²",
});

class Explorer {
  /** @param {Fmu} fmu @param {Catalogue} catalogue @param {Parts} parts */
  constructor(fmu, catalogue, parts) {
    this.fmu = fmu;
    this.catalogue = catalogue;
    this.model = new Model(fmu, catalogue);
    this.published = this.solve(publishedDesign(catalogue));
    this.history = new History(this.published.design);
    /** What is drawn: the last design that closes. */
    this.shown = this.published;
    /** What is wrong with the present design. @type {string} */
    this.problem = "";
    /** @type {Variant[]} */
    this.variants = [];
    this.phi = 0;
    this.postures = catalogue.published.postures.map((angle) => (angle * TURN) / 360);
    this.isStale = false;
    this.isScheduled = false;
    this.started = 0;
    /** The design before a slider moved. @type {Design | undefined} */
    this.sliding = undefined;
    this.goal = KINDS[0];
    /** What the drawings show; they are drawn anew where any of it is another. @type {unknown[]} */
    this.drawn = [];
    /** What the table of variants shows. @type {unknown[]} */
    this.listed = [];
    this.resting = 0;
    this.controls = parts.controls;
    this.controls.change = (values, done) => this.#change(values, done);
    this.controls.complain = (text) => this.say(text);
    this.controls.opened = () => {
      this.controls.design(this.history.present);
      this.#rest();
    };
    this.machine = parts.machine;
    this.ground = parts.ground;
    this.diagrams = parts.diagrams;
    /** The second page, once it is open. @type {CouplingPage | undefined} */
    this.coupling = undefined;
    for (const kind of KINDS) byId("goal").append(html("option", { value: kind.key }, headed(kind)));
    this.#buildPresets();
    this.#listen();
    say(byId("printed"), catalogue.published.notes.figures);
    byId("manual").hidden = !location.pathname.includes("/documentation/");
    this.#listenToCrank();
    /** @type {HTMLInputElement} */ (byId("postures")).value = this.catalogue.published.postures.join(", ");
  }

  #buildPresets() {
    const preset = byId("preset");
    preset.append(html("option", { value: PRESET_NONE }, "choose …"));
    for (const family of this.catalogue.published.families) {
      const symbol = this.catalogue.quantities.get(family.name)?.symbol ?? family.name;
      preset.append(html("option", { value: family.name }, `${family.figure}: ${symbol}, ${family.title}`));
    }
    preset.append(html("option", { value: "published" }, "7 and 8: the published design"));
  }

  // ---- computing -----------------------------------------------------------------------------

  /** Everything of a design; throws Unacceptable with where and by how much it does not close. @param {Design} design @returns {Solved} */
  solve(design) {
    this.model.take(design);
    const turn = this.model.turn();
    if (turn.gaps.length > 0) throw new Unacceptable(gapText(turn));
    return { design, turn, figures: figures(this.model, design, turn) };
  }

  /** Whether a whole turn can be made. @param {Design} design */
  closes(design) {
    try {
      this.model.take(design);
      return this.model.turn(COARSE).gaps.length === 0;
    } catch (problem) {
      if (problem instanceof Refusal) return false;
      throw problem;
    }
  }

  /** Bring what is drawn up to the present design. */
  refresh() {
    if (!this.isStale) return;
    this.isStale = false;
    const design = this.history.present;
    try {
      this.shown = this.solve(design);
      this.problem = "";
    } catch (problem) {
      if (!(problem instanceof Refusal || problem instanceof Unacceptable)) throw problem;
      this.problem = problem.message;
    }
  }

  /** A design of the straight line from the last that closes to the present one, the farthest that closes. */
  nearest() {
    const [from, to] = [this.shown.design, this.history.present];
    const names = Object.keys(to);
    const between = (/** @type {number} */ share) =>
      Object.freeze(
        Object.fromEntries(names.map((name) => [name, (from[name] ?? to[name]) * (1 - share) + to[name] * share])),
      );
    let [good, bad] = [0, 1];
    for (let k = 0; k < 20; k += 1) {
      const middle = (good + bad) / 2;
      if (this.closes(between(middle))) good = middle;
      else bad = middle;
    }
    return between(Math.max(0, good - 1e-3));
  }

  // ---- changing ------------------------------------------------------------------------------

  /** @param {Design} design */
  go(design) {
    this.history.push(design);
    this.touch();
  }

  /** The present design is another. */
  touch() {
    this.isStale = true;
    this.schedule();
  }

  /** A slider moves: one step of the history, however far it goes. @param {Record<string, number>} values SI @param {boolean} done */
  #change(values, done) {
    try {
      const next = changed(this.catalogue, this.history.present, values);
      if (this.sliding === undefined) {
        const before = this.history.past.length;
        this.history.push(next);
        if (!done && this.history.past.length > before) this.sliding = next;
      } else {
        this.history.present = next;
      }
      if (done) this.sliding = undefined;
      this.say("");
    } catch (problem) {
      if (!(problem instanceof Unacceptable)) throw problem;
      this.say(problem.message);
    }
    this.touch();
  }

  /** Keep a design for comparison. @param {string} name @param {Solved} solved @param {boolean} ofFamily */
  keep(name, solved, ofFamily = false) {
    const used = new Set(this.variants.map((one) => one.style));
    const styles = Array.from({ length: 2 * STYLES }, (_, k) => `v${k % STYLES}${k >= STYLES ? " dashed" : ""}`);
    const style = styles.find((each) => !used.has(each)) ?? styles[this.variants.length % styles.length];
    this.variants.push({ ...solved, name, style, visible: true, ofFamily });
    this.schedule();
  }

  /** A figure of the paper: its curves as variants of the published design. @param {string} name */
  preset(name) {
    if (name === PRESET_NONE) return;
    this.variants = this.variants.filter((one) => !one.ofFamily);
    const published = this.published.design;
    const refused = [];
    const family = this.catalogue.published.families.find((each) => each.name === name);
    const quantity = this.catalogue.quantities.get(name);
    if (family && quantity) {
      const { display, factor } = this.catalogue.shown(quantity.unit);
      for (const value of family.values) {
        const title = `${quantity.symbol} = ${value}${display === "°" ? "" : " "}${display}`;
        try {
          this.keep(title, this.solve(changed(this.catalogue, published, { [name]: value / factor })), true);
        } catch (problem) {
          if (!(problem instanceof Unacceptable)) throw problem;
          refused.push(`${title} makes no whole turn: ${problem.message}`);
        }
      }
    }
    this.go(published);
    say(byId("preset-hint"), refused.join(" "));
  }

  // ---- drawing -------------------------------------------------------------------------------

  get drawings() {
    return [this.machine, this.ground, ...Object.values(this.diagrams)];
  }

  /** Drawings have letters of one size in any window. */
  watchSizes() {
    const observer = new ResizeObserver((entries) => {
      for (const { target, contentRect } of entries)
        if (
          contentRect.width > 0 &&
          this.drawings.find(({ root }) => root === target)?.resize(contentRect.width, contentRect.height)
        )
          this.schedule();
    });
    for (const { root } of this.drawings) observer.observe(root);
  }

  schedule() {
    if (this.isScheduled) return;
    this.isScheduled = true;
    requestAnimationFrame((time) => {
      this.isScheduled = false;
      this.draw(time);
    });
  }

  /** @param {number} time ms */
  draw(time) {
    this.refresh();
    this.#advance(time);
    this.#drawDesign();
    this.#drawPose();
  }

  /** The joints of the last design that closes. @param {number} phi rad */
  places(phi) {
    this.model.take(this.shown.design);
    return this.model.joints(phi);
  }

  #drawDesign() {
    const { shown, variants } = this;
    const key = [
      shown,
      this.problem,
      this.history.present,
      this.history.past.length,
      this.history.future.length,
      this.goal,
      ...variants.flatMap((v) => [v, v.visible, v.name]),
      this.postures,
      ...this.drawings.flatMap(({ width, height }) => [width, height]),
    ];
    if (key.length === this.drawn.length && key.every((part, k) => part === this.drawn[k])) return;
    const isFirst = this.drawn.length === 0;
    this.drawn = key;
    const visible = variants.filter((one) => one.visible);
    const one = { ...shown, name: "present design", style: "" };
    const places = this.postures.map((phi) => this.places(phi));
    this.machine.design(one, visible, this.postures, places);
    this.ground.design(one, visible, this.postures, places, shown.figures);
    this.#drawCurves(visible);
    this.controls.design(this.history.present);
    clearTimeout(this.resting);
    if (this.sliding || isFirst) this.resting = setTimeout(() => this.#rest(), isFirst ? 0 : REST);
    else this.#rest();
    this.#drawFigures();
    this.#drawLegend(visible);
    this.#drawVariants();
    byId("notice").hidden = !this.problem;
    say(byId("notice-text"), this.problem ? `${this.problem} The drawings show the last design that closes.` : "");
    document.body.classList.toggle("stale", Boolean(this.problem));
    /** @type {HTMLButtonElement} */ (byId("undo")).disabled = this.history.past.length === 0;
    /** @type {HTMLButtonElement} */ (byId("redo")).disabled = this.history.future.length === 0;
    const preset = /** @type {HTMLSelectElement} */ (byId("preset"));
    if (preset.value !== PRESET_NONE && !same(this.history.present, this.published.design)) preset.value = PRESET_NONE;
    if (!byId("page-coupling").hidden) this.coupling?.show(shown.design);
  }

  /** What can wait until a slider rests: derivatives, and what a drawing says to those who do not see it. */
  #rest() {
    this.#drawGoal();
    describe(
      byId("machine"),
      `Static trajectory, ${KINDS.filter((kind) => this.shown.figures[kind.key])
        .map((kind) => `${kind.title} ${figureText(kind, this.shown.figures[kind.key])}`)
        .join(", ")}`,
    );
  }

  /** Which curve is which. @param {Variant[]} visible */
  #drawLegend(visible) {
    const list = byId("legend");
    list.hidden = visible.length === 0;
    if (list.hidden) return;
    const rows = children(list, visible.length + 1, () => html("li", {}, sample(""), html("span")));
    for (const [k, one] of [{ name: "present design", style: "" }, ...visible].entries()) {
      put(rows[k].querySelector("path") ?? rows[k], { class: k === 0 ? "tip-path" : `variant ${one.style}` });
      say(rows[k].children[1], one.name);
    }
  }

  /** @param {Variant[]} visible */
  #drawCurves(visible) {
    const { turn } = this.shown;
    // beside variants the magnitude alone: the colours are theirs
    for (const [diagram, x, y, letter] of /** @type {const} */ ([
      [this.diagrams.speed, "tip.vx", "tip.vy", "v"],
      [this.diagrams.acceleration, "tip.ax", "tip.ay", "a"],
    ]))
      diagram.draw(
        [
          { name: `|${letter}|`, style: "c0", values: size(turn, x, y) },
          { name: `${letter}x`, style: "c1", values: turn.outputs[x] },
          { name: `${letter}y`, style: "c2", values: turn.outputs[y] },
        ].slice(0, visible.length > 0 ? 1 : 3),
        visible.map((one) => ({ name: one.name, style: `variant ${one.style}`, values: size(one.turn, x, y) })),
        this.postures,
      );
    for (const [diagram, name, title] of /** @type {const} */ ([
      [this.diagrams.torque, "crank.tau", "τ"],
      [this.diagrams.inertia, "crank.inertia", "J"],
    ])) {
      const hasMass = (/** @type {Solved} */ one) => one.turn.outputs[name]?.some((value) => value !== 0);
      const isThere = [this.shown, ...visible].some(hasMass);
      put(diagram.root, { hidden: !isThere });
      if (isThere)
        diagram.draw(
          [{ name: title, style: "c0", values: turn.outputs[name] }],
          visible.map((one) => ({ name: one.name, style: `variant ${one.style}`, values: one.turn.outputs[name] })),
          this.postures,
        );
    }
    for (const button of document.querySelectorAll("#curve-downloads [data-svg]"))
      put(button, { hidden: byId(/** @type {HTMLElement} */ (button).dataset.svg ?? "").hasAttribute("hidden") });
  }

  #drawGoal() {
    const aim = Number(/** @type {HTMLSelectElement} */ (byId("aim")).value);
    this.controls.slopes(this.goal, this.problem ? undefined : this.shown.figures[this.goal.key], aim);
  }

  /** The figures beside the published ones; rows are made anew only where there are others. */
  #drawFigures() {
    const body = /** @type {HTMLTableElement} */ (byId("figures")).tBodies[0];
    const columns = [this.shown, this.published];
    const kinds = KINDS.filter((kind) => columns.some(({ figures: found }) => found[kind.key]));
    if (body.rows.length !== kinds.length)
      body.replaceChildren(
        ...kinds.map((kind) =>
          html(
            "tr",
            { "data-figure": kind.key },
            html("th", { scope: "row", title: kind.text }, headed(kind)),
            ...columns.map(() => html("td")),
          ),
        ),
      );
    for (const [k, kind] of kinds.entries())
      for (const [c, { figures: found }] of columns.entries()) {
        const cell = body.rows[k].cells[c + 1];
        const figure = found[kind.key];
        say(cell, figure ? figureNumber(kind, figure) : "–");
        put(cell, { "data-value": figure?.value, class: c === 0 && this.problem ? "stale" : undefined });
      }
  }

  /** A row for each variant: shown or not, its line, its name, its figures. */
  #drawVariants() {
    const table = /** @type {HTMLTableElement} */ (byId("variants"));
    byId("variants-hint").hidden = this.variants.length > 0;
    table.hidden = this.variants.length === 0;
    const key = this.variants.flatMap((one) => [one, one.visible, one.name]);
    if (key.length === this.listed.length && key.every((part, k) => part === this.listed[k])) return;
    if (
      table.contains(document.activeElement) &&
      document.activeElement instanceof HTMLInputElement &&
      document.activeElement.type === "text"
    )
      return;
    this.listed = key;
    const kinds = KINDS.filter((kind) => this.variants.some((one) => one.figures[kind.key]));
    table.tHead?.replaceChildren(
      html(
        "tr",
        {},
        html("th", { scope: "col" }, "variant"),
        ...kinds.map((kind) => html("th", { scope: "col", title: kind.text }, headed(kind))),
        html("td", {}),
      ),
    );
    table.tBodies[0].replaceChildren(...this.variants.map((one) => this.#variantRow(one, kinds)));
  }

  /** @param {Variant} one @param {import("./figures.js").Kind[]} kinds */
  #variantRow(one, kinds) {
    const isShown = html("input", { type: "checkbox", "aria-label": `show ${one.name}` });
    isShown.checked = one.visible;
    isShown.addEventListener("change", () => {
      one.visible = isShown.checked;
      this.schedule();
    });
    const name = html("input", { type: "text", size: 12, value: one.name, "aria-label": `name of ${one.name}` });
    name.addEventListener("change", () => {
      one.name = name.value;
      name.blur();
      this.schedule();
    });
    const use = html("button", { type: "button", title: `Make ${one.name} the present design` }, "Use");
    use.addEventListener("click", () => this.go(one.design));
    const drop = html("button", { type: "button", "aria-label": `drop ${one.name}`, title: "Drop" }, "×");
    drop.addEventListener("click", () => {
      this.variants = this.variants.filter((other) => other !== one);
      this.schedule();
    });
    return html(
      "tr",
      { "data-variant": one.name },
      html("th", { scope: "row" }, html("span", {}, isShown, sample(`variant ${one.style}`), name)),
      ...kinds.map((kind) => figureCell(kind, one.figures[kind.key])),
      html("td", {}, use, " ", drop),
    );
  }

  #drawPose() {
    const places = this.places(this.phi);
    this.machine.pose(places);
    this.ground.pose(places, this.shown.design, this.phi);
    for (const diagram of Object.values(this.diagrams))
      if (!diagram.root.hasAttribute("hidden")) diagram.pose(this.phi);
    const degrees = (this.phi * 360) / TURN;
    const text = `${number(degrees, 0)}°`;
    const slider = /** @type {HTMLInputElement} */ (byId("phi"));
    if (slider.value !== String(Math.round(degrees))) slider.value = String(degrees);
    put(slider, { "aria-valuetext": text });
    put(byId("crank-handle"), { "aria-valuenow": Math.round(degrees), "aria-valuetext": text });
    say(byId("phi-text"), text);
  }

  // ---- the crank -----------------------------------------------------------------------------

  get isPlaying() {
    return this.started > 0;
  }

  /** @param {boolean} on */
  play(on) {
    this.started = on ? performance.now() : 0;
    put(byId("play"), { "aria-pressed": String(on) });
    say(byId("play"), on ? "Pause" : "Play");
    this.schedule();
  }

  /** The crank goes on with the time that has passed. @param {number} time ms */
  #advance(time) {
    if (!this.isPlaying) return;
    const pace = Number(/** @type {HTMLSelectElement} */ (byId("pace")).value);
    const passed = Math.min(Math.max(time - this.started, 0), 100) / 1e3;
    this.started = Math.max(time, 1);
    this.phi = (this.phi + pace * this.shown.design[RATE] * passed) % TURN;
    if (!document.hidden) this.schedule();
    else this.play(false);
  }

  /** @param {number} phi rad */
  turnTo(phi) {
    this.phi = ((phi % TURN) + TURN) % TURN;
    this.schedule();
  }

  #listenToCrank() {
    const slider = /** @type {HTMLInputElement} */ (byId("phi"));
    slider.addEventListener("input", () => {
      this.play(false);
      this.turnTo(((Number(slider.value) % 360) * TURN) / 360);
    });
    byId("play").addEventListener("click", () => this.play(!this.isPlaying));
    const handle = byId("crank-handle");
    const drag = (/** @type {Element} */ target, /** @type {(event: PointerEvent) => number} */ angleAt) => {
      const move = (/** @type {Event} */ event) => this.turnTo(angleAt(/** @type {PointerEvent} */ (event)));
      target.addEventListener("pointerdown", (event) => {
        this.play(false);
        target.setPointerCapture(/** @type {PointerEvent} */ (event).pointerId);
        target.addEventListener("pointermove", move);
        move(event);
      });
      for (const end of ["pointerup", "pointercancel"])
        target.addEventListener(end, () => target.removeEventListener("pointermove", move));
    };
    drag(handle, (event) => this.machine.angleAt(event, this.shown.design));
    for (const diagram of Object.values(this.diagrams)) drag(diagram.root, (event) => diagram.angleAt(event));
    handle.addEventListener("keydown", (event) => {
      const steps = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10 };
      const step = /** @type {Record<string, number>} */ (steps)[event.key];
      if (event.key === "Home") this.turnTo(0);
      else if (step === undefined) return;
      else this.turnTo(((Math.round((this.phi * 360) / TURN) + step) * TURN) / 360);
      event.preventDefault();
      this.play(false);
    });
  }

  // ---- everything else that the user does ----------------------------------------------------

  #listen() {
    const click = (/** @type {string} */ id, /** @type {() => void} */ act) => byId(id).addEventListener("click", act);
    const undo = () => {
      if (this.history.undo()) this.touch();
    };
    const redo = () => {
      if (this.history.redo()) this.touch();
    };
    click("undo", undo);
    click("redo", redo);
    document.addEventListener("keydown", (event) => {
      const isTyping = event.target instanceof HTMLInputElement && ["text", "number"].includes(event.target.type);
      if (isTyping || !(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z") return;
      event.preventDefault();
      if (event.shiftKey) redo();
      else undo();
    });
    click("back", () => this.go(this.shown.design));
    click("nearest", () => this.go(this.nearest()));
    const preset = /** @type {HTMLSelectElement} */ (byId("preset"));
    preset.addEventListener("change", () => this.preset(preset.value));
    const goal = /** @type {HTMLSelectElement} */ (byId("goal"));
    const aim = /** @type {HTMLSelectElement} */ (byId("aim"));
    goal.addEventListener("change", () => {
      this.goal = KINDS.find((kind) => kind.key === goal.value) ?? KINDS[0];
      aim.value = String(this.goal.aim);
      this.schedule();
    });
    aim.addEventListener("change", () => this.#drawGoal());
    this.controls.held.addEventListener("change", () => {
      const lowest = Math.min(...this.shown.turn.outputs["tip.y"]);
      const surface = ridgeSurface(this.shown.design, lowest);
      this.go(
        changed(
          this.catalogue,
          this.history.present,
          this.controls.held.checked ? { [LEVEL]: surface } : { [DEPTH]: Math.max(surface - lowest, 1e-3) },
        ),
      );
    });
    click("keep", () => {
      const field = /** @type {HTMLInputElement} */ (byId("variant-name"));
      this.refresh();
      this.keep(field.value.trim() || `variant ${this.variants.length + 1}`, this.shown);
      field.value = "";
    });
    const postures = /** @type {HTMLInputElement} */ (byId("postures"));
    postures.addEventListener("change", () => {
      const angles = postures.value
        .split(/[,;\s]+/)
        .filter(Boolean)
        .map((text) => Number(text.replace("°", "")));
      const isFine = angles.every(Number.isFinite) && angles.length <= 36;
      put(postures, { "aria-invalid": isFine ? undefined : "true" });
      if (!isFine) return this.say("Postures: up to 36 angles in degrees, such as 0, 62, 127");
      this.postures = angles.map((angle) => (angle * TURN) / 360);
      this.schedule();
    });
    this.#listenToFiles();
    this.#listenToTabs();
    addEventListener("hashchange", () => this.openAddress());
  }

  #listenToFiles() {
    for (const button of document.querySelectorAll("[data-save]"))
      button.addEventListener("click", () => this.save(/** @type {HTMLElement} */ (button).dataset.save ?? ""));
    for (const button of document.querySelectorAll("[data-svg]"))
      button.addEventListener("click", () => {
        const id = /** @type {HTMLElement} */ (button).dataset.svg ?? "";
        const drawing = byId(id);
        offer(
          `linkage-${id}.svg`,
          "image/svg+xml",
          toSvg(
            /** @type {any} */ (drawing),
            drawing.classList.contains("diagram") ? "px" : "mm",
            this.shown.design,
            drawing.getAttribute("aria-label") ?? id,
          ),
        );
      });
    byId("link").addEventListener("click", async () => {
      const address = `${location.href.split("#")[0]}#${toFragment(this.catalogue, this.history.present)}`;
      history.replaceState(null, "", address);
      try {
        await navigator.clipboard.writeText(address);
        this.say("The link is copied, and in the address line.");
      } catch {
        this.say("The link is in the address line.");
      }
    });
    const input = /** @type {HTMLInputElement} */ (byId("open"));
    input.addEventListener("change", async () => {
      const file = input.files?.[0];
      if (!file) return;
      this.openText(file.name, await file.text());
      input.value = "";
    });
  }

  /** A file that the page wrote, or a parameter set. @param {string} name @param {string} text */
  openText(name, text) {
    try {
      const opened = open(this.catalogue, text);
      this.go(opened.design);
      for (const one of opened.variants) this.keep(one.name, this.solve(one.design));
      this.say(`${name} is open.`);
    } catch (problem) {
      if (!(problem instanceof Unacceptable || problem instanceof Refusal)) throw problem;
      this.say(`${name}: ${problem.message}`);
    }
  }

  /** What the command line put into the page. @param {string} given JSON, or nothing */
  openGiven(given) {
    if (!given) return;
    const { name, text } = JSON.parse(given);
    this.openText(name, text);
  }

  /** @param {string} kind */
  save(kind) {
    this.refresh();
    const { shown } = this;
    if (this.problem && kind !== "json") this.say("This design makes no whole turn: saved is the last that does.");
    else this.say("");
    if (kind === "ssv") offer("linkage.ssv", "application/xml", toSsv(this.catalogue, shown.design));
    if (kind === "json") offer("linkage.json", "application/json", toJson(this.history.present, this.variants));
    this.model.take(shown.design);
    if (kind === "csv") offer("linkage-turn.csv", "text/csv", toCsv(shown.design, this.model.table()));
    if (kind === "dxf") offer("linkage.dxf", "image/vnd.dxf", toDxf(shown.design, shown.turn, this.model.joints(0)));
  }

  #listenToTabs() {
    const tabs = [byId("tab-design"), byId("tab-coupling")];
    const choose = (/** @type {HTMLElement} */ chosen) => {
      for (const tab of tabs) {
        put(tab, { "aria-selected": String(tab === chosen), tabindex: tab === chosen ? 0 : -1 });
        byId(tab.getAttribute("aria-controls") ?? "").hidden = tab !== chosen;
      }
      if (chosen === tabs[1]) {
        this.play(false);
        this.refresh();
        this.coupling ??= new CouplingPage(this.fmu, this.catalogue);
        this.coupling.show(this.shown.design);
      }
    };
    tabs.forEach((tab, k) => {
      tab.addEventListener("click", () => choose(tab));
      tab.addEventListener("keydown", (event) => {
        if (!["ArrowLeft", "ArrowRight"].includes(event.key)) return;
        tabs[1 - k].focus();
        choose(tabs[1 - k]);
      });
    });
  }

  /** What the address carries. */
  openAddress() {
    if (location.hash.length < 2) return;
    try {
      const design = fromFragment(this.catalogue, location.hash.slice(1));
      if (!same(design, this.history.present)) this.go(design);
    } catch (problem) {
      if (!(problem instanceof Unacceptable || problem instanceof URIError)) throw problem;
      this.say(`The link: ${problem.message}`);
    }
  }

  /** @param {string} text */
  say(text) {
    say(byId("message"), text);
  }
}

/** Magnitudes over a turn. @param {Turn} turn @param {string} x @param {string} y */
function size({ outputs }, x, y) {
  const [along, up] = [outputs[x], outputs[y]];
  const found = new Float64Array(along.length);
  for (let k = 0; k < found.length; k += 1) found[k] = Math.sqrt(along[k] * along[k] + up[k] * up[k]);
  return found;
}

/** A piece of a line, for a legend. @param {string} style */
function sample(style) {
  return svg(
    "svg",
    { viewBox: "0 0 24 8", class: "drawing sample", "aria-hidden": "true" },
    svg("path", { class: style, d: "M0 4H24" }),
  );
}

/** Where a turn does not close and by how much. @param {Turn} turn */
function gapText(turn) {
  const gap = worst(turn.gaps);
  const degrees = (/** @type {number} */ phi) => `${number((phi * 360) / TURN, 0)}°`;
  const share = turn.gaps.length / turn.phi.length;
  const where =
    share > 0.999
      ? "anywhere in the turn"
      : `for ${number(Math.max(100 * share, 0.1), share < 0.01 ? 1 : 0)} % of the turn`;
  const by =
    gap.miss === 0
      ? "it stands at a dead point"
      : `its ends are ${number(Math.abs(gap.miss), 2)} mm too ${gap.miss > 0 ? "far apart" : "near each other"}`;
  return `The linkage does not close ${where}: dyad ${gap.dyad} is worst at ${degrees(gap.phi)} of the crank, where ${by}.`;
}

/** @param {import("./figures.js").Kind} kind */
function headed(kind) {
  return kind.display ? `${kind.title}, ${kind.display}` : kind.title;
}

/** @param {import("./figures.js").Kind} kind @param {Figure | undefined} figure @param {string} [style] */
function figureCell(kind, figure, style) {
  return html(
    "td",
    { "data-figure": kind.key, "data-value": figure?.value, class: style },
    figure ? figureNumber(kind, figure) : "–",
  );
}

/** @param {import("./figures.js").Kind} kind @param {Figure} figure */
function figureNumber(kind, figure) {
  return Number.isFinite(figure.value) ? number(figure.value * kind.factor, kind.digits) : "none";
}

/** @param {import("./figures.js").Kind} kind @param {Figure} figure */
function figureText(kind, figure) {
  return `${figureNumber(kind, figure)} ${kind.display}`.trim();
}

/** Let the browser save a file. @param {string} name @param {string} type @param {string} text */
function offer(name, type, text) {
  const address = URL.createObjectURL(new Blob([text], { type }));
  html("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 1e4);
}

/** The kernel, which stands in the page compressed. @param {string} text base64 */
async function unpacked(text) {
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let k = 0; k < letters.length; k += 1) bytes[k] = letters.charCodeAt(k);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}

/** What the page is made of besides the FMU. @typedef {ReturnType<typeof parts>} Parts */

/** The drawings read their sizes, before anything is put into them. @param {Controls} controls */
function parts(controls) {
  const diagram = (/** @type {keyof typeof DIAGRAMS} */ id) => new Diagram(byId(id), DIAGRAMS[id]);
  const [machine, ground] = [new MachineView(byId("machine"), byId("crank-handle")), new GroundView(byId("ground"))];
  const diagrams = {
    speed: diagram("speed"),
    acceleration: diagram("acceleration"),
    torque: diagram("torque"),
    inertia: diagram("inertia"),
  };
  return { machine, ground, diagrams, controls };
}

async function start() {
  const catalogue = new Catalogue(JSON.parse(byId("interface").textContent ?? ""));
  const kernel = byId("kernel");
  const loading = unpacked(kernel.textContent ?? "").then((bytes) => Fmu.load(bytes, catalogue.model.token));
  kernel.remove();
  const controls = new Controls(byId("controls"), catalogue); // while the browser compiles the FMU
  const fmu = await loading;
  byId("page-design").hidden = false; // until now: or the browser would draw a page without anything in it
  const explorer = new Explorer(fmu, catalogue, parts(controls));
  explorer.openGiven(byId("given").textContent ?? "");
  explorer.openAddress();
  explorer.draw(performance.now());
  performance.mark("first-picture");
  explorer.watchSizes();
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches) explorer.play(true);
  return explorer;
}

const started = start();
started.catch((problem) => {
  byId("page-design").hidden = false;
  byId("notice").hidden = false;
  say(byId("notice-text"), `The page could not start: ${problem.message}`);
});

/** What scripts and tests may use once it is ready. @param {Explorer} explorer */
function services(explorer) {
  const { model, catalogue } = explorer;
  return {
    /** Change quantities, by name and in SI units; throws where one is not accepted. @param {Record<string, number>} values */
    set(values) {
      explorer.go(changed(catalogue, explorer.history.present, values));
    },
    /** The value of a quantity, of theta41 or of machine.v. @param {string} name */
    get(name) {
      const design = explorer.history.present;
      return name === "machine.v" ? machineSpeed(design) : quantityOf(design, name);
    },
    /** All outputs at an angle of the crank in rad, by name; throws where the pose cannot be reached. @param {number} phi */
    pose(phi) {
      model.take(explorer.history.present);
      return model.pose(phi);
    },
    /** The figures of the present design in SI units; throws where it does not close. */
    figures() {
      explorer.refresh();
      if (explorer.problem) throw new Unacceptable(explorer.problem);
      return Object.fromEntries(Object.entries(explorer.shown.figures).map(([key, figure]) => [key, figure.value]));
    },
    /** Their derivatives by each quantity, in SI units. */
    gradients() {
      explorer.refresh();
      if (explorer.problem) throw new Unacceptable(explorer.problem);
      return Object.fromEntries(Object.entries(explorer.shown.figures).map(([key, figure]) => [key, figure.by]));
    },
  };
}

/** @type {Record<string, unknown>} */
const offered = {};
offered.ready = started.then((explorer) => Boolean(Object.assign(offered, services(explorer))));
/** @type {any} */ (window).explorer = offered;
