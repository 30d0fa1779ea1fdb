// @ts-check
// What is taken away, and how it opens again. Files are in SI units; every one carries the whole design.

import { changed, differences, machineSpeed, publishedDesign, Unacceptable } from "./design.js";
import { RATE } from "./interface.js";

/** @typedef {import("./interface.js").Catalogue} Catalogue */
/** @typedef {import("./design.js").Design} Design */
/** @typedef {import("./model.js").Turn} Turn */
/** @typedef {import("./model.js").Point} Point */
/** @typedef {{name: string, design: Design}} Named */
/** What a file brings. @typedef {{design: Design, variants: Named[]}} Opened */

const FORMAT = "transplanter-linkage-design/1";
const SSV = "http://ssp-standard.org/SSP1/SystemStructureParameterValues";
const SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon";
const ANNOTATION = "transplanter-linkage.explorer";
const DXF_LINE = 200; // characters that a comment of a DXF file may hold; the format has 255

// ---- link ------------------------------------------------------------------------------------

/** What differs from the published design, as the fragment of an address. @param {Catalogue} catalogue @param {Design} design */
export function toFragment(catalogue, design) {
  const entries = Object.entries(differences(catalogue, design));
  return entries.map(([name, value]) => `${name}=${value}`).join("&");
}

/** @param {Catalogue} catalogue @param {string} fragment without # */
export function fromFragment(catalogue, fragment) {
  /** @type {Record<string, number>} */
  const values = {};
  for (const part of decodeURIComponent(fragment).split("&").filter(Boolean)) {
    const [name, value = ""] = part.split("=");
    values[name] = value.trim() === "" ? Number.NaN : Number(value);
  }
  return changed(catalogue, publishedDesign(catalogue), values);
}

// ---- JSON ------------------------------------------------------------------------------------

/** @param {Design} design @param {Named[]} variants */
export function toJson(design, variants = []) {
  const kept = variants.map((one) => ({ name: one.name, values: one.design }));
  return `${JSON.stringify({ format: FORMAT, units: "SI", values: design, variants: kept }, null, 2)}\n`;
}

/** @param {Catalogue} catalogue @param {string} text @returns {Opened} */
export function fromJson(catalogue, text) {
  let read;
  try {
    read = JSON.parse(text);
  } catch (problem) {
    throw new Unacceptable(`no JSON: ${/** @type {Error} */ (problem).message}`);
  }
  if (read?.format !== FORMAT) throw new Unacceptable(`no design: "format" is not "${FORMAT}"`);
  const of = (/** @type {any} */ values) => changed(catalogue, publishedDesign(catalogue), values ?? {});
  const variants = Array.isArray(read.variants) ? read.variants : [];
  return {
    design: of(read.values),
    variants: variants.map((/** @type {any} */ one) => ({ name: String(one?.name), design: of(one?.values) })),
  };
}

// ---- SSV -------------------------------------------------------------------------------------

/** @param {string} text */
function escaped(text) {
  return text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll('"', "&quot;");
}

/** The FMU's parameters as SSP has them; rate, spacing and ridge, which are none, in an annotation. @param {Catalogue} catalogue @param {Design} design */
export function toSsv(catalogue, design) {
  const parameters = catalogue.parameters.map(
    (q) =>
      `    <ssv:Parameter name="${escaped(q.name)}"><ssv:Real value="${design[q.name]}" unit="${escaped(q.unit)}"/></ssv:Parameter>`,
  );
  const used = [...new Set(catalogue.parameters.map((q) => q.unit))];
  const units = used.map((unit) => {
    const exponents = Object.entries(catalogue.declared.units[unit]?.exponents ?? {});
    return `    <ssc:Unit name="${escaped(unit)}"><ssc:BaseUnit${exponents.map(([base, power]) => ` ${base}="${power}"`).join("")}/></ssc:Unit>`;
  });
  const others = Object.keys(design).filter((name) => !catalogue.variables.has(name) || name === RATE);
  const values = others.map((name) => `        <value name="${escaped(name)}">${design[name]}</value>`);
  return [
    '<?xml version="1.0" encoding="UTF-8"?>',
    `<ssv:ParameterSet xmlns:ssv="${SSV}" xmlns:ssc="${SSC}" version="1.0" name="${escaped(catalogue.model.name)}">`,
    "  <ssv:Parameters>",
    ...parameters,
    "  </ssv:Parameters>",
    "  <ssv:Units>",
    ...units,
    "  </ssv:Units>",
    "  <ssv:Annotations>",
    `    <ssc:Annotation type="${ANNOTATION}">`,
    '      <operation xmlns="">',
    ...values,
    "      </operation>",
    "    </ssc:Annotation>",
    "  </ssv:Annotations>",
    "</ssv:ParameterSet>",
    "",
  ].join("\n");
}

/** Parameters that the page has no control for are passed over. @param {Catalogue} catalogue @param {string} text @returns {Opened} */
export function fromSsv(catalogue, text) {
  const read = new DOMParser().parseFromString(text, "application/xml");
  const broken = read.querySelector("parsererror");
  if (broken) throw new Unacceptable(`no XML: ${(broken.textContent ?? "").trim().split("\n")[0]}`);
  if (read.documentElement.localName !== "ParameterSet") throw new Unacceptable("no SSV: the file has no ParameterSet");
  /** @type {Record<string, number>} */
  const values = {};
  for (const parameter of read.getElementsByTagNameNS(SSV, "Parameter")) {
    const full = parameter.getAttribute("name") ?? "";
    const name = [full, full.slice(full.indexOf(".") + 1)].find((candidate) => catalogue.quantities.has(candidate));
    const value = parameter.getElementsByTagNameNS(SSV, "Real")[0]?.getAttribute("value");
    const unit = parameter.getElementsByTagNameNS(SSV, "Real")[0]?.getAttribute("unit");
    if (!name || value === null || value === undefined) continue;
    const quantity = catalogue.quantities.get(name);
    if (unit && quantity && unit !== quantity.unit)
      throw new Unacceptable(`${full}: the unit is ${unit}, not ${quantity.unit}`);
    values[name] = Number(value);
  }
  for (const value of read.getElementsByTagName("value"))
    values[value.getAttribute("name") ?? ""] = Number(value.textContent);
  return { design: changed(catalogue, publishedDesign(catalogue), values), variants: [] };
}

// ---- CSV -------------------------------------------------------------------------------------

/** The turn with all digits, a row an angle; behind the outputs the design, the same in each row. @param {Design} design @param {Turn} turn */
export function toCsv(design, turn) {
  const names = Object.keys(turn.outputs);
  const rate = design[RATE];
  const constant = Object.keys(design).filter((name) => name !== RATE);
  const rows = [["time", "crank.phi", RATE, "machine.v", ...names, ...constant].join(",")];
  const given = [rate, machineSpeed(design)];
  const same = constant.map((name) => design[name]);
  for (let k = 0; k < turn.phi.length; k += 1)
    rows.push([turn.phi[k] / rate, turn.phi[k], ...given, ...names.map((n) => turn.outputs[n][k]), ...same].join(","));
  return `${rows.join("\n")}\n`;
}

/** The design of a table that the page wrote; undefined where it has none. @param {Catalogue} catalogue @param {string} text */
function fromCsv(catalogue, text) {
  const [names, values] = text.split(/\r?\n/, 2).map((row) => row.split(","));
  const known = names.map((name, k) => /** @type {const} */ ([name, Number(values?.[k])]));
  const design = Object.fromEntries(known.filter(([name]) => catalogue.quantities.has(name)));
  const has = catalogue.parameters.every((q) => q.name in design);
  return has ? { design: changed(catalogue, publishedDesign(catalogue), design), variants: [] } : undefined;
}

// ---- SVG -------------------------------------------------------------------------------------

const STYLED = [
  "fill",
  "fill-opacity",
  "stroke",
  "stroke-width",
  "stroke-dasharray",
  "stroke-linecap",
  "stroke-linejoin",
  "opacity",
  "font-size",
  "font-family",
  "font-weight",
];

/** A drawing of the page by itself: its look written to each element, the design in it. @param {SVGSVGElement} drawing @param {string} unit of its coordinates @param {Design} design @param {string} title */
export function toSvg(drawing, unit, design, title) {
  const copy = /** @type {SVGSVGElement} */ (drawing.cloneNode(true));
  const root = document.documentElement;
  const theme = root.dataset.theme;
  root.dataset.theme = "light"; // paper is white
  const [from, to] = [drawing.querySelectorAll("*"), copy.querySelectorAll("*")];
  from.forEach((element, k) => {
    const style = getComputedStyle(element);
    for (const name of STYLED) to[k].setAttribute(name, style.getPropertyValue(name));
    for (const name of ["class", "tabindex", "role", "id"]) to[k].removeAttribute(name);
  });
  if (theme === undefined) delete root.dataset.theme;
  else root.dataset.theme = theme;
  for (const hidden of copy.querySelectorAll(".screen-only, [data-screen-only]")) hidden.remove();
  const { width, height } = drawing.viewBox.baseVal;
  for (const name of ["class", "id", "role", "style", "aria-labelledby", "aria-label"]) copy.removeAttribute(name);
  copy.setAttribute("width", `${width}${unit}`);
  copy.setAttribute("height", `${height}${unit}`);
  const metadata = document.createElementNS(copy.namespaceURI, "metadata");
  metadata.textContent = JSON.stringify({ format: FORMAT, values: design });
  const heading = document.createElementNS(copy.namespaceURI, "title");
  heading.textContent = title;
  copy.prepend(heading, metadata);
  return `<?xml version="1.0" encoding="UTF-8"?>\n${new XMLSerializer().serializeToString(copy)}\n`;
}

// ---- DXF -------------------------------------------------------------------------------------

/**
 * For the workshop, in mm: pivots and joints of the initial position as circles, links as lines on a layer each with
 * their lengths as text, the tip's static trajectory. The form is that of AutoCAD R12, which all programs read.
 * @param {Design} design @param {Turn} turn @param {Record<string, Point>} places of the initial position
 */
export function toDxf(design, turn, places) {
  const mm = (/** @type {number} */ value) => (value * 1e3).toFixed(6);
  const links = [
    ["OA", "L1"],
    ["AB", "L2"],
    ["DB", "L3"],
    ["CD", "L4"],
    ["DE", "L5"],
    ["EF", "L6"],
    ["GF", "L7"],
    ["HI", "L8"],
    ["IJ", "L9"],
  ];
  const layers = ["PIVOTS", "JOINTS", "LENGTHS", "PATH", ...links.map(([name]) => name)];
  /** @type {(string | number)[]} */
  const out = [];
  const json = JSON.stringify({ format: FORMAT, values: design });
  for (let k = 0; k < json.length; k += DXF_LINE) out.push(999, json.slice(k, k + DXF_LINE));
  out.push(0, "SECTION", 2, "HEADER", 9, "$ACADVER", 1, "AC1009", 9, "$INSUNITS", 70, 4, 0, "ENDSEC");
  out.push(0, "SECTION", 2, "TABLES", 0, "TABLE", 2, "LAYER", 70, layers.length);
  for (const [k, name] of layers.entries()) out.push(0, "LAYER", 2, name, 70, 0, 62, 1 + (k % 7), 6, "CONTINUOUS");
  out.push(0, "ENDTAB", 0, "ENDSEC", 0, "SECTION", 2, "ENTITIES");
  const text = (
    /** @type {string} */ layer,
    /** @type {number} */ x,
    /** @type {number} */ y,
    /** @type {string} */ words,
  ) => out.push(0, "TEXT", 8, layer, 10, mm(x), 20, mm(y), 30, "0.0", 40, "5.0", 1, words);
  for (const [name, length] of links) {
    const [a, b] = [places[name[0]], places[name[1]]];
    out.push(0, "LINE", 8, name, 10, mm(a.x), 20, mm(a.y), 30, "0.0", 11, mm(b.x), 21, mm(b.y), 31, "0.0");
    text(
      "LENGTHS",
      (a.x + b.x) / 2,
      (a.y + b.y) / 2,
      `${length} = ${Number((design[`geometry.${length}`] * 1e3).toFixed(3))}`,
    );
  }
  for (const [name, place] of Object.entries(places)) {
    const layer = "OCG".includes(name) ? "PIVOTS" : "JOINTS";
    out.push(0, "CIRCLE", 8, layer, 10, mm(place.x), 20, mm(place.y), 30, "0.0", 40, "3.0");
    const at =
      layer === "PIVOTS" ? ` (${Number((place.x * 1e3).toFixed(3))}, ${Number((place.y * 1e3).toFixed(3))})` : "";
    text(layer, place.x + 0.004, place.y + 0.004, `${name}${at}`);
  }
  out.push(0, "POLYLINE", 8, "PATH", 66, 1, 70, 1, 10, "0.0", 20, "0.0", 30, "0.0");
  for (let k = 0; k < turn.phi.length - 1; k += 2)
    out.push(0, "VERTEX", 8, "PATH", 10, mm(turn.outputs["tip.x"][k]), 20, mm(turn.outputs["tip.y"][k]), 30, "0.0");
  out.push(0, "SEQEND", 8, "PATH", 0, "ENDSEC", 0, "EOF");
  return `${out.join("\n")}\n`;
}

// ---- any of them -----------------------------------------------------------------------------

/** Read whatever the page has written. @param {Catalogue} catalogue @param {string} text @returns {Opened} */
export function open(catalogue, text) {
  const start = text.trimStart();
  if (start.startsWith("{")) return fromJson(catalogue, text);
  if (start.startsWith("<") && /<svg[\s>]/.test(start)) {
    const metadata = /<metadata[^>]*>[^<]*<\/metadata>/.exec(text)?.[0] ?? "<none/>";
    const json = new DOMParser().parseFromString(metadata, "application/xml").documentElement.textContent;
    if (!json) throw new Unacceptable("this SVG carries no design: it is not from this page");
    return fromJson(catalogue, json);
  }
  if (start.startsWith("<")) return fromSsv(catalogue, text);
  if (start.startsWith("999")) {
    const lines = text.split(/\r?\n/);
    let json = "";
    for (let k = 0; lines[k]?.trim() === "999"; k += 2) json += lines[k + 1];
    return fromJson(catalogue, json);
  }
  const table = fromCsv(catalogue, text);
  if (table) return table;
  throw new Unacceptable("this file carries no design: SSV, JSON, CSV, SVG and DXF files of this page do");
}
