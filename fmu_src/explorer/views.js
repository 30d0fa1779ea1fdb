// @ts-check
// The two drawings: the linkage in the machine's frame, and the dynamic trajectory over the ridge. In mm, y up.

import { children, line, put, say, svg } from "./dom.js";
import { ridgeSurface } from "./figures.js";
import { number, SPACING, TURN } from "./interface.js";

/** @typedef {import("./model.js").Turn} Turn */
/** @typedef {import("./model.js").Point} Point */
/** @typedef {import("./design.js").Design} Design */
/** @typedef {Record<string, Point>} Places the joints by letter */
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
/** Where names stand beside their joints, in letters. @type {Record<string, [number, number]>} */
const BESIDE = {
  O: [1.3, -0.7],
  C: [1.4, -0.9],
  G: [1.3, -0.8],
  A: [-1, 0.5],
  B: [0.3, 1],
  D: [-0.5, 1],
  E: [-1, 0.6],
  F: [0.8, 0.6],
  H: [0.8, 0.5],
  I: [-1, 0.3],
  J: [-0.9, -0.4],
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
    this.surface = svg("rect");
    this.edge = svg("path");
    this.named = svg("text", { "text-anchor": "end" }, "ridge");
    this.soil.append(this.surface, this.edge, this.named);
    /** Height of letters in mm, so that they are read at any size. */
    this.letter = 10;
    /** Pixels; a drawing may be less wide than its room where its height is limited. */
    this.width = root.clientWidth;
    this.height = Number.POSITIVE_INFINITY;
    /** @type {Box} */
    this.box = { left: 0, right: 0, top: 0, bottom: 0 };
  }

  /** The window has another size. @param {number} width pixels @param {number} height @returns {boolean} whether all is to be drawn anew */
  resize(width, height) {
    const scale = this.scale();
    this.width = width;
    this.height = height;
    if (Math.abs(this.scale() / scale - 1) < 0.01) return false;
    this.box = { left: 0, right: 0, top: 0, bottom: 0 };
    return true;
  }

  /** Pixels a mm. */
  scale() {
    const { left, right, top, bottom } = this.box;
    return Math.min(Math.max(this.width, 240) / (right - left), this.height / (top - bottom));
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
    this.letter = 12.5 / this.scale();
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
    put(this.surface, { x: left, y: -surface, width: right - left, height: depth });
    put(this.edge, { d: `M${left} ${-surface}H${right}` });
    put(this.named, { x: right - 6, y: -surface + 1.3 * this.letter });
  }

  /** @param {Shown[]} variants @param {(shown: Shown, k: number) => string} data */
  overlay(variants, data) {
    const paths = children(this.variants, variants.length, () => svg("path", {}, svg("title")));
    for (const [k, shown] of variants.entries()) {
      put(paths[k], { class: `variant ${shown.style}`, d: data(shown, k) });
      if (paths[k].firstElementChild) say(paths[k].firstElementChild, shown.name);
    }
  }

  /** The nozzle at chosen angles, which are named if that is wanted. @param {number[]} angles rad @param {Places[]} places @param {boolean} areNamed */
  nozzles(angles, places, areNamed) {
    const marks = children(this.postures, angles.length, () =>
      svg("g", {}, svg("path", {}, svg("title")), svg("text", { "text-anchor": "middle" })),
    );
    /** @type {Point[]} */
    const taken = [];
    for (const [k, phi] of angles.entries()) {
      const { I, J } = places[k];
      const [path, name] = marks[k].children;
      const degrees = `${number((phi * 360) / TURN, 0)}°`;
      put(path, { d: nozzleShape(I, J, 7) });
      if (path.firstElementChild) say(path.firstElementChild, `nozzle at ${degrees}`);
      say(name, areNamed ? degrees : "");
      if (!areNamed) continue;
      const room = this.letter * 2.6; // of a name, in mm
      const at = { x: I.x * MM, y: I.y * MM + 0.6 * this.letter };
      while (taken.some((p) => Math.abs(p.x - at.x) < room && Math.abs(p.y - at.y) < this.letter)) at.y += this.letter;
      taken.push(at);
      put(name, { x: at.x.toFixed(2), y: (-at.y).toFixed(2) });
    }
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

/** Least and greatest of numbers. @param {Float64Array} values */
function extent(values) {
  let [low, high] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY];
  for (let k = 0; k < values.length; k += 1) {
    if (values[k] < low) low = values[k];
    if (values[k] > high) high = values[k];
  }
  return [low, high];
}

/** @param {Turn} turn */
function bounds(turn) {
  const [left, right] = extent(turn.outputs["tip.x"]);
  const [bottom, top] = extent(turn.outputs["tip.y"]);
  return { left: left * MM, right: right * MM, top: top * MM, bottom: bottom * MM };
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
        svg("text", { x: `${dx}em`, y: `${-dy}em`, dy: "0.35em", "text-anchor": "middle" }, name),
      );
      this.joints.set(name, mark);
      this.linkage.append(mark);
    }
    this.root.append(this.linkage, this.handle);
  }

  /** @param {Shown} shown @param {Shown[]} variants @param {number[]} postures rad @param {Places[]} places at these */
  design(shown, variants, postures, places) {
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
    this.ridge(ridgeSurface(design, boxes[0].bottom / MM) * MM);
    put(this.path, { d: tipPath(turn) });
    this.overlay(variants, (one) => tipPath(one.turn));
    this.nozzles(postures, places, true);
  }

  /** @param {Places} places */
  pose(places) {
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
   * @param {Shown} shown @param {Shown[]} variants @param {number[]} postures rad @param {Places[]} places at these
   * @param {Record<string, import("./figures.js").Figure>} found
   */
  design(shown, variants, postures, places, found) {
    const { design, turn } = shown;
    const paths = [shown, ...variants].map((one) => this.dynamic(one));
    const boxes = paths.map(({ xs, ys }) => [...extent(xs), ...extent(ys)]);
    this.frame({
      left: Math.min(...boxes.map((box) => box[0])),
      right: Math.max(...boxes.map((box) => box[1])),
      top: Math.max(...boxes.map((box) => -box[2])) + 0.8 * design["geometry.L9"] * MM,
      bottom: Math.min(...boxes.map((box) => -box[3])) - 20,
    });
    const surface = ridgeSurface(design, extent(turn.outputs["tip.y"])[0]) * MM;
    this.ridge(surface);
    put(this.path, { d: line(paths[0].xs, paths[0].ys) });
    this.overlay(variants, (_, k) => line(paths[k + 1].xs, paths[k + 1].ys));
    this.inTheRidge(shown, surface, found);
    const carried = places.map((one, k) => this.carried(one, design, postures[k]));
    this.nozzles(postures, carried, false);
  }

  /** The nozzle's ends where the machine has carried them. @param {Places} places @param {Design} design @param {number} phi @returns {Places} */
  carried({ I, J }, design, phi) {
    const travel = (design[SPACING] * phi) / TURN;
    return { I: { x: I.x + travel, y: I.y }, J: { x: J.x + travel, y: J.y } };
  }

  /** The nozzle's axis while it is in the ridge, and the widths of hole and sweep. @param {Shown} shown @param {number} surface mm @param {Record<string, import("./figures.js").Figure>} found */
  inTheRidge({ design, turn }, surface, found) {
    const { "tip.x": x, "tip.y": y, "tip.angle": angle } = turn.outputs;
    const samples = y.length - 1;
    const bottom = y.indexOf(extent(y)[0]);
    const at = (/** @type {number} */ k) => ((k % samples) + samples) % samples;
    const below = (/** @type {number} */ k) => y[at(k)] * MM < surface;
    let [first, last] = [bottom, bottom];
    while (below(first - 1) && bottom - first < samples) first -= 1;
    while (below(last + 1) && last - bottom < samples) last += 1;
    let fan = "";
    let [least, most] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY];
    const every = Math.max(1, Math.round((last - first) / 14));
    const tip = (/** @type {number} */ k) => (x[at(k)] + (design[SPACING] * k) / samples) * MM;
    for (let k = first; k <= last; k += 1) {
      const s = at(k);
      const axis = tip(k) + (surface - y[s] * MM) / Math.tan(angle[s]);
      least = Math.min(least, axis);
      most = Math.max(most, axis);
      if ((k - first) % every === 0) fan += line([tip(k), axis], [-y[s] * MM, -surface]);
    }
    put(this.fan, { d: fan });
    const isThere = Number.isFinite(found.hole.value);
    put(this.marks, { hidden: !isThere });
    if (!isThere) return;
    const above = surface + 1.5 * this.letter;
    this.measure(0, tip(first), tip(last), surface, above, `hole ${number(found.hole.value * MM, 1)}`);
    this.measure(1, least, most, surface, y[bottom] * MM - 12, `swept ${number(found.swept.value * MM, 1)}`);
  }

  /** A dimension line. @param {number} which @param {number} from @param {number} to @param {number} start mm, y @param {number} at mm, y @param {string} text */
  measure(which, from, to, start, at, text) {
    const [a, b] = from < to ? [from, to] : [to, from];
    const [path, name] = children(this.marks, 2, () => svg("g", {}, svg("path"), svg("text", { dy: "0.35em" })))[which]
      .children;
    const [left, right, foot, top] = [a, b, -start, -at].map((value) => value.toFixed(2));
    put(path, { d: `M${left} ${foot}V${top}M${right} ${foot}V${top}M${left} ${top}H${right}` });
    put(name, { x: (b + 6).toFixed(2), y: top });
    say(name, text);
  }

  /** @param {Places} places @param {Design} design @param {number} phi rad */
  pose(places, design, phi) {
    const { I, J } = this.carried(places, design, phi);
    put(this.nozzle, { d: nozzleShape(I, J, 7) });
    put(this.tip, { cx: (J.x * MM).toFixed(2), cy: (-J.y * MM).toFixed(2) });
  }
}

/** A sentence for those who do not see the drawing. @param {SVGSVGElement} root @param {string} text */
export function describe(root, text) {
  const described = root.querySelector("desc") ?? root.insertBefore(svg("desc"), root.firstChild);
  say(described, text);
}
