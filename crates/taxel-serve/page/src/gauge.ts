// A single taxel is no image: a gauge with its full scale, the value with its interval, and a bound as an open end.

import { create, setText } from "./dom";
import { NONE } from "./format";
import type { Frame, Hello } from "./protocol";
import { roundUp, Scale } from "./scale";
import type { Quantities } from "./units";
import { certain } from "./units";

const SVG = "http://www.w3.org/2000/svg";
/** The arc goes from this angle to its mirror image, rad from the top. */
const END = 2.2;
const RADIUS = 80;
/** Most steps between marks, which stand at round numbers. */
const STEPS = 6;
/** The shown interval: 95 % of a normal distribution, deviations. */
const WITHIN_95 = 1.96;

type Attributes = Record<string, string | number>;

function shape(name: string, attributes: Attributes): SVGElement {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
  return element;
}

function point(share: number, radius: number): [number, number] {
  const angle = END * (2 * share - 1);
  return [100 + radius * Math.sin(angle), 95 - radius * Math.cos(angle)];
}

function arc(from: number, to: number): string {
  const [a, b] = [point(from, RADIUS), point(to, RADIUS)];
  const large = (to - from) * 2 * END > Math.PI ? 1 : 0;
  return `M ${a.join(" ")} A ${RADIUS} ${RADIUS} 0 ${large} 1 ${b.join(" ")}`;
}

export class Gauge {
  readonly root: HTMLElement;
  private readonly hello: Hello;
  private readonly quantities: Quantities;
  private readonly scale: Scale;
  private readonly marks = shape("g", {});
  private readonly value = shape("path", { class: "gauge-value" });
  private readonly interval = shape("path", { class: "gauge-interval" });
  private readonly needle = shape("path", { class: "gauge-needle" });
  private readonly words = create("p", { class: "gauge-words", "data-testid": "gauge-words" });
  private readonly figure = shape("text", { x: 100, y: 96, class: "gauge-figure" });
  private readonly unit = shape("text", { x: 100, y: 114, class: "gauge-unit" });
  private readonly image: SVGElement;
  private drawnHigh = Number.NaN;

  constructor(hello: Hello, quantities: Quantities) {
    this.hello = hello;
    this.quantities = quantities;
    this.scale = new Scale(hello.signed && hello.components === 1 ? "symmetric" : "positive", hello.full_scale ?? 1e-18);
    this.image = shape("svg", { viewBox: "0 0 200 165", class: "gauge", role: "img", "data-testid": "gauge" });
    this.image.append(shape("path", { class: "gauge-track", d: arc(0, 1) }), this.value, this.interval, this.needle, this.figure, this.unit, this.marks);
    this.root = create("div", { class: "frame gauge-frame" }, this.image, this.words);
  }

  private drawMarks(low: number, high: number, per: number): void {
    this.marks.replaceChildren();
    const step = roundUp((high - low) / STEPS);
    for (let number = Math.ceil(low / step - 1e-9); number * step <= high * (1 + 1e-9); number++) {
      const share = (number * step - low) / (high - low);
      const [[x, y], [x1, y1], [x2, y2]] = [point(share, RADIUS - 24), point(share, RADIUS - 8), point(share, RADIUS - 5)];
      const text = shape("text", { x, y: y + 3, class: "gauge-mark" });
      text.textContent = String(Number(((number * step) / per).toPrecision(3))).replace("-", "\u2212");
      this.marks.append(text, shape("line", { x1, y1, x2, y2, class: "gauge-tick" }));
    }
  }

  /** Draws a frame; `read` is true where the numbers that people read change, too. */
  draw(frame: Frame, now: number, read: boolean): void {
    const { components, full_scale: fullScale, states } = this.hello;
    const [value, deviation] = [frame.value, frame.deviation].map((of) => of[components - 1] as number) as [number, number];
    const known = frame.header.zeroKnown && Number.isFinite(value) && frame.header.totalCertainty !== "unknown";
    if (known) this.scale.follow(Math.min(0, value), value, now / 1000);
    const { low, high } = this.scale;
    const { per, symbol } = this.quantities.value.at(high);
    if (high !== this.drawnHigh) {
      this.drawnHigh = high;
      this.drawMarks(low, high, per);
    }
    const share = (at: number): number => Math.min(1, Math.max(0, (at - low) / (high - low)));
    const bound = frame.header.totalCertainty === "at_least";
    const zero = share(0);
    const at = share(value);
    this.value.setAttribute("d", known ? arc(Math.min(zero, at), Math.max(zero, at)) : "");
    const spread = WITHIN_95 * deviation;
    // A bound leaves open how much more there is.
    const [from, to] = bound ? [at, 1] : [share(value - spread), share(value + spread)];
    this.interval.setAttribute("d", known && to > from ? arc(from, to) : "");
    this.interval.classList.toggle("open", bound);
    const [[x1, y1], [x2, y2]] = [point(at, RADIUS - 10), point(at, RADIUS + 10)];
    this.needle.setAttribute("d", known ? `M ${x1} ${y1} L ${x2} ${y2}` : "");
    if (!read) return;
    const state = states[frame.state[0] as number] ?? "";
    const words = known ? certain(this.quantities.value.text(value, bound ? Number.NaN : deviation, high), frame.header.totalCertainty) : frame.header.zeroKnown ? "not known" : "no zero yet";
    const full = fullScale === null ? "" : `; full scale ${this.quantities.value.text(fullScale)}`;
    const { number, deviation: around } = this.quantities.value.words(value, bound ? Number.NaN : deviation, high);
    this.figure.textContent = known ? `${bound ? "≥ " : ""}${number}` : NONE;
    this.unit.textContent = known && !bound ? `${around} ${symbol}` : symbol;
    this.image.setAttribute("aria-label", `${words}, ${state}${full}`);
    setText(this.words, fullScale === null ? "" : `full scale ${this.quantities.value.text(fullScale)}`);
  }
}
