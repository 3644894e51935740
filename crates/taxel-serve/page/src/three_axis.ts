// A three-axis array: raw capacitances, F_x, F_y, F_z side by side.

import { DIVERGING, SEQUENTIAL } from "./colour";
import { create, symbol } from "./dom";
import { History } from "./history";
import type { Picture } from "./image";
import { drawContacts, drawShear } from "./image";
import { Inspector } from "./inspect";
import type { Journal } from "./journal";
import { Legend } from "./legend";
import { Mark, marksOfStates } from "./marks";
import type { Cell, PanelListener } from "./panel";
import { Panel } from "./panel";
import type { Frame, Hello, ThreeAxisFrame } from "./protocol";
import { RestValues } from "./rest";
import { Scale } from "./scale";
import { Strip } from "./strip";
import type { Scene, View } from "./view";

/** Scale of the images of force where the server states none, mN. */
const FULL_SCALE = 10;

/** Smallest width of the raw scale, of the mean of the rest values. */
const RAW_FLOOR = 0.1;
const CHANGE_FLOOR = 0.02;

export class ThreeAxisView implements View {
  readonly panels: readonly Panel[];
  private readonly hello: Hello;
  private readonly journal: Journal;
  private readonly raw: Panel;
  private readonly shear: readonly [Panel, Panel];
  private readonly normal: Panel;
  private readonly absoluteScale: Scale;
  private readonly changeScale: Scale;
  private readonly shearScale: Scale;
  private readonly rest = new RestValues();
  private readonly history = new History(3);
  private readonly strip: Strip;
  private readonly inspector = new Inspector();
  private readonly legend = new Legend("three_axis");
  private readonly marks: readonly number[];
  private readonly rawPicture: Picture;
  private readonly forcePictures: readonly [Picture, Picture, Picture];
  private showChange = false;

  constructor(hello: Hello, root: HTMLElement, listener: PanelListener, journal: Journal) {
    this.hello = hello;
    this.journal = journal;
    this.marks = marksOfStates(hello.states);
    const { rows, columns } = hello;
    this.rawPicture = emptyPicture(rows, columns, 2);
    this.forcePictures = [
      emptyPicture(rows, columns, 1),
      emptyPicture(rows, columns, 1),
      emptyPicture(rows, columns, 1),
    ];
    const floor = hello.full_scale_n === null ? FULL_SCALE : 1e3 * hello.full_scale_n;
    this.absoluteScale = new Scale("range", 1);
    this.changeScale = new Scale("symmetric", 1);
    this.shearScale = new Scale("symmetric", floor);
    const [rowPitch, columnPitch] = hello.pitch_m ?? [1, 1];
    const aspect = (rows * rowPitch) / (columns * columnPitch);
    const panel = (
      testId: string,
      label: string,
      title: Node | string,
      note: string,
      unit: string,
      scale: Scale,
    ) => new Panel({ testId, label, title: [title], note, unit, rows, columns, aspect }, scale, listener);
    const { symbol: rawUnit } = hello.unit;
    this.raw = panel("image-raw", "Capacitance", "Capacitance", "", rawUnit, this.absoluteScale);
    this.shear = [
      panel("image-fx", "F x", symbol("F", "x"), "shear, positive to the right", "mN", this.shearScale),
      panel("image-fy", "F y", symbol("F", "y"), "shear, positive upwards", "mN", this.shearScale),
    ];
    this.normal = panel(
      "image-fz",
      "F z",
      symbol("F", "z"),
      "pressing, arrows: shear",
      "mN",
      new Scale("positive", floor),
    );
    this.raw.head.append(this.changeSwitch(listener));
    this.panels = [this.raw, ...this.shear, this.normal];
    const heading = create("div", { class: "panel-head" }, create("h2", {}, "Total force"));
    heading.append(create("span", { class: "note" }, "mN, last 10 s"));
    for (const axis of ["x", "y", "z"] as const) {
      heading.append(create("span", { class: `key axis-${axis}` }, symbol("F", axis)));
    }
    const series = [
      { label: "F x", colour: "--axis-x", width: 1.5 },
      { label: "F y", colour: "--axis-y", width: 1.5 },
      { label: "F z", colour: "--axis-z", width: 2 },
    ];
    this.strip = new Strip(
      heading,
      "Total force over the last 10 s, mN",
      series,
      this.history.span,
      floor / 4,
    );
    const images = create("div", { class: "images" }, ...this.panels.map(({ root: element }) => element));
    const below = create("div", { class: "below" }, this.strip.root, journal.root, this.inspector.root);
    root.replaceChildren(images, below, this.legend.root);
  }

  record(frame: Frame): void {
    if (frame.kind !== 1) return;
    this.history.push(
      frame.header.time,
      frame.header.force.map((force) => 1e3 * force),
    );
  }

  takeRest(capacitance: readonly (number | null)[]): void {
    const mean = this.rest.set(capacitance, this.hello.unit.si_per_unit);
    if (mean !== null) {
      this.absoluteScale.floor = RAW_FLOOR * mean;
      this.changeScale.floor = CHANGE_FLOOR * mean;
    }
  }

  drawImages({ frame, selected, theme, now }: Scene): void {
    if (frame.kind !== 1) return;
    this.fillRaw(frame);
    this.fillForces(frame);
    const [shearX, shearY, normal] = this.forcePictures;
    this.raw.follow(this.rawPicture, now);
    // The shears share one scale, so that they can be compared.
    this.shear[0].follow(shearX, now);
    this.shear[1].follow(shearY, now);
    this.normal.follow(normal, now);
    const diverging = DIVERGING[theme];
    this.raw.draw(this.rawPicture, this.showChange ? diverging : SEQUENTIAL, selected);
    this.shear[0].draw(shearX, diverging, selected);
    this.shear[1].draw(shearY, diverging, selected);
    const { rows, columns, pitch_m: pitch, usable_force_n: usable } = this.hello;
    this.normal.draw(normal, SEQUENTIAL, selected, (context, layout) => {
      drawShear(context, layout, rows, columns, frame.force, frame.deviation, 1e-3 * this.shearScale.high);
      if (pitch !== null) drawContacts(context, layout, rows, columns, pitch, frame.contacts, frame.header);
    });
    this.normal.markOnBar(usable === null ? null : 1e3 * usable, "The model is trusted up to here");
  }

  drawStrip(now: number): void {
    this.strip.draw(
      this.history.columns(Math.max(this.hello.stale_after_s, 2.5 * (this.hello.period_s ?? 0))),
      now,
    );
  }

  inspect(frame: Frame, cell: Cell): string {
    if (frame.kind !== 1) return "";
    const sentence = this.inspector.showThreeAxis(this.hello, frame, cell, this.rest.values);
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

  sum(): number {
    return Number.NaN;
  }

  /** Puts the capacitors of each taxel where they lie: 11 and 12 above, 21 and 22 below. */
  private fillRaw(frame: ThreeAxisFrame): void {
    const { columns, unit } = this.hello;
    const { values, marks } = this.rawPicture;
    const rest = this.showChange ? this.rest.values : null;
    for (let capacitor = 0; capacitor < frame.capacitance.length; capacitor++) {
      const taxel = capacitor >> 2;
      const row = 2 * Math.floor(taxel / columns) + ((capacitor >> 1) & 1);
      const cell = row * 2 * columns + 2 * (taxel % columns) + (capacitor & 1);
      const bit = 1 << (capacitor & 3);
      const shown = (frame.capacitance[capacitor] as number) / unit.si_per_unit;
      values[cell] = rest === null ? shown : shown - (rest[capacitor] as number);
      const masked = ((this.marks[frame.state[taxel] as number] ?? 0) & Mark.masked) !== 0;
      marks[cell] = masked
        ? Mark.masked
        : ((frame.faulty[taxel] as number) & bit ? Mark.faulty : 0) |
          ((frame.touching[taxel] as number) & bit ? Mark.contact : 0);
    }
  }

  private fillForces(frame: ThreeAxisFrame): void {
    this.forcePictures.forEach(({ values, marks }, axis) => {
      for (let taxel = 0; taxel < values.length; taxel++) {
        values[taxel] = 1e3 * (frame.force[3 * taxel + axis] as number);
        marks[taxel] = this.marks[frame.state[taxel] as number] ?? 0;
      }
    });
  }

  /** Two buttons: capacitance as it is, or its change against rest. */
  private changeSwitch(listener: PanelListener): HTMLElement {
    const group = create("div", { class: "segments", role: "group", "aria-label": "Capacitance shown" });
    const add = (label: string, testId: string, title: string, change: boolean): HTMLButtonElement => {
      const button = create("button", { type: "button", "data-testid": testId, title }, label);
      button.addEventListener("click", () => {
        this.showChange = change;
        this.raw.scale = change ? this.changeScale : this.absoluteScale;
        update();
        listener.changed();
      });
      group.append(button);
      return button;
    };
    const absolute = add("value", "raw-absolute", "Capacitance as measured", false);
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

function emptyPicture(rows: number, columns: number, block: 1 | 2): Picture {
  const cells = block * block * rows * columns;
  return {
    rows: block * rows,
    columns: block * columns,
    block,
    values: new Float64Array(cells),
    marks: new Uint16Array(cells),
  };
}
