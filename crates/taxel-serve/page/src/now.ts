// What is read out: the total in type that is read from two metres, with its interval and how much it says.

import { create, setData, setText, symbol } from "./dom";
import { NONE, stateInWords } from "./format";
import { named } from "./layers";
import type { Chosen } from "./channels";
import type { Certainty, Frame, Hello } from "./protocol";
import { Scale } from "./scale";
import type { Quantities, Quantity } from "./units";

const AXES = ["x", "y", "z"] as const;

/** What the large number is: the total force, the sum of a map, the largest value, or the chosen channels. */
export type Subject = "force" | "sum" | "peak" | "channels";

export function subjectOf({ total_known: known, picture, rows, columns }: Hello): Subject {
  if (known) return "force";
  if (picture !== "map") return "peak";
  return Math.min(rows, columns) > 1 ? "sum" : "channels";
}

interface Bar {
  fill: HTMLElement;
  spread: HTMLElement;
  words: HTMLElement;
}

/** Words of the badge, and whether they are a warning. */
function badgeOf(old: boolean, known: boolean, certainty: Certainty): [string, string] {
  if (old) return ["old", "old"];
  if (!known) return ["no zero yet", "unknown"];
  if (certainty === "exact") return ["exact", "exact"];
  return certainty === "at_least" ? ["at least", "at_least"] : ["not known", "unknown"];
}

export class NowView {
  readonly root: HTMLElement;
  readonly subject: Subject;
  private readonly hello: Hello;
  private readonly quantities: Quantities;
  private readonly quantity: Quantity;
  private readonly scale: Scale;
  private readonly label = create("span", { class: "label" });
  private readonly badge = create("span", { class: "certainty", "data-testid": "certainty" });
  private readonly why = create("span", { class: "why", "data-testid": "certainty-reason" });
  private readonly number = create("span", { class: "number" }, NONE);
  private readonly bound = create("span", { class: "bound" });
  private readonly unit = create("span", { class: "unit" });
  private readonly spread = create("span", { class: "spread", "data-testid": "total-deviation" });
  private readonly bars: Bar[] = [];
  private readonly ends = [create("span"), create("span"), create("span")] as const;
  private readonly small = new Map<string, HTMLElement>();
  private readonly list = create("dl", { class: "now-channels", "data-testid": "now-channels" });

  constructor(hello: Hello, quantities: Quantities) {
    this.hello = hello;
    this.quantities = quantities;
    this.subject = subjectOf(hello);
    this.quantity = this.subject === "force" ? quantities.force : quantities.value;
    const three = hello.components === 3;
    const signed = three || hello.signed;
    const floor = this.subject === "force" && three ? (hello.full_scale ?? 1e-18) : 1e-18;
    this.scale = new Scale(signed ? "symmetric" : "positive", floor);
    this.root = create("section", { class: "panel now", "aria-label": "Now", "data-testid": "now" });
    if (this.subject === "channels") {
      this.root.append(create("p", { class: "label" }, "Channels that are charted"), this.list);
      return;
    }
    const figure = create("p", { class: "figure" }, this.bound, this.number, this.unit, this.spread);
    const total = create("div", { class: "total", "data-testid": "total-force" });
    total.append(create("p", { class: "total-head" }, this.label, this.badge, this.why), figure);
    this.root.append(total);
    setText(this.badge, "no frame yet");
    setData(this.root, "certainty", "unknown");
    setText(this.label, { force: three ? "Total force, pressing" : "Total force", sum: "Sum of values", peak: "Largest value", channels: "" }[this.subject]);
    if (this.subject === "peak") setText(this.label, `Largest ${named(hello.value.quantity).toLowerCase()}`);
    this.root.append(this.barsOf(three ? AXES : ["z"], signed));
    // Of one taxel nothing is known of where in it the force acts.
    if (three && hello.rows * hello.columns > 1) this.fact("Moment", "moment", AXES);
    if (hello.wiring.kind !== "shared" && hello.rows * hello.columns > 1 && this.subject !== "peak") this.fact("Centre of pressure", "centre", ["x", "y"]);
    else if (hello.wiring.kind === "shared") this.fact("Position", "centre", ["x", "y"]);
  }

  /** `old` is true where nothing comes any more; `chosen` are the channels that are charted, with their colours. */
  show(frame: Frame, now: number, old: boolean, chosen: readonly Chosen[], nameOf: (taxel: number) => string): void {
    if (this.subject === "channels") {
      this.showChannels(frame, chosen);
      return;
    }
    const { header } = frame;
    const [value, deviation, about] = this.values(frame, nameOf);
    const main = value.length - 1;
    const known = header.zeroKnown && Number.isFinite(value[main] as number);
    const certainty: Certainty = known ? (this.subject === "peak" ? about.certainty : header.totalCertainty) : "unknown";
    const finite = [...value, 0].filter(Number.isFinite);
    if (header.zeroKnown) this.scale.follow(Math.min(...finite), Math.max(...finite), now / 1000);
    const limit = this.scale.high;
    const words = this.quantity.words(value[main] as number, deviation[main], limit);
    setText(this.bound, certainty === "at_least" ? "≥" : "");
    setText(this.number, certainty === "unknown" ? NONE : words.number);
    setText(this.unit, words.symbol);
    setText(this.spread, certainty === "exact" ? words.deviation : "");
    const [text, kind] = badgeOf(old, header.zeroKnown, certainty);
    setText(this.badge, text);
    setData(this.root, "certainty", kind);
    const reason = header.totalReason === null ? "" : stateInWords(this.hello.states[header.totalReason] ?? "");
    setText(this.why, certainty === "exact" ? about.words : header.zeroKnown ? reason : "");
    this.why.title = this.why.textContent ?? "";
    this.bars.forEach((bar, axis) => this.showBar(bar, value[axis] as number, deviation[axis] as number, certainty, header.zeroKnown));
    const { per, symbol: unit } = this.quantity.at(limit);
    const end = String(Number((limit / per).toPrecision(3)));
    const [low, middle, high] = this.ends;
    setText(low, this.scale.kind === "symmetric" ? `\u2212${end}` : "0");
    setText(middle, this.scale.kind === "symmetric" ? "0" : "");
    setText(high, `${end} ${unit}`);
    this.showFacts(frame, certainty);
  }

  private values({ header, value, deviation, state }: Frame, nameOf: (taxel: number) => string): [number[], number[], { words: string; certainty: Certainty }] {
    const about = { words: "", certainty: header.totalCertainty };
    const { components } = this.hello;
    if (this.subject === "force") return [header.force.slice(3 - components), header.forceDeviation.slice(3 - components), about];
    if (this.subject === "sum") return [[header.sum], [Number.NaN], about];
    let peak = 0;
    value.forEach((one, taxel) => {
      if (!(Math.abs(one) <= Math.abs(value[peak] as number))) peak = Number.isFinite(one) ? taxel : peak;
    });
    const words = this.hello.states[state[peak] as number] ?? "";
    const certainty = ["closed", "saturated", "out_of_range"].includes(words) ? "at_least" : words === "ok" || words === "unchecked" ? "exact" : "unknown";
    return [[value[peak] as number], [deviation[peak] as number], { words: nameOf(peak), certainty }];
  }

  private showChannels(frame: Frame, chosen: readonly Chosen[]): void {
    const { channels } = this.hello;
    if (this.list.children.length !== 2 * chosen.length || this.list.dataset["of"] !== chosen.map(({ channel }) => channel).join()) {
      this.list.dataset["of"] = chosen.map(({ channel }) => channel).join();
      this.list.replaceChildren(
        ...chosen.flatMap(({ channel, colour }) => {
          const name = create("dt", {}, channels[channel] ?? "");
          name.style.setProperty("--key", `var(${colour})`);
          return [name, create("dd")];
        }),
      );
    }
    chosen.forEach(({ channel }, at) => {
      const reading = frame.reading[channel] as number;
      setText(this.list.children[2 * at + 1] as HTMLElement, this.quantities.reading.text(reading));
    });
  }

  private showBar({ fill, spread, words }: Bar, value: number, deviation: number, certainty: Certainty, zeroKnown: boolean): void {
    const { low, high } = this.scale;
    const share = (at: number): number => 100 * Math.min(1, Math.max(0, (at - low) / (high - low)));
    const known = zeroKnown && Number.isFinite(value) && certainty !== "unknown";
    const [zero, at] = [share(0), known ? share(value) : share(0)];
    const place = (element: HTMLElement, from: number, to: number): void => {
      element.style.left = `${from.toFixed(2)}%`;
      element.style.width = `${(to - from).toFixed(2)}%`;
    };
    place(fill, Math.min(zero, at), Math.max(zero, at));
    const bound = certainty === "at_least";
    const [from, to] = bound ? [at, 100] : [share(value - 2 * deviation), share(value + 2 * deviation)];
    spread.hidden = !known || !(to > from);
    spread.classList.toggle("open", bound);
    if (!spread.hidden) place(spread, from, to);
    const text = this.quantity.words(value, deviation, high);
    setText(words, known ? `${bound ? "≥ " : ""}${text.number}${bound ? "" : ` ${text.deviation}`}` : NONE);
  }

  private showFacts({ header }: Frame, certainty: Certainty): void {
    const { length, moment } = this.quantities;
    const known = header.zeroKnown && certainty === "exact";
    const sizeOf = (values: readonly number[]): number => Math.max(0, ...values.filter(Number.isFinite).map(Math.abs));
    const momentSize = sizeOf(header.moment);
    AXES.forEach((axis, at) => this.setFact(`moment ${axis}`, known ? moment.text(header.moment[at] as number, Number.NaN, momentSize) : NONE));
    const found = header.zeroKnown && certainty !== "unknown";
    const [xx, , yy] = header.centreCovariance;
    const [rowPitch, columnPitch] = this.hello.pitch_m ?? [1, 1];
    // Positions of one sensor are in one unit, that of its size.
    const size = sizeOf([(rowPitch * this.hello.rows) / 2, (columnPitch * this.hello.columns) / 2]);
    this.setFact("centre x", found ? length.text(header.centre[0], Math.sqrt(xx), size) : NONE);
    this.setFact("centre y", found ? length.text(header.centre[1], Math.sqrt(yy), size) : NONE);
  }

  private setFact(name: string, text: string): void {
    const element = this.small.get(name);
    if (element !== undefined) setText(element, text);
  }

  private barsOf(axes: readonly string[], signed: boolean): HTMLElement {
    const bars = create("div", { class: axes.length === 1 ? "bars single" : "bars", "data-testid": "bars" });
    for (const axis of axes) {
      const bar = { fill: create("span", { class: "fill" }), spread: create("span", { class: "whisker" }), words: create("span", { class: "bar-words" }) };
      const track = create("span", { class: `track axis-${axis}${signed ? " signed" : ""}`, "aria-hidden": "true" }, bar.fill, bar.spread);
      const name = axes.length === 1 ? "" : symbol("F", axis);
      bars.append(create("div", { class: "bar-row" }, create("span", { class: `bar-name axis-${axis}` }, name), track, bar.words));
      this.bars.push(bar);
    }
    bars.append(create("div", { class: "bar-row ends" }, create("span"), create("span", { class: "ends-row" }, ...this.ends), create("span")));
    return bars;
  }

  private fact(label: string, id: string, parts: readonly string[]): void {
    const row = create("p", { class: "fact", "data-testid": id }, create("span", { class: "label" }, label));
    for (const part of parts) {
      const value = create("span", { class: "fact-value" }, NONE);
      this.small.set(`${id} ${part}`, value);
      row.append(create("span", { class: "pair" }, create("i", {}, part), " ", value));
    }
    this.root.append(row);
  }
}
