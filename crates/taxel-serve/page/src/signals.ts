// One value per taxel: the image of the taxels, and beside it the channels it was found from.

import { changeInUnit, changeOf } from "./change";
import type { ColourMap } from "./colour";
import { DIVERGING, GREY, HEAT } from "./colour";
import { create, setText } from "./dom";
import { decimalsFor, fixed } from "./format";
import { History } from "./history";
import type { Picture } from "./image";
import { drawContacts } from "./image";
import { capitalised, Inspector } from "./inspect";
import type { Journal } from "./journal";
import { Legend } from "./legend";
import { marksOfStates } from "./marks";
import type { Cell, PanelListener } from "./panel";
import { Panel } from "./panel";
import type { Frame, Hello, SignalsFrame, SignalsMeaning } from "./protocol";
import { Scale } from "./scale";
import { Strip } from "./strip";
import type { Theme } from "./theme";
import type { Scene, View } from "./view";

/** More lines than this cannot be told apart. */
const MOST_LINES = 8;
/** From this line on they are dashed. */
const FIRST_DASHED = 4;
const DASH = [7, 4];

/** Smallest width of the scale of the chart: in per cent, or of the largest signal that was seen. */
const FLOOR_PER_CENT = 1;
const FLOOR_SHARE = 0.02;

interface Row {
  signal: HTMLElement;
  change: HTMLElement;
}

/** The scale of a grey image shrinks no further than to this part of the full scale. */
const GREY_FLOOR = 0.1;

export class SignalsView implements View {
  readonly panels: readonly Panel[];
  private readonly hello: Hello;
  private readonly journal: Journal;
  private readonly meaning: SignalsMeaning;
  private readonly image: Panel;
  private readonly scale: Scale;
  private readonly lines: number;
  private readonly history: History;
  private readonly strip: Strip;
  private readonly stripNote = create("span", { class: "note", "data-testid": "strip-note" });
  private readonly rows: Row[] = [];
  private readonly inspector = new Inspector();
  private readonly legend: Legend;
  private readonly marks: readonly number[];
  private readonly picture: Picture;
  /** Whether the lines are in per cent; null before the first frame. */
  private perCent: boolean | null = null;
  /** Largest signal that was seen, in the shown unit. */
  private largestSignal = 0;

  constructor(hello: Hello, root: HTMLElement, listener: PanelListener, journal: Journal) {
    if (hello.signals === undefined || hello.signals === null) throw new Error("the hello was not checked");
    this.hello = hello;
    this.journal = journal;
    this.meaning = hello.signals;
    this.marks = marksOfStates(hello.states);
    const { rows, columns } = hello;
    const { value, full_scale: fullScale, signed, grayscale, channels } = this.meaning;
    this.picture = {
      rows,
      columns,
      block: 1,
      values: new Float64Array(rows * columns),
      marks: new Uint16Array(rows * columns),
    };
    const [rowPitch, columnPitch] = hello.pitch_m ?? [1, 1];
    const aspect = (rows * rowPitch) / (columns * columnPitch);
    const label = capitalised(value.quantity);
    const taxels = rows * columns === 1 ? "one taxel" : `${rows} x ${columns} taxels`;
    const note = grayscale && signed ? `${taxels}, brighter: larger of either sign` : taxels;
    // Grey shows how sensels compare, and light touches are most of what they feel.
    const least = grayscale ? GREY_FLOOR * fullScale : fullScale;
    // Three digits are enough for the end of a scale, and there is room for no more.
    const floor = Number((least / value.si_per_unit).toPrecision(3));
    this.scale = new Scale(signed && !grayscale ? "symmetric" : "positive", floor);
    this.image = new Panel(
      { testId: "image-signals", label, title: [label], note, unit: value.symbol, rows, columns, aspect, grayscale },
      this.scale,
      listener,
    );
    this.panels = [this.image];
    this.lines = Math.min(MOST_LINES, channels.length);
    this.history = new History(this.lines);
    const heading = create("div", { class: "panel-head" }, create("h2", {}, "Change against rest"), this.stripNote);
    const series = channels.slice(0, this.lines).map((name, line) => ({
      label: name,
      colour: `--line-${line + 1}`,
      width: 1.5,
      ...(line >= FIRST_DASHED ? { dash: DASH } : {}),
    }));
    this.strip = new Strip(
      heading,
      "Change of each channel against rest over the last 10 s",
      series,
      this.history.span,
      FLOOR_PER_CENT,
    );
    this.legend = new Legend("signals", grayscale ? GREY : HEAT, grayscale);
    const beside = create(
      "div",
      { class: "channels-beside" },
      this.channelTable(),
      this.inspector.root,
      this.strip.root,
      journal.root,
    );
    root.replaceChildren(create("div", { class: "map" }, this.image.root, beside), this.legend.root);
  }

  record(frame: Frame): void {
    if (frame.kind !== 3) return;
    const changes = this.meaning.channels.map((_, channel) =>
      changeOf(this.meaning, frame.signal[channel] as number, frame.rest[channel] as number),
    );
    // One unit for all lines: per cent only if every channel has a rest value to relate to.
    const perCent = changes.every((change) => change.perCent);
    if (perCent !== this.perCent) {
      this.perCent = perCent;
      this.history.clear();
      this.strip.restart(FLOOR_PER_CENT);
      const unit = perCent ? "%" : this.meaning.signal.symbol;
      const all = this.lines === this.meaning.channels.length;
      setText(this.stripNote, `${unit}, last 10 s${all ? "" : `, first ${this.lines} channels`}`);
    }
    const per = this.meaning.signal.si_per_unit;
    const values = changes.slice(0, this.lines).map(({ value }, line) =>
      perCent ? value : changeInUnit(per, frame.signal[line] as number, frame.rest[line] as number),
    );
    this.history.push(frame.header.time, values);
  }

  takeRest(): void {
    // The rest values come with each frame.
  }

  drawImages({ frame, selected, theme, now }: Scene): void {
    if (frame.kind !== 3) return;
    const { values, marks } = this.picture;
    const { grayscale, value } = this.meaning;
    for (let cell = 0; cell < values.length; cell++) {
      const shown = (frame.value[cell] as number) / value.si_per_unit;
      values[cell] = grayscale ? Math.abs(shown) : shown;
      marks[cell] = this.marks[frame.state[cell] as number] ?? 0;
    }
    const { rows, columns, pitch_m: pitch } = this.hello;
    this.image.follow(this.picture, now);
    this.image.draw(this.picture, this.map(theme), selected, (context, layout) => {
      if (pitch !== null) drawContacts(context, layout, rows, columns, pitch, frame.contacts, frame.header);
    });
    this.showChannels(frame);
  }

  drawStrip(now: number): void {
    if (this.perCent === false) this.strip.floor = Math.max(1e-9, FLOOR_SHARE * this.largestSignal);
    this.strip.draw(
      this.history.columns(Math.max(this.hello.stale_after_s, 2.5 * (this.hello.period_s ?? 0))),
      now,
    );
  }

  inspect(frame: Frame, cell: Cell): string {
    if (frame.kind !== 3) return "";
    const sentence = this.inspector.showSignal(this.hello, this.meaning, frame, cell);
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

  private map(theme: Theme): ColourMap {
    if (this.meaning.grayscale) return GREY;
    return this.meaning.signed ? DIVERGING[theme] : HEAT;
  }

  /** One row for each channel; its first field is the key of its line in the chart. */
  private channelTable(): HTMLElement {
    const { channels, signal } = this.meaning;
    const head = create("tr", { class: "units" }, create("td"), create("td"));
    head.append(create("th", { scope: "col" }, signal.symbol), create("th", { scope: "col" }, "change"));
    const table = create("table", { class: "channels", "data-testid": "channels" }, head);
    channels.forEach((name, channel) => {
      const key = create("td", { class: "line-key", "aria-hidden": "true" });
      if (channel < this.lines) {
        const line = create("span", { class: channel >= FIRST_DASHED ? "dashed" : "" });
        line.style.setProperty("--key", `var(--line-${channel + 1})`);
        key.append(line);
      }
      const row = { signal: create("td"), change: create("td") };
      this.rows.push(row);
      table.append(create("tr", {}, key, create("th", { scope: "row" }, name), row.signal, row.change));
    });
    const title = channels.length === 1 ? "Channel" : "Channels";
    const heading = create("div", { class: "panel-head" }, create("h2", {}, title));
    heading.append(create("span", { class: "note" }, signal.quantity));
    // More rows than there is room for are scrolled to, also by key.
    const scroll = create("div", { class: "scroll", tabindex: "0", role: "group", "aria-label": title }, table);
    return create("section", { class: "panel channels-panel", "aria-label": title }, heading, scroll);
  }

  private showChannels(frame: SignalsFrame): void {
    const { symbol, si_per_unit: per } = this.meaning.signal;
    for (const signal of [...frame.signal, ...frame.rest]) {
      const size = Math.abs(signal / per);
      if (size > this.largestSignal) this.largestSignal = size;
    }
    const decimals = decimalsFor(this.largestSignal, 5);
    this.rows.forEach((row, channel) => {
      const signal = frame.signal[channel] as number;
      const { value, perCent } = changeOf(this.meaning, signal, frame.rest[channel] as number);
      setText(row.signal, fixed(signal / per, decimals));
      setText(row.change, perCent ? `${fixed(value, 2)} %` : `${fixed(value, decimals)} ${symbol}`);
    });
  }
}
