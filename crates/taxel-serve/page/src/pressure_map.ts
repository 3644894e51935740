// A pressure map: one image with its unit, the total beside it.

import { SEQUENTIAL } from "./colour";
import { create } from "./dom";
import { History } from "./history";
import type { Picture } from "./image";
import { drawContacts, extremes } from "./image";
import { Inspector } from "./inspect";
import type { Journal } from "./journal";
import { Legend } from "./legend";
import { Mark, marksOfStates } from "./marks";
import type { Cell, PanelListener } from "./panel";
import { Panel } from "./panel";
import type { Frame, Hello } from "./protocol";
import { Scale } from "./scale";
import { Strip } from "./strip";
import type { Scene, View } from "./view";

/** The scale shrinks no further than to this part of the largest value that was ever seen. */
const FLOOR = 0.2;

export class PressureMapView implements View {
  readonly panels: readonly Panel[];
  private readonly hello: Hello;
  private readonly journal: Journal;
  private readonly image: Panel;
  private readonly scale = new Scale("positive", 1e-9);
  private readonly history = new History(1);
  private readonly strip: Strip;
  private readonly inspector = new Inspector();
  private readonly legend = new Legend("pressure_map");
  private readonly marks: readonly number[];
  private readonly picture: Picture;

  constructor(hello: Hello, root: HTMLElement, listener: PanelListener, journal: Journal) {
    this.hello = hello;
    this.journal = journal;
    this.marks = marksOfStates(hello.states);
    const { rows, columns, unit } = hello;
    this.picture = {
      rows,
      columns,
      block: 1,
      values: new Float64Array(rows * columns),
      marks: new Uint16Array(rows * columns),
    };
    const [rowPitch, columnPitch] = hello.pitch_m ?? [1, 1];
    const aspect = (rows * rowPitch) / (columns * columnPitch);
    const label = unit.quantity === "pressure" ? "Pressure" : "Raw values";
    const note = `${rows} x ${columns} sensels`;
    this.image = new Panel(
      { testId: "image-map", label, title: [label], note, unit: unit.symbol, rows, columns, aspect },
      this.scale,
      listener,
    );
    this.panels = [this.image];
    const title = hello.total_force_known ? "Total force" : "Sum of values";
    const totalUnit = hello.total_force_known ? "N" : unit.symbol;
    const heading = create("div", { class: "panel-head" }, create("h2", {}, title));
    heading.append(create("span", { class: "note" }, `${totalUnit}, last 10 s`));
    const series = [{ label: title, colour: "--axis-z", width: 2 }];
    this.strip = new Strip(
      heading,
      `${title} over the last 10 s, ${totalUnit}`,
      series,
      this.history.span,
      1e-6,
    );
    const beside = create("div", { class: "beside" }, this.inspector.root, this.strip.root, journal.root);
    root.replaceChildren(create("div", { class: "map" }, this.image.root, beside), this.legend.root);
  }

  record(frame: Frame): void {
    if (frame.kind !== 2) return;
    const total = this.hello.total_force_known ? frame.header.force[2] : this.sum(frame);
    this.history.push(frame.header.time, [total]);
  }

  takeRest(): void {
    // A map comes with its rest values already taken off.
  }

  drawImages({ frame, selected, now }: Scene): void {
    if (frame.kind !== 2) return;
    const { values, marks } = this.picture;
    for (let cell = 0; cell < values.length; cell++) {
      values[cell] = (frame.value[cell] as number) / this.hello.unit.si_per_unit;
      const state = this.marks[frame.state[cell] as number] ?? 0;
      // A map has nothing to check its values with; only what is unusual is marked.
      marks[cell] = state & ~Mark.unchecked;
    }
    const { largest } = extremes(this.picture);
    if (FLOOR * largest > this.scale.floor) this.scale.floor = FLOOR * largest;
    const { rows, columns, pitch_m: pitch } = this.hello;
    this.image.follow(this.picture, now);
    this.image.draw(this.picture, SEQUENTIAL, selected, (context, layout) => {
      if (pitch !== null) drawContacts(context, layout, rows, columns, pitch, frame.contacts, frame.header);
    });
  }

  drawStrip(now: number): void {
    this.strip.draw(
      this.history.columns(Math.max(this.hello.stale_after_s, 2.5 * (this.hello.period_s ?? 0))),
      now,
    );
  }

  inspect(frame: Frame, cell: Cell): string {
    if (frame.kind !== 2) return "";
    const sentence = this.inspector.showMap(this.hello, frame, cell);
    return this.inspector.withCondition(sentence, this.journal.condition.wordsOf(cell.row * this.hello.columns + cell.column));
  }

  clearInspector(): void {
    this.inspector.clear();
  }

  recolour(): void {
    this.journal.condition.draw();
    this.strip.recolour();
    this.legend.draw();
  }

  sum(frame: Frame): number {
    if (frame.kind !== 2) return Number.NaN;
    let sum = 0;
    for (const value of frame.value) if (!Number.isNaN(value)) sum += value;
    return sum / this.hello.unit.si_per_unit;
  }
}
