// @ts-check
// The two drawings: the linkage in the machine's frame, and the dynamic trajectory over the ridge. In mm, y up.

import { line, put, say, svg } from "./dom.js";
import { ridgeSurface } from "./figures.js";
import { number, SPACING, TURN } from "./interface.js";
import { joints } from "./model.js";

/** @typedef {import("./model.js").Turn} Turn */
/** @typedef {import("./model.js").Point} Point */
/** @typedef {import("./design.js").Design} Design */
/** What is drawn of a design. @typedef {{design: Design, turn: Turn, name: string, style: string}} Shown */
/** @typedef {{left: number, right: number, top: number, bottom: number}} Box mm, y up */

const MM = 1e3;
const LINKS = [
  ["OA", "crank"],
  ["CD", "crank"],
  ["AB", "link"],
  ["DB", "link"],
  ["DE", "link"],
  ["EF", "link"],
  ["GF", "link"],
  ["HI", "link"],
  ["IJ", "nozzle"],
]; // prettier-ignore
/** Links that are more than a line. */
const BODIES = ["BDE", "EFI"];
/** Where names stand beside their joints, mm. @type {Record<string, [number, number]>} */
const BESIDE = {
  O: [-16, 14],
  C: [8, -16],
  G: [10, -14],
  A: [-16, 6],
  B: [0, 12],
  D: [10, 6],
  E: [-14, 8],
  F: [10, 6],
  H: [8, 8],
  I: [-14, 4],
  J: [10, -6],
};

/** Common to both drawings: a frame that fits what is in it, a grid, marks. */
class View {
  /** @param {SVGSVGElement} root */
  constructor(root) {
    this.root = root;
    this.grid = svg("g", { class: "grid", "aria-hidden": "true" });
    this.soil = svg("g", { class: "soil" });
    this.variants = svg("g", { class: "variants" });
    this.path = svg("path", { class: "tip-path" });
    this.postures = svg("g", { class: "postures" });
    this.root.append(this.grid, this.soil, this.variants, this.path, this.postures);
    /** Height of letters in mm, so that they are read at any size. */
    this.letter = 10;
    /** @type {Box} */
    this.box = { left: 0, right: 0, top: 0, bottom: 0 };
  }

  /** Take a frame, widened to 50 mm, unless the present one still fits well. @param {Box} need */
  frame(need) {
    const { box } = this;
    const fits = need.left >= box.left && need.right <= box.right && need.top <= box.top && need.bottom >= box.bottom;
    const loose =
      (box.right - box.left) * (box.top - box.bottom) > 1.5 * (need.right - need.left) * (need.top - need.bottom);
    if (fits && !loose) return;
    const out = (/** @type {number} */ v, /** @type {number} */ sign) => Math.ceil((sign * v) / 50 + 0.3) * 50 * sign;
    this.box = {
      left: out(need.left, -1),
      right: out(need.right, 1),
      top: out(need.top, 1),
      bottom: out(need.bottom, -1),
    };
    const { left, right, top, bottom } = this.box;
    put(this.root, { viewBox: `${left} ${-top} ${right - left} ${top - bottom}` });
    this.letter = (12.5 * (right - left)) / Math.max(this.root.clientWidth, 240);
    this.root.style.fontSize = `${this.letter}px`;
    this.grid.replaceChildren();
    for (let x = Math.ceil(left / 100) * 100; x <= right; x += 100) {
      this.grid.append(svg("path", { d: `M${x} ${-top}V${-bottom}`, class: x === 0 ? "axis" : undefined }));
      if (x > left + 20 && x < right - 40) this.grid.append(svg("text", { x: x + 3, y: -bottom - 4 }, number(x, 0)));
    }
    for (let y = Math.ceil(bottom / 100) * 100; y <= top; y += 100) {
      this.grid.append(svg("path", { d: `M${left} ${-y}H${right}`, class: y === 0 ? "axis" : undefined }));
      if (y > bottom + 20) this.grid.append(svg("text", { x: left + 3, y: -y - 3 }, number(y, 0)));
    }
    this.grid.append(svg("text", { x: right - 3, y: -bottom - 4, "text-anchor": "end" }, "mm"));
  }

  /** The ridge below its surface. @param {number} surface mm */
  ridge(surface) {
    const { left, right, bottom } = this.box;
    const depth = Math.max(surface - bottom, 0);
    this.soil.replaceChildren(
      svg("rect", { x: left, y: -surface, width: right - left, height: depth }),
      svg("path", { d: `M${left} ${-surface}H${right}` }),
      svg("text", { x: right - 6, y: -surface + 1.3 * this.letter, "text-anchor": "end" }, "ridge"),
    );
  }

  /** @param {Shown[]} variants @param {(shown: Shown) => string} data */
  overlay(variants, data) {
    this.variants.replaceChildren(
      ...variants.map((shown) =>
        svg("path", { class: `variant ${shown.style}`, d: data(shown) }, svg("title", {}, shown.name)),
      ),
    );
  }
}

/** The nozzle as a pointed body about its axis I to J. @param {Point} I @param {Point} J @param {number} width mm */
function nozzleShape(I, J, width) {
  const length = Math.hypot(J.x - I.x, J.y - I.y) || 1;
  const [nx, ny] = [(-(J.y - I.y) / length) * width, ((J.x - I.x) / length) * width];
  const at = (/** @type {number} */ share, /** @type {number} */ side) =>
    `${((I.x + share * (J.x - I.x)) * MM + side * nx).toFixed(2)} ${(-(I.y + share * (J.y - I.y)) * MM - side * ny).toFixed(2)}`;
  return `M${at(0, 1)}L${at(0.6, 1)}L${at(1, 0)}L${at(0.6, -1)}L${at(0, -1)}Z`;
}

const EVERY = 2; // samples between the points that are drawn: a degree

/** Path data of the tip. @param {Turn} turn */
function tipPath(turn) {
  const { "tip.x": x, "tip.y": y } = turn.outputs;
  const count = Math.floor((x.length - 1) / EVERY) + 1;
  const xs = new Float64Array(count);
  const ys = new Float64Array(count);
  for (let k = 0; k < count; k += 1) [xs[k], ys[k]] = [x[k * EVERY] * MM, -y[k * EVERY] * MM];
  return line(xs, ys);
}

/** @param {Turn} turn */
function bounds(turn) {
  const { "tip.x": x, "tip.y": y } = turn.outputs;
  const known = (/** @type {Float64Array} */ values) => values.filter((value) => Number.isFinite(value));
  const [kx, ky] = [known(x), known(y)];
  return {
    left: Math.min(...kx) * MM,
    right: Math.max(...kx) * MM,
    top: Math.max(...ky) * MM,
    bottom: Math.min(...ky) * MM,
  };
}

/** Outputs of a turn at an angle, straight between samples: good enough to look at. @param {Turn} turn @param {number} phi */
export function reader(turn, phi) {
  const last = turn.phi.length - 1;
  const place = ((((phi / TURN) % 1) + 1) % 1) * last;
  const k = Math.min(Math.floor(place), last - 1);
  return (/** @type {string} */ name) => {
    const values = turn.outputs[name];
    return values[k] + (place - k) * (values[k + 1] - values[k]);
  };
}

/** The linkage, its tip's static trajectory, postures at chosen angles. */
export class MachineView extends View {
  /** @param {SVGSVGElement} root @param {SVGGElement} handle a slider for the crank, which the page has */
  constructor(root, handle) {
    super(root);
    this.handle = handle;
    this.linkage = svg("g", { class: "linkage" });
    /** @type {Map<string, SVGPathElement>} */
    this.links = new Map();
    this.bodies = BODIES.map((name) => {
      const path = svg("path", { class: "body" }, svg("title", {}, `${name}: one rigid link`));
      this.linkage.append(path);
      return /** @type {const} */ ([name, path]);
    });
    for (const [name, style] of LINKS) {
      const path = svg("path", { class: style }, svg("title", {}, name));
      this.links.set(name, path);
      this.linkage.append(path);
    }
    /** @type {Map<string, SVGGElement>} */
    this.joints = new Map();
    for (const name of Object.keys(BESIDE)) {
      const [dx, dy] = BESIDE[name];
      const fixed = "OCG".includes(name);
      const mark = svg(
        "g",
        { class: fixed ? "joint fixed" : "joint" },
        fixed ? svg("path", { d: "M0 0L-9 15H9Z" }) : "",
        svg("circle", { r: "HI".includes(name) ? 2.5 : 4.5 }),
        svg("text", { x: dx, y: -dy, dy: "0.35em", "text-anchor": "middle" }, name),
      );
      this.joints.set(name, mark);
      this.linkage.append(mark);
    }
    this.root.append(this.linkage, this.handle);
  }

  /** @param {Shown} shown @param {Shown[]} variants @param {number[]} postures rad */
  design(shown, variants, postures) {
    const { design, turn } = shown;
    const boxes = [shown, ...variants].map((one) => bounds(one.turn));
    const reach = (design["geometry.L1"] + design["geometry.L2"]) * MM;
    this.frame({
      left: Math.min(...boxes.map((b) => b.left), -reach * 0.7),
      right: Math.max(
        ...boxes.map((b) => b.right),
        (design["geometry.XC"] + design["geometry.L4"]) * MM,
        design["geometry.XG"] * MM,
      ),
      top: Math.max(...boxes.map((b) => b.top), reach * 0.7),
      bottom: Math.min(...boxes.map((b) => b.bottom)),
    });
    this.ridge(ridgeSurface(design, Math.min(...turn.outputs["tip.y"])) * MM);
    put(this.path, { d: tipPath(turn) });
    this.overlay(variants, (one) => tipPath(one.turn));
    this.postures.replaceChildren();
    for (const phi of postures) {
      const { I, J } = joints(design, phi, reader(turn, phi));
      const angle = (phi * 360) / TURN;
      this.postures.append(
        svg("path", { d: nozzleShape(I, J, 7) }, svg("title", {}, `nozzle at ${number(angle, 0)}°`)),
        svg("text", { x: J.x * MM + 6, y: -J.y * MM + 14 }, `${number(angle, 0)}°`),
      );
    }
  }

  /** @param {Shown} shown @param {number} phi rad */
  pose(shown, phi) {
    const places = joints(shown.design, phi, reader(shown.turn, phi));
    for (const [name, path] of this.links) {
      const [from, to] = [places[name[0]], places[name[1]]];
      put(path, {
        d: name === "IJ" ? nozzleShape(from, to, 7) : line([from.x * MM, to.x * MM], [-from.y * MM, -to.y * MM]),
      });
    }
    for (const [name, path] of this.bodies) {
      const corners = [...name].map((joint) => places[joint]);
      put(path, {
        d: `${line(
          corners.map((p) => p.x * MM),
          corners.map((p) => -p.y * MM),
        )}Z`,
      });
    }
    for (const [name, mark] of this.joints)
      put(mark, { transform: `translate(${(places[name].x * MM).toFixed(2)} ${(-places[name].y * MM).toFixed(2)})` });
    put(this.handle, { transform: `translate(${(places.A.x * MM).toFixed(2)} ${(-places.A.y * MM).toFixed(2)})` });
  }

  /** The crank's angle at which OA points to a place on the screen. @param {PointerEvent} event @param {Design} design */
  angleAt(event, design) {
    const matrix = this.root.getScreenCTM();
    if (!matrix) return 0;
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
    return design["geometry.phi1"] - Math.atan2(-point.y, point.x);
  }
}

const [BEFORE, AFTER] = [-0.3, 1.42]; // turns that are shown of the dynamic trajectory

/** The dynamic trajectory over the ridge, its hole, what the nozzle sweeps, and the nozzle on its way. */
export class GroundView extends View {
  /** @param {SVGSVGElement} root */
  constructor(root) {
    super(root);
    this.fan = svg("path", { class: "fan" });
    this.marks = svg("g", { class: "marks" });
    this.nozzle = svg("path", { class: "nozzle" });
    this.tip = svg("circle", { class: "tip", r: 5 });
    this.root.insertBefore(this.fan, this.path);
    this.root.append(this.marks, this.nozzle, this.tip);
  }

  /** @param {Shown} one */
  dynamic({ design, turn }) {
    const samples = turn.phi.length - 1;
    const { "tip.x": x, "tip.y": y } = turn.outputs;
    const [from, to] = [Math.round(BEFORE * samples), Math.round(AFTER * samples)];
    const count = Math.floor((to - from) / EVERY) + 1;
    const xs = new Float64Array(count);
    const ys = new Float64Array(count);
    for (let n = 0; n < count; n += 1) {
      const k = from + n * EVERY;
      const s = ((k % samples) + samples) % samples;
      xs[n] = (x[s] + (design[SPACING] * k) / samples) * MM;
      ys[n] = -y[s] * MM;
    }
    return { xs, ys };
  }

  /**
   * @param {Shown} shown @param {Shown[]} variants @param {number[]} postures rad
   * @param {Record<string, import("./figures.js").Figure>} found
   */
  design(shown, variants, postures, found) {
    const { design, turn } = shown;
    const paths = [shown, ...variants].map((one) => this.dynamic(one));
    this.frame({
      left: Math.min(...paths.map((p) => Math.min(...p.xs))),
      right: Math.max(...paths.map((p) => Math.max(...p.xs))),
      top: Math.max(...paths.map((p) => -Math.min(...p.ys))) + 0.8 * design["geometry.L9"] * MM,
      bottom: Math.min(...paths.map((p) => -Math.max(...p.ys))) - 20,
    });
    const surface = ridgeSurface(design, Math.min(...turn.outputs["tip.y"])) * MM;
    this.ridge(surface);
    put(this.path, { d: line(paths[0].xs, paths[0].ys) });
    this.variants.replaceChildren(
      ...variants.map((one, k) =>
        svg(
          "path",
          { class: `variant ${one.style}`, d: line(paths[k + 1].xs, paths[k + 1].ys) },
          svg("title", {}, one.name),
        ),
      ),
    );
    this.inTheRidge(shown, surface, found);
    this.postures.replaceChildren();
    for (const phi of postures) {
      const { I, J } = this.carried(shown, phi);
      this.postures.append(
        svg("path", { d: nozzleShape(I, J, 7) }, svg("title", {}, `nozzle at ${number((phi * 360) / TURN, 0)}°`)),
      );
    }
  }

  /** The joints where the machine has carried them. @param {Shown} shown @param {number} phi */
  carried({ design, turn }, phi) {
    const places = joints(design, phi, reader(turn, phi));
    const travel = (design[SPACING] * phi) / TURN;
    const moved = (/** @type {Point} */ p) => ({ x: p.x + travel, y: p.y });
    return { I: moved(places.I), J: moved(places.J) };
  }

  /** The nozzle's axis while it is in the ridge, and the widths of hole and sweep. @param {Shown} shown @param {number} surface mm @param {Record<string, import("./figures.js").Figure>} found */
  inTheRidge(shown, surface, found) {
    const { turn } = shown;
    const y = turn.outputs["tip.y"];
    const samples = y.length - 1;
    const bottom = y.indexOf(Math.min(...y));
    const below = (/** @type {number} */ k) => y[((k % samples) + samples) % samples] * MM < surface;
    let [first, last] = [bottom, bottom];
    while (below(first - 1) && bottom - first < samples) first -= 1;
    while (below(last + 1) && last - bottom < samples) last += 1;
    let fan = "";
    /** @type {number[]} */
    const swept = [];
    /** @type {number[]} */
    const ends = [];
    const every = Math.max(1, Math.round((last - first) / 14));
    for (let k = first; k <= last; k += 1) {
      const { I, J } = this.carried(shown, (k * TURN) / samples);
      const share = (surface / MM - J.y) / (I.y - J.y);
      const x = (J.x + share * (I.x - J.x)) * MM;
      swept.push(x);
      if (k === first || k === last) ends.push(J.x * MM);
      if ((k - first) % every === 0) fan += line([J.x * MM, x], [-J.y * MM, -surface]);
    }
    put(this.fan, { d: fan });
    this.marks.replaceChildren();
    if (!Number.isFinite(found.hole?.value ?? Number.NaN)) return;
    const floor = Math.min(...y) * MM;
    this.measure(
      ends[0],
      ends[1] ?? ends[0],
      surface,
      surface + 1.5 * this.letter,
      `hole ${number(found.hole.value * MM, 1)}`,
    );
    this.measure(
      Math.min(...swept),
      Math.max(...swept),
      surface,
      floor - 12,
      `swept ${number(found.swept.value * MM, 1)}`,
    );
  }

  /** A dimension line. @param {number} from @param {number} to @param {number} start mm, y @param {number} at mm, y @param {string} text */
  measure(from, to, start, at, text) {
    const [a, b] = from < to ? [from, to] : [to, from];
    this.marks.append(
      svg("path", { d: `M${a} ${-start}V${-at}M${b} ${-start}V${-at}M${a} ${-at}H${b}` }),
      svg("text", { x: b + 6, y: -at, dy: "0.35em" }, text),
    );
  }

  /** @param {Shown} shown @param {number} phi rad */
  pose(shown, phi) {
    const { I, J } = this.carried(shown, phi);
    put(this.nozzle, { d: nozzleShape(I, J, 7) });
    put(this.tip, { cx: (J.x * MM).toFixed(2), cy: (-J.y * MM).toFixed(2) });
  }
}

/** A sentence for those who do not see the drawing. @param {SVGSVGElement} root @param {string} text */
export function describe(root, text) {
  const described = root.querySelector("desc") ?? root.insertBefore(svg("desc"), root.firstChild);
  say(described, text);
}
