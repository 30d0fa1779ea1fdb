// @ts-check
// Elements of the page and of its drawings.

const SVG = "http://www.w3.org/2000/svg";

/** @typedef {Record<string, string | number | boolean | undefined>} Attributes */

/** Attributes that are others than they were: the browser draws anew what is written. @param {Element} element @param {Attributes} attributes */
export function put(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    const text = value === undefined || value === false ? null : value === true ? "" : String(value);
    if (element.getAttribute(name) === text) continue;
    if (text === null) element.removeAttribute(name);
    else element.setAttribute(name, text);
  }
  return element;
}

/**
 * @template {keyof HTMLElementTagNameMap} T
 * @param {T} tag @param {Attributes} attributes @param {...(Node | string)} children
 * @returns {HTMLElementTagNameMap[T]}
 */
export function html(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  put(element, attributes);
  element.append(...children);
  return element;
}

/**
 * @template {keyof SVGElementTagNameMap} T
 * @param {T} tag @param {Attributes} attributes @param {...(Node | string)} children
 * @returns {SVGElementTagNameMap[T]}
 */
export function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS(SVG, tag);
  put(element, attributes);
  element.append(...children);
  return element;
}

/** The element with this id, which the page has. @template {Element} [T=HTMLElement] @param {string} id @returns {T} */
export function byId(id) {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no element ${id}`);
  return /** @type {T} */ (/** @type {unknown} */ (found));
}

/** A text that changes, only written when it does. @param {Element} element @param {string} text */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/**
 * So many children of an element, made where they are missing: the browser draws anew what is put in, so what is there
 * stays there.
 * @template {Element} T @param {Element} parent @param {number} count @param {() => T} make @returns {T[]}
 */
export function children(parent, count, make) {
  while (parent.childElementCount < count) parent.append(make());
  while (parent.childElementCount > count) parent.lastElementChild?.remove();
  return /** @type {T[]} */ ([...parent.children]);
}

/** Path data through points, x right and y down, to a hundredth; those that are no numbers are left out. @param {ArrayLike<number>} x @param {ArrayLike<number>} y */
export function line(x, y) {
  let data = "";
  for (let k = 0; k < x.length; k += 1)
    if (Number.isFinite(x[k]) && Number.isFinite(y[k]))
      data += `${data ? "L" : "M"}${Math.round(x[k] * 100) / 100} ${Math.round(y[k] * 100) / 100}`;
  return data;
}

/** A round step: about so many between two values. @param {number} low @param {number} high @param {number} count */
export function roundStep(low, high, count) {
  const rough = (high - low) / count || 1;
  const power = 10 ** Math.floor(Math.log10(rough));
  return power * ([1, 2, 5].find((m) => m * power >= rough) ?? 10);
}

/** The multiples of a step from one value to another. @param {number} low @param {number} high @param {number} step */
export function multiples(low, high, step) {
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) found.push(k * step);
  return found;
}
