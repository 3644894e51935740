// The condition of each channel: a map of the taxels, and in words what is against them.

import { create, cssValue, setText } from "./dom";
import { seconds } from "./format";
import { taxelName } from "./inspect";
import type { Cell, PanelListener } from "./panel";
import type { Frame, Health, Hello, WrongChannel } from "./protocol";

/** Colours of the conditions, by name; each has a letter too, so that none depends on colour alone. */
const SIGNS: Record<string, [letter: string, colour: string]> = {
  dead: ["D", "--bad"],
  saturated: ["S", "--bad"],
  stuck: ["K", "--bad"],
  noisy: ["N", "--warn"],
  inconsistent: ["I", "--warn"],
};

const NOTHING: Health = { repeated: 0, channels: 0, wrong_channels: 0, wrong: [], swapped: [] };

export class ConditionView {
  readonly root: HTMLElement;
  private readonly canvas: HTMLCanvasElement;
  private readonly list = create("ul", { class: "wrong", "data-testid": "wrong" });
  private readonly summary = create("p", { class: "summary", "data-testid": "condition-summary" });
  private device: Pick<Hello, "rows" | "columns" | "wiring" | "channels" | "states"> = { rows: 1, columns: 1, wiring: { kind: "shared" }, channels: [], states: [] };
  /** Taxels that are not used. */
  private masked: number[] = [];
  private health = NOTHING;
  private current = false;
  /** What is against each taxel. */
  private readonly against = new Map<number, WrongChannel[]>();

  constructor(listener: PanelListener) {
    this.canvas = create("canvas", { class: "condition-map", "data-testid": "condition-map", "aria-hidden": "true" });
    this.canvas.addEventListener("pointermove", (event) => listener.hover(this.cellAt(event)));
    this.canvas.addEventListener("pointerleave", () => listener.hover(null));
    this.canvas.addEventListener("pointerdown", (event) => listener.pick(this.cellAt(event)));
    const words = create("div", { class: "scroll", tabindex: "0" }, this.summary, this.list);
    this.root = create("div", { class: "condition-view", "data-testid": "condition-view" }, this.canvas, words);
  }

  greet(hello: Hello): void {
    this.device = hello;
    this.take(NOTHING);
  }

  take(health: Health): void {
    this.health = health;
    this.against.clear();
    for (const wrong of health.wrong) {
      for (const taxel of wrong.taxels) this.against.set(taxel, [...(this.against.get(taxel) ?? []), wrong]);
    }
    this.show();
    const items = health.wrong.map(({ name, reason, since_ns: since }) =>
      create("li", {}, create("b", {}, name), ` ${reason}, since ${seconds(since)}`),
    );
    for (const { taxel, pairs } of health.swapped) {
      const which = pairs.map(([one, other]) => `${one} and ${other}`).join(", or ");
      items.unshift(create("li", {}, create("b", {}, this.nameOf(taxel)), ` channels changed places: ${which}`));
    }
    this.list.replaceChildren(...items);
  }

  /** Takes the states of the taxels: of one that is not used nothing is known. */
  takeStates(states: Frame["state"]): void {
    const code = this.device.states.indexOf("masked");
    const masked = [...states.keys()].filter((taxel) => states[taxel] === code);
    if (masked.join() === this.masked.join()) return;
    this.masked = masked;
    this.draw();
  }

  /** Whether frames show how the channels are. */
  setCurrent(current: boolean): void {
    this.current = current;
    this.show();
  }

  private show(): void {
    setText(this.summary, this.inWords());
    this.draw();
  }

  /** One line when something is wrong, with the name of a single channel; empty when nothing is. */
  brief(): string {
    const { wrong, wrong_channels: count } = this.health;
    if (count === 0) return "";
    const kinds = [...new Set(wrong.map(({ condition }) => condition))].join(", ");
    return `${count === 1 ? (wrong[0]?.name ?? "1 channel") : `${count} channels`} ${kinds}`;
  }

  /** What is against a taxel, in words. */
  wordsOf(taxel: number): string[] {
    const alike = new Map<string, string[]>();
    for (const { name, reason } of this.against.get(taxel) ?? []) alike.set(reason, [...(alike.get(reason) ?? []), name]);
    const words = [...alike].map(([reason, names]) => `${names.join(", ")}: ${reason}`);
    const swapped = this.health.swapped.find((unit) => unit.taxel === taxel);
    if (swapped !== undefined) {
      words.unshift(`changed places: ${swapped.pairs.map((pair) => pair.join(" and ")).join(", or ")}`);
    }
    return words;
  }

  draw(): void {
    const context = this.canvas.getContext("2d");
    const scale = devicePixelRatio;
    const { rows, columns } = this.device;
    const side = Math.max(3, Math.min(26, Math.floor(120 / Math.max(rows, columns))));
    this.canvas.style.width = `${side * columns}px`;
    this.canvas.style.height = `${side * rows}px`;
    this.canvas.width = Math.round(side * columns * scale);
    this.canvas.height = Math.round(side * rows * scale);
    if (context === null) return;
    const cell = side * scale;
    const gap = side > 6 ? scale : 0;
    const unsaid = this.current && this.health.channels > 0 ? "--well" : "--none";
    this.canvas.dataset["unsaid"] = unsaid;
    this.canvas.dataset["masked"] = this.masked.join();
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.font = `700 ${0.62 * cell}px ${cssValue("--font")}`;
    for (let taxel = 0; taxel < rows * columns; taxel++) {
      const [x, y] = [(taxel % columns) * cell, Math.floor(taxel / columns) * cell];
      const [letter, colour] = SIGNS[this.against.get(taxel)?.[0]?.condition ?? ""] ?? ["", this.masked.includes(taxel) ? "--none" : unsaid];
      context.fillStyle = cssValue(colour);
      context.fillRect(x, y, cell - gap, cell - gap);
      if (letter === "" || side < 10) continue;
      context.fillStyle = cssValue("--panel");
      context.fillText(letter, x + (cell - gap) / 2, y + (cell - gap) / 2 + scale / 2);
    }
  }

  private inWords(): string {
    const { channels, wrong, wrong_channels: count, repeated } = this.health;
    const again = repeated === 0 ? "" : ` ${repeated} frames were sent again and not used.`;
    if (channels === 0) return "Not known yet: no frame has come.";
    const said = this.current ? "" : "No frames come. In the last one ";
    const [verb, none, some] = this.current ? ["is", "Nothing", "Something"] : ["was", "nothing", "something"];
    if (count === 0) return `${said}${none} ${verb} against any of ${channels} channels.${again}`;
    const more = count > wrong.length ? `, the first ${wrong.length}` : "";
    return `${said}${some} ${verb} against ${count} of ${channels} channels${more}.${again}`;
  }

  private nameOf(taxel: number): string {
    const { columns } = this.device;
    return taxelName(this.device, { row: Math.floor(taxel / columns), column: taxel % columns });
  }

  private cellAt(event: PointerEvent): Cell {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const at = (place: number, count: number): number => Math.min(count - 1, Math.max(0, Math.floor(place * count)));
    return {
      row: at((event.clientY - top) / height, this.device.rows),
      column: at((event.clientX - left) / width, this.device.columns),
    };
  }
}
