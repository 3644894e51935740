// The panel that says everything about one taxel.

import { create, symbol } from "./dom";
import {
  capacitorNames,
  compact,
  decimalsFor,
  fixed,
  NONE,
  signalStateInWords,
  stateInWords,
  withDeviation,
} from "./format";
import type { Cell } from "./panel";
import type { Hello, MapFrame, SignalsFrame, SignalsMeaning, ThreeAxisFrame } from "./protocol";

const CAPACITORS = ["11", "12", "21", "22"] as const;
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

  /** Shows a taxel of a three-axis array; returns the sentence for screen readers. */
  showThreeAxis(hello: Hello, frame: ThreeAxisFrame, cell: Cell, rest: Float64Array | null): string {
    const taxel = cell.row * hello.columns + cell.column;
    const state = hello.states[frame.state[taxel] as number] ?? "unknown";
    this.place.textContent = `row ${cell.row}, column ${cell.column}`;
    const { symbol: unit, si_per_unit: per } = hello.unit;
    const capacitors = create("table", { class: "capacitors" });
    capacitors.append(headRow("", unit, rest === null ? "" : "change"));
    const [touching, faulty] = [frame.touching[taxel] as number, frame.faulty[taxel] as number];
    CAPACITORS.forEach((name, index) => {
      const value = (frame.capacitance[4 * taxel + index] as number) / per;
      const change = rest === null ? "" : fixed(value - (rest[4 * taxel + index] as number), 2);
      const row = create("tr", {}, create("th", { scope: "row" }, symbol("C", name)));
      if (faulty & (1 << index)) row.className = "bad";
      row.append(create("td", {}, fixed(value, 2)), create("td", {}, change));
      capacitors.append(row);
    });
    const forces = create("table", { class: "forces" });
    forces.append(headRow("", "mN", "± σ"));
    const spoken: string[] = [];
    AXES.forEach((axis, index) => {
      const value = 1e3 * (frame.force[3 * taxel + index] as number);
      const deviation = 1e3 * (frame.deviation[3 * taxel + index] as number);
      const row = create("tr", {}, create("th", { scope: "row" }, symbol("F", axis)));
      row.append(create("td", {}, fixed(value, 2)));
      row.append(create("td", {}, Number.isFinite(value) ? `± ${fixed(deviation, 2)}` : NONE));
      forces.append(row);
      spoken.push(`F ${axis} ${withDeviation(value, deviation, 2)} mN`);
    });
    const residual = frame.residual[taxel] as number;
    const facts = factList([
      ["Residual", Number.isFinite(residual) ? `${fixed(residual, 2)} σ` : "no check"],
      ["Touching", capacitorNames(touching)],
      ["Faulty", capacitorNames(faulty)],
    ]);
    const columns = create("div", { class: "inspect-columns" }, forces, capacitors, facts);
    this.content.replaceChildren(stateLine(state), columns);
    return `row ${cell.row}, column ${cell.column}: ${spoken.join(", ")}, ${stateInWords(state)}`;
  }

  /** Shows a sensel of a pressure map; returns the sentence for screen readers. */
  showMap(hello: Hello, frame: MapFrame, cell: Cell): string {
    const taxel = cell.row * hello.columns + cell.column;
    const state = hello.states[frame.state[taxel] as number] ?? "unknown";
    const value = (frame.value[taxel] as number) / hello.unit.si_per_unit;
    const { quantity, symbol: unit } = hello.unit;
    this.place.textContent = `row ${cell.row}, column ${cell.column}`;
    const shown = Number.isFinite(value)
      ? `${Number.isInteger(value) ? fixed(value, 0) : compact(value)} ${unit}`
      : state === "masked"
        ? "no sensel here"
        : "no reading";
    const name = quantity === "raw" ? "Value" : capitalised(quantity);
    const contact = frame.contacts.find(({ peakTaxel }) => peakTaxel === taxel);
    const facts: [string, string][] = [[name, shown]];
    if (contact !== undefined) facts.push(["Contact", peakOf(contact.id)]);
    this.content.replaceChildren(stateLine(state), factList(facts));
    return `row ${cell.row}, column ${cell.column}: ${shown}, ${stateInWords(state)}`;
  }

  /** Shows a taxel of a device with one value per taxel; returns the sentence for screen readers. */
  showSignal(hello: Hello, meaning: SignalsMeaning, frame: SignalsFrame, cell: Cell): string {
    const taxel = cell.row * hello.columns + cell.column;
    const state = hello.states[frame.state[taxel] as number] ?? "unknown";
    const { quantity, symbol: unit, si_per_unit: per } = meaning.value;
    this.place.textContent = `row ${cell.row}, column ${cell.column}`;
    const value = (frame.value[taxel] as number) / per;
    const deviation = (frame.deviation[taxel] as number) / per;
    const decimals = decimalsFor(meaning.full_scale / per);
    const number = Number.isFinite(deviation) ? withDeviation(value, deviation, decimals) : fixed(value, decimals);
    const shown = Number.isFinite(value) ? `${number} ${unit}` : "no value";
    const contact = frame.contacts.find(({ peakTaxel }) => peakTaxel === taxel);
    const facts: [string, string][] = [[capitalised(quantity), shown]];
    if (contact !== undefined) facts.push(["Contact", peakOf(contact.id)]);
    this.content.replaceChildren(factList(facts), stateLine(state, signalStateInWords(state)));
    return `row ${cell.row}, column ${cell.column}: ${shown}, ${signalStateInWords(state)}`;
  }
}

function peakOf(id: number): string {
  return id > 0 ? `peak of contact ${id}` : "peak of a contact";
}

/** With a capital letter at its beginning. */
export function capitalised(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

function stateLine(state: string, words = stateInWords(state)): HTMLElement {
  const good = state === "ok";
  const line = create("p", { class: good ? "state good" : "state", "data-testid": "inspect-state" });
  line.append(words);
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
