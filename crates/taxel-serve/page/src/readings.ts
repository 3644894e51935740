// The image of the readings where a taxel has several channels: each where it lies in its taxel.

import type { ColourMap } from "./colour";
import { DIVERGING, SEQUENTIAL } from "./colour";
import { create } from "./dom";
import type { Picture } from "./image";
import { capitalised } from "./inspect";
import { Mark } from "./marks";
import type { Cell, PanelListener } from "./panel";
import { Panel } from "./panel";
import type { Frame, Hello } from "./protocol";
import { RestValues } from "./rest";
import { Scale } from "./scale";
import type { Theme } from "./theme";

/** Smallest width of the scale of readings and of their changes, of the mean of the rest values. */
const READING_FLOOR = 0.1;
const CHANGE_FLOOR = 0.02;

/** Marks of the states of channels, by name. */
const MARKS: Record<string, number> = {
  masked: Mark.masked,
  faulty: Mark.faulty,
  saturated: Mark.faulty,
  closed: Mark.closed,
};

/** Whether a taxel has four channels, which lie in its corners. */
export function hasReadingsImage({ wiring }: Hello): boolean {
  return wiring.kind === "per_taxel" && wiring.channels === 4;
}

export class ReadingsImage {
  readonly panel: Panel;
  private readonly hello: Hello;
  private readonly rest: RestValues;
  private readonly absoluteScale = new Scale("range", 1);
  private readonly changeScale = new Scale("symmetric", 1);
  private readonly picture: Picture;
  private readonly marks: readonly number[];
  private showChange = false;

  constructor(hello: Hello, rest: RestValues, listener: PanelListener) {
    this.hello = hello;
    this.rest = rest;
    this.marks = hello.channel_states.map((state) => MARKS[state] ?? Mark.none);
    const { rows, columns, reading } = hello;
    this.picture = emptyPicture(rows, columns, 2);
    const label = capitalised(reading.quantity);
    const [rowPitch, columnPitch] = hello.pitch_m ?? [1, 1];
    const aspect = (rows * rowPitch) / (columns * columnPitch);
    this.panel = new Panel(
      { testId: "image-raw", label, title: [label], note: "", unit: reading.symbol, rows, columns, aspect },
      this.absoluteScale,
      listener,
    );
    this.panel.head.append(this.changeSwitch(label, listener));
  }

  /** Takes the mean of the rest values in shown units. */
  takeRest(mean: number): void {
    this.absoluteScale.floor = READING_FLOOR * mean;
    this.changeScale.floor = CHANGE_FLOOR * mean;
  }

  draw(frame: Frame, selected: Cell | null, theme: Theme, now: number): void {
    this.fill(frame);
    this.panel.follow(this.picture, now);
    const map: ColourMap = this.showChange ? DIVERGING[theme] : SEQUENTIAL;
    this.panel.draw(this.picture, map, selected);
  }

  /** Puts the channels of each taxel where they lie: the first two above, the others below. */
  private fill(frame: Frame): void {
    const { columns, reading: unit } = this.hello;
    const { values, marks } = this.picture;
    const rest = this.showChange ? this.rest.values : null;
    for (let channel = 0; channel < frame.reading.length; channel++) {
      const taxel = channel >> 2;
      const row = 2 * Math.floor(taxel / columns) + ((channel >> 1) & 1);
      const cell = row * 2 * columns + 2 * (taxel % columns) + (channel & 1);
      const shown = (frame.reading[channel] as number) / unit.si_per_unit;
      values[cell] = rest === null ? shown : shown - (rest[channel] as number);
      marks[cell] = this.marks[frame.channelState[channel] as number] ?? Mark.none;
    }
  }

  /** Two buttons: readings as they are, or their change against rest. */
  private changeSwitch(label: string, listener: PanelListener): HTMLElement {
    const group = create("div", { class: "segments", role: "group", "aria-label": `${label} shown` });
    const add = (text: string, testId: string, title: string, change: boolean): HTMLButtonElement => {
      const button = create("button", { type: "button", "data-testid": testId, title }, text);
      button.addEventListener("click", () => {
        this.showChange = change;
        this.panel.scale = change ? this.changeScale : this.absoluteScale;
        update();
        listener.changed();
      });
      group.append(button);
      return button;
    };
    const absolute = add("value", "raw-absolute", `${label} as measured`, false);
    const against = add(
      "change",
      "raw-change",
      "Change against the rest values of the last tare, or of the drawing",
      true,
    );
    const update = (): void => {
      absolute.setAttribute("aria-pressed", String(!this.showChange));
      against.setAttribute("aria-pressed", String(this.showChange));
    };
    update();
    return group;
  }
}

export function emptyPicture(rows: number, columns: number, block: 1 | 2): Picture {
  const cells = block * block * rows * columns;
  return {
    rows: block * rows,
    columns: block * columns,
    block,
    values: new Float64Array(cells),
    marks: new Uint16Array(cells),
  };
}
