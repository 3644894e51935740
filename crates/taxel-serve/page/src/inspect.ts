// The panel that says everything about one taxel.

import { create, symbol } from "./dom";
import { compact, decimalsFor, fixed, NONE, stateInWords, withDeviation } from "./format";
import type { Cell } from "./panel";
import type { Frame, Hello } from "./protocol";

const AXES = ["x", "y", "z"] as const;

export class Inspector {
  readonly root: HTMLElement;
  private readonly content = create("div", { class: "inspect-content" });
  private readonly place = create("span", { class: "note" });

  constructor() {
    const head = create("div", { class: "panel-head" }, create("h2", {}, "Taxel"), this.place);
    this.root = create(
      "section",
      { class: "panel inspect", "data-testid": "inspect", "aria-label": "Inspected taxel" },
      head,
      this.content,
    );
    this.clear();
  }

  clear(): void {
    this.place.textContent = "";
    this.content.replaceChildren(
      create("p", { class: "hint" }, "Point at a taxel, tap it, or move with the arrow keys in an image."),
    );
  }

  /** Adds what is against the taxel's channels; returns the sentence with it. */
  withCondition(sentence: string, words: readonly string[]): string {
    if (words.length === 0) return sentence;
    const text = words.join("; ");
    const line = create("p", { class: "against", title: text, "data-testid": "inspect-condition" }, text);
    this.content.querySelector(".state")?.after(line);
    return `${sentence}, ${text}`;
  }

  /** Shows a taxel, with its channels at `rest` in shown units; returns the sentence for screen readers. */
  show(hello: Hello, frame: Frame, cell: Cell, rest: Float64Array | null): string {
    const taxel = cell.row * hello.columns + cell.column;
    const state = hello.states[frame.state[taxel] as number] ?? "unknown";
    this.place.textContent = `row ${cell.row}, column ${cell.column}`;
    const facts: [string, string][] = [];
    const parts: HTMLElement[] = [];
    const spoken: string[] = [];
    if (hello.components === 3) parts.push(vectorTable(hello, frame, taxel, spoken));
    else {
      const shown = valueInWords(hello, frame, taxel);
      facts.push([hello.value.quantity === "raw" ? "Value" : capitalised(hello.value.quantity), shown]);
      spoken.push(shown);
    }
    const { wiring } = hello;
    if (wiring.kind === "per_taxel" && wiring.channels > 1) {
      const own = Array.from({ length: wiring.channels }, (_, index) => wiring.channels * taxel + index);
      parts.push(channelTable(hello, frame, own, rest));
      const residual = frame.residual[taxel] as number;
      const named = (wanted: string): string => {
        const found = own.filter((channel) => hello.channel_states[frame.channelState[channel] as number] === wanted);
        return found.length === 0 ? "none" : found.map((channel) => shortName(hello, channel)).join(", ");
      };
      facts.push(["Residual", Number.isFinite(residual) ? `${fixed(residual, 2)} σ` : "no check"]);
      facts.push(["Closed", named("closed")], ["Faulty", named("faulty")]);
    }
    const contact = frame.contacts.find(({ peakTaxel }) => peakTaxel === taxel);
    if (contact !== undefined && hello.components === 1) facts.push(["Contact", peakOf(contact.id)]);
    const list = factList(facts);
    const content = parts.length === 0 ? list : create("div", { class: "inspect-columns" }, ...parts, list);
    this.content.replaceChildren(stateLine(state), content);
    return `row ${cell.row}, column ${cell.column}: ${spoken.join(", ")}, ${stateInWords(state)}`;
  }
}

/** Force along each axis with its deviation. */
function vectorTable(hello: Hello, frame: Frame, taxel: number, spoken: string[]): HTMLElement {
  const { symbol: unit, si_per_unit: per } = hello.value;
  const forces = create("table", { class: "forces" });
  forces.append(headRow("", unit, "± σ"));
  AXES.forEach((axis, index) => {
    const value = (frame.value[3 * taxel + index] as number) / per;
    const deviation = (frame.deviation[3 * taxel + index] as number) / per;
    const row = create("tr", {}, create("th", { scope: "row" }, symbol("F", axis)));
    row.append(create("td", {}, fixed(value, 2)));
    row.append(create("td", {}, Number.isFinite(value) ? `± ${fixed(deviation, 2)}` : NONE));
    forces.append(row);
    spoken.push(`F ${axis} ${withDeviation(value, deviation, 2)} ${unit}`);
  });
  return forces;
}

/** Readings of the channels of a taxel, and their change against rest. */
function channelTable(hello: Hello, frame: Frame, channels: readonly number[], rest: Float64Array | null): HTMLElement {
  const { symbol: unit, si_per_unit: per } = hello.reading;
  const table = create("table", { class: "capacitors" });
  table.append(headRow("", unit, rest === null ? "" : "change"));
  for (const channel of channels) {
    const value = (frame.reading[channel] as number) / per;
    const change = rest === null ? "" : fixed(value - (rest[channel] as number), 2);
    const row = create("tr", {}, create("th", { scope: "row" }, symbol("C", shortName(hello, channel))));
    if (!USABLE.includes(hello.channel_states[frame.channelState[channel] as number] ?? "")) row.className = "bad";
    row.append(create("td", {}, fixed(value, 2)), create("td", {}, change));
    table.append(row);
  }
  return table;
}

/** States of channels whose reading is used. */
const USABLE = ["ok", "closed"];

/** Name of a channel within its taxel: `11` of `r0c0.11`. */
function shortName(hello: Hello, channel: number): string {
  const name = hello.channels[channel] ?? "";
  return name.slice(name.lastIndexOf(".") + 1);
}

/** The value of a taxel of one component, in its unit. */
function valueInWords(hello: Hello, frame: Frame, taxel: number): string {
  const { symbol: unit, si_per_unit: per } = hello.value;
  const value = (frame.value[taxel] as number) / per;
  const deviation = (frame.deviation[taxel] as number) / per;
  if (!Number.isFinite(value)) return "no value";
  const decimals = hello.full_scale === null ? null : decimalsFor(hello.full_scale / per);
  if (decimals === null) return `${Number.isInteger(value) ? fixed(value, 0) : compact(value)} ${unit}`;
  return `${Number.isFinite(deviation) ? withDeviation(value, deviation, decimals) : fixed(value, decimals)} ${unit}`;
}

function peakOf(id: number): string {
  return id > 0 ? `peak of contact ${id}` : "peak of a contact";
}

/** With a capital letter at its beginning. */
export function capitalised(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

function stateLine(state: string): HTMLElement {
  const good = state === "ok";
  const line = create("p", { class: good ? "state good" : "state", "data-testid": "inspect-state" });
  line.append(stateInWords(state));
  return line;
}

function headRow(...names: string[]): HTMLElement {
  const cells = names.map((name) =>
    create(name === "" ? "td" : "th", name === "" ? {} : { scope: "col" }, name),
  );
  return create("tr", { class: "units" }, ...cells);
}

function factList(facts: [string, string][]): HTMLElement {
  const list = create("dl", { class: "facts" });
  for (const [name, value] of facts) list.append(create("dt", {}, name), create("dd", {}, value));
  return list;
}
