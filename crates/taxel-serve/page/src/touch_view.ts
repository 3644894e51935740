// The view of any device: images of its values, of its readings where they lie in the taxels, a table where they are
// few, and a chart over time.

import { ChannelList, listsChannels } from "./channels";
import type { ColourMap } from "./colour";
import { DIVERGING, GREY, HEAT, SEQUENTIAL } from "./colour";
import { create, symbol } from "./dom";
import { History } from "./history";
import type { Picture } from "./image";
import { drawContacts, drawShear, extremes } from "./image";
import { capitalised, Inspector } from "./inspect";
import type { Journal } from "./journal";
import { Legend } from "./legend";
import { Mark, marksOfStates } from "./marks";
import type { Cell, PanelListener } from "./panel";
import { Panel } from "./panel";
import type { Frame, Hello } from "./protocol";
import { emptyPicture, hasReadingsImage, ReadingsImage } from "./readings";
import { RestValues } from "./rest";
import { Scale } from "./scale";
import { dashOf, lineKey } from "./strip";
import type { Theme } from "./theme";
import { Timeline } from "./timeline";

/** What is to be drawn. */
export interface Scene {
  frame: Frame;
  selected: Cell | null;
  theme: Theme;
  /** ms */
  now: number;
}

/** The scale of a grey image shrinks no further than to this part of the full scale. */
const GREY_FLOOR = 0.1;
/** Without a full scale it shrinks no further than to this part of the largest value that was ever seen. */
const SEEN_FLOOR = 0.2;
/** A force of the other sign is marked from this many of its standard deviations on, as contacts are. */
const CLEAR = 6;

const AXES = ["x", "y", "z"] as const;
/** Numbers of their dashes: pressing, the thickest, is the solid line. */
const AXIS_LINES = [1, 2, 0] as const;
const SHEAR_NOTES = ["shear, positive to the right", "shear, positive upwards"] as const;

export class TouchView {
  readonly panels: readonly Panel[];
  private readonly hello: Hello;
  private readonly journal: Journal;
  private readonly rest = new RestValues();
  private readonly readings: ReadingsImage | null;
  private readonly channels: ChannelList | null;
  /** One image for each component. */
  private readonly values: readonly Panel[];
  private readonly pictures: readonly Picture[];
  private readonly normalScale: Scale;
  private readonly shearScale: Scale;
  private readonly history: History;
  private readonly timeline: Timeline;
  private readonly inspector = new Inspector();
  private readonly legend: Legend;
  private readonly marks: readonly number[];
  private readonly map: ColourMap | null;

  constructor(hello: Hello, root: HTMLElement, listener: PanelListener, journal: Journal) {
    this.hello = hello;
    this.journal = journal;
    this.marks = marksOfStates(hello.states);
    const { rows, columns, components, picture, signed } = hello;
    const grayscale = picture === "grayscale";
    this.map = mapOf(hello);
    const floor = scaleFloor(hello);
    this.normalScale = new Scale(components === 1 && signed && !grayscale ? "symmetric" : "positive", floor);
    // The shears share one scale, so that they can be compared.
    this.shearScale = new Scale("symmetric", floor);
    this.readings = hasReadingsImage(hello) ? new ReadingsImage(hello, this.rest, listener) : null;
    this.channels = listsChannels(hello) ? new ChannelList(hello) : null;
    this.pictures = Array.from({ length: components }, () => emptyPicture(rows, columns, 1));
    this.values = components === 3 ? this.vectorPanels(listener) : [this.valuePanel(listener)];
    this.panels = [...(this.readings === null ? [] : [this.readings.panel]), ...this.values];
    this.legend = new Legend(hello, this.map ?? SEQUENTIAL);
    this.history = new History(components);
    this.timeline = this.channels?.timeline ?? this.totalTimeline(floor);
    const parts = [this.timeline.strip.root, journal.root];
    if (components === 3) {
      const images = create("div", { class: "images" }, ...this.panels.map(({ root: element }) => element));
      const below = create("div", { class: "below" }, ...parts, this.inspector.root);
      root.replaceChildren(images, below, this.legend.root);
      return;
    }
    const beside = create("div", { class: this.channels === null ? "beside" : "channels-beside" });
    if (this.channels !== null) beside.append(this.channels.root);
    beside.append(this.inspector.root, ...parts);
    root.replaceChildren(
      create("div", { class: "map" }, ...this.panels.map(({ root: element }) => element), beside),
      this.legend.root,
    );
  }

  /** Takes every frame that arrives: for the chart. */
  record(frame: Frame): void {
    this.channels?.record(frame);
    const { header } = frame;
    const total = this.hello.force_unit === "N" ? header.force : [Number.NaN, Number.NaN, header.sum];
    const per = this.hello.force_unit === "N" ? this.forceUnit.per : this.hello.value.si_per_unit;
    this.history.push(
      header.time,
      total.slice(3 - this.hello.components).map((value) => value / per),
    );
  }

  /** Takes new rest values, SI. */
  takeRest(rest: readonly (number | null)[]): void {
    this.channels?.takeRest(rest);
    const mean = this.rest.set(rest, this.hello.reading.si_per_unit);
    if (mean !== null) this.readings?.takeRest(mean);
  }

  drawImages({ frame, selected, theme, now }: Scene): void {
    const { hello } = this;
    this.fill(frame);
    this.readings?.draw(frame, selected, theme, now);
    this.values.forEach((panel, axis) => panel.follow(this.pictures[axis] as Picture, now));
    const { rows, columns, pitch_m: pitch, verified, value } = hello;
    this.values.forEach((panel, axis) => {
      const picture = this.pictures[axis] as Picture;
      const normal = axis === this.values.length - 1;
      const map = normal ? (this.map ?? DIVERGING[theme]) : DIVERGING[theme];
      if (!normal) {
        panel.draw(picture, map, selected);
        return;
      }
      panel.draw(picture, map, selected, (context, layout) => {
        if (hello.components === 3) {
          const limit = value.si_per_unit * this.shearScale.high;
          drawShear(context, layout, rows, columns, frame.value, frame.deviation, limit);
        }
        if (pitch !== null) drawContacts(context, layout, rows, columns, pitch, frame.contacts, frame.header);
      });
      panel.markOnBar(verified === null ? null : verified / value.si_per_unit, "The model is trusted up to here");
    });
    this.channels?.show(frame);
  }

  drawStrip(now: number): void {
    const gap = Math.max(this.hello.stale_after_s, 2.5 * (this.hello.period_s ?? 0));
    if (this.channels === null) this.timeline.draw(now, gap);
    else this.channels.drawStrip(now, gap);
  }

  /** Shows the taxel in the inspector; returns the sentence for screen readers. */
  inspect(frame: Frame, cell: Cell): string {
    const sentence = this.inspector.show(this.hello, frame, cell, this.rest.values);
    return this.inspector.withCondition(sentence, this.journal.condition.wordsOf(cell.row * this.hello.columns + cell.column));
  }

  clearInspector(): void {
    this.inspector.clear();
  }

  /** Takes the colours of a new theme. */
  recolour(): void {
    this.journal.condition.draw();
    this.timeline.recolour();
    this.legend.draw();
  }

  private fill(frame: Frame): void {
    const { components, full_scale: fullScale, picture, value } = this.hello;
    this.pictures.forEach(({ values, marks }, axis) => {
      for (let taxel = 0; taxel < values.length; taxel++) {
        const shown = (frame.value[components * taxel + axis] as number) / value.si_per_unit;
        values[taxel] = picture === "grayscale" ? Math.abs(shown) : shown;
        const mark = this.marks[frame.state[taxel] as number] ?? 0;
        // Shear has either sign: only pressing is shown as below zero.
        marks[taxel] = axis < components - 1 ? mark & ~Mark.belowZero : mark;
        const deviation = (frame.deviation[components * taxel + axis] as number) / value.si_per_unit;
        if (picture === "grayscale" && shown < -CLEAR * deviation) marks[taxel] = (marks[taxel] as number) | Mark.pulled;
      }
    });
    if (fullScale !== null) return;
    const { largest } = extremes(this.pictures[components - 1] as Picture);
    if (SEEN_FLOOR * largest > this.normalScale.floor) this.normalScale.floor = SEEN_FLOOR * largest;
  }

  private vectorPanels(listener: PanelListener): Panel[] {
    return AXES.map((axis, index) =>
      this.panel(
        `image-f${axis}`,
        `F ${axis}`,
        symbol("F", axis),
        SHEAR_NOTES[index] ?? "pressing, arrows: shear",
        index < 2 ? this.shearScale : this.normalScale,
        listener,
      ),
    );
  }

  private valuePanel(listener: PanelListener): Panel {
    const { rows, columns, value, picture, signed } = this.hello;
    const label = value.quantity === "raw" ? "Raw values" : capitalised(value.quantity);
    const cell = picture === "map" ? "sensel" : "taxel";
    const taxels = rows * columns === 1 ? `one ${cell}` : `${rows} x ${columns} ${cell}s`;
    const note = picture === "grayscale" && signed ? `${taxels}, brighter: larger; minus: pulled` : taxels;
    return this.panel("image-value", label, label, note, this.normalScale, listener);
  }

  private panel(testId: string, label: string, title: Node | string, note: string, scale: Scale, listener: PanelListener): Panel {
    const { rows, columns, value, picture } = this.hello;
    const [rowPitch, columnPitch] = this.hello.pitch_m ?? [1, 1];
    const aspect = (rows * rowPitch) / (columns * columnPitch);
    const grayscale = picture === "grayscale";
    const options = { testId, label, title: [title], note, unit: value.symbol, rows, columns, aspect, grayscale };
    return new Panel(options, scale, listener);
  }

  /** Unit in which total forces are charted. */
  private get forceUnit(): { symbol: string; per: number } {
    return this.hello.components === 3 ? { symbol: "mN", per: 1e-3 } : { symbol: "N", per: 1 };
  }

  private totalTimeline(floor: number): Timeline {
    const { components, force_unit: unit, value } = this.hello;
    const newtons = unit === "N";
    const title = newtons ? "Total force" : "Sum of values";
    const axes = AXES.slice(3 - components);
    const series = axes.map((axis, line) => ({
      label: components === 3 ? `F ${axis}` : title,
      signal: newtons ? `force_${axis}` : "sum",
      colour: `--axis-${axis}`,
      width: axis === "z" ? 2 : 1.5,
      ...(components === 3 ? dashOf(AXIS_LINES[line] as number) : {}),
    }));
    const key = (axis: string, line: number): HTMLElement =>
      create(
        "span",
        { class: `key axis-${axis}` },
        lineKey(AXIS_LINES[line] as number, `--axis-${axis}`),
        symbol("F", axis),
      );
    const per = newtons ? this.forceUnit.per : value.si_per_unit;
    const timeline = new Timeline({
      title,
      label: title,
      keys: components === 3 ? axes.map(key) : [],
      series,
      signals: "totals",
      shown: (si) => si / per,
      floor: components === 3 ? floor / 4 : 1e-6,
      recent: this.history,
    });
    timeline.setUnit(newtons ? this.forceUnit.symbol : value.symbol);
    return timeline;
  }
}

/** Colours of the image of pressing; null for those of the theme, which show either sign. */
function mapOf({ components, picture, signed }: Hello): ColourMap | null {
  if (components === 3 || picture === "map") return SEQUENTIAL;
  if (picture === "grayscale") return GREY;
  return signed ? null : HEAT;
}

/** Least end of the scale, in shown units: three digits are enough, and there is room for no more. */
function scaleFloor({ full_scale: fullScale, picture, value }: Hello): number {
  if (fullScale === null) return 1e-9;
  // Grey shows how taxels compare, and light touches are most of what they read.
  const least = picture === "grayscale" ? GREY_FLOOR * fullScale : fullScale;
  return Number((least / value.si_per_unit).toPrecision(3));
}
