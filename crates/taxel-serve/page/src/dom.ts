// Small helpers for the document. Text from the server is only ever set as text.

type Attributes = Record<string, string>;

/** A new element with attributes and children. */
export function create<Name extends keyof HTMLElementTagNameMap>(
  name: Name,
  attributes: Attributes = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[Name] {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

/** An element of index.html. */
export function byId<Kind extends HTMLElement = HTMLElement>(id: string): Kind {
  const element = document.getElementById(id);
  if (element === null) throw new Error(`index.html has no element #${id}`);
  return element as Kind;
}

/** Sets text only if it changed, so that nothing is laid out again for nothing. */
export function setText(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

/** A symbol with a subscript, such as F with x. */
export function symbol(letter: string, subscript: string): HTMLElement {
  return create("span", { class: "symbol" }, create("i", {}, letter), create("sub", {}, subscript));
}

/** Sets a `data-` attribute only if it changed: a picture is drawn without the page being styled anew. */
export function setData(element: HTMLElement, key: string, value: string): void {
  if (element.dataset[key] !== value) element.dataset[key] = value;
}

const cssValues = new Map<string, string>();

/** Value of a CSS custom property of the page, read once for each theme. */
export function cssValue(name: string): string {
  let value = cssValues.get(name);
  if (value === undefined) {
    value = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    cssValues.set(name, value);
  }
  return value;
}

/** For a new theme. */
export function forgetCssValues(): void {
  cssValues.clear();
}
