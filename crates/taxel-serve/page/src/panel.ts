// One image with its title, its colour bar and the limits of its scale.

import type { ColourMap } from "./colour";
import { gradientOf } from "./colour";
import { create, setData } from "./dom";
import { limit, parseLimit } from "./format";
import type { Picture } from "./image";
import { drawCells, drawSelected, extremes, Layout } from "./image";
import { markColours } from "./marks";
import type { Scale } from "./scale";

/** A taxel of the array; row 0 is at the top, column 0 at the left. */
export interface Cell {
  row: number;
  column: number;
}

export interface PanelOptions {
  testId: string;
  /** For screen readers, such as "F x". */
  label: string;
  title: (Node | string)[];
  note: string;
  unit: string;
  rows: number;
  columns: number;
  /** Height of the image over its width. */
  aspect: number;
  /** Whether the image is in grey, so that cells without a value need a colour. */
  grayscale?: boolean;
}

/** What happens to a panel. */
export interface PanelListener {
  hover(cell: Cell | null): void;
  /** Tapped or clicked. */
  pick(cell: Cell): void;
  /** A key that moves the selection: rows down, columns right. */
  move(rows: number, columns: number): void;
  leave(): void;
  /** Size, scale or anything else that needs drawing again. */
  changed(): void;
}

export class Panel {
  readonly root: HTMLElement;
  readonly canvas: HTMLCanvasElement;
  readonly head: HTMLElement;
  scale: Scale;
  private readonly frame: HTMLElement;
  private readonly bar: HTMLElement;
  private readonly low: HTMLInputElement;
  private readonly high: HTMLInputElement;
  private readonly followButton: HTMLButtonElement;
  private readonly tick: HTMLElement;
  private readonly options: PanelOptions;
  private readonly listener: PanelListener;
  private shownMap: ColourMap | null = null;
  /** Where the mark on the colour bar stands. */
  private tickAt = "";
  /** Of the canvas, device pixels, and how many of them are one CSS pixel. */
  private size = { width: 1, height: 1, scale: 1 };

  constructor(options: PanelOptions, scale: Scale, listener: PanelListener) {
    const { label, unit } = options;
    this.options = options;
    this.scale = scale;
    this.listener = listener;
    this.canvas = create("canvas", {
      "data-testid": options.testId,
      tabindex: "0",
      role: "application",
      "aria-roledescription": "sensor image",
      "aria-label": `${label} in ${unit}. Arrow keys inspect a taxel, Escape leaves it.`,
    });
    this.frame = create("div", { class: "frame" }, this.canvas);
    this.head = create("div", { class: "panel-head" }, create("h2", {}, ...options.title));
    this.head.append(create("span", { class: "note" }, options.note));
    this.bar = create("div", { class: "bar", "aria-hidden": "true" });
    this.tick = create("span", { class: "tick", hidden: "" });
    this.bar.append(this.tick);
    this.low = this.limitInput(`Lower limit of ${label}, ${unit}`, "low");
    this.high = this.limitInput(`Upper limit of ${label}, ${unit}`, "high");
    this.followButton = create("button", { type: "button", class: "follow" });
    this.followButton.addEventListener("click", () => {
      if (this.scale.fixed) this.scale.release();
      else this.scale.fix(this.scale.low, this.scale.high);
      this.listener.changed();
    });
    const unitLabel = create("span", { class: "unit" }, unit);
    const scaleRow = create(
      "div",
      { class: "scale" },
      this.low,
      this.bar,
      this.high,
      unitLabel,
      this.followButton,
    );
    this.root = create("section", { class: "panel", "aria-label": label }, this.head, this.frame, scaleRow);
    this.root.style.setProperty("--aspect", String(1 / options.aspect));
    new ResizeObserver(() => this.fit()).observe(this.frame);
    this.listen();
  }

  /** Marks a value on the colour bar, with its meaning as a tooltip. */
  markOnBar(value: number | null, meaning: string): void {
    const place = value === null ? Number.NaN : (value - this.scale.low) / (this.scale.high - this.scale.low);
    const left = place > 0 && place < 1 ? `${100 * place}%` : "";
    if (left === this.tickAt) return;
    this.tickAt = left;
    this.tick.hidden = left === "";
    this.tick.style.left = left;
    this.tick.title = meaning;
  }

  /** Lets the scale follow the picture; `now` in ms. Before any drawing, since images may share a scale. */
  follow(picture: Picture, now: number): void {
    const { low, high, largest } = extremes(picture);
    this.scale.follow(low, high, now / 1000);
    setData(this.canvas, "max", Number.isFinite(largest) ? largest.toPrecision(6) : "");
  }

  /** Draws the picture; `over` draws what lies over the cells. */
  draw(
    picture: Picture,
    map: ColourMap,
    selected: Cell | null,
    over?: (context: CanvasRenderingContext2D, layout: Layout) => void,
  ): void {
    const context = this.canvas.getContext("2d");
    if (context === null) return;
    // A canvas of another size is empty: it takes its size when there is something to draw, not before.
    const { width, height, scale } = this.size;
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    const layout = new Layout(width, height, scale, picture.rows, picture.columns);
    const colours = markColours(this.options.grayscale === true);
    drawCells(context, layout, picture, { map, low: this.scale.low, high: this.scale.high, colours });
    over?.(context, layout);
    if (selected !== null) drawSelected(context, layout, picture, selected.row, selected.column);
    this.drawScale(map);
  }

  private drawScale(map: ColourMap): void {
    if (map !== this.shownMap) {
      this.bar.style.backgroundImage = gradientOf(map);
      this.shownMap = map;
    }
    const { low, high, fixed } = this.scale;
    this.showLimit(this.low, low);
    this.showLimit(this.high, high);
    setData(this.canvas, "low", String(low));
    setData(this.canvas, "high", String(high));
    if (this.followButton.getAttribute("aria-pressed") === String(fixed)) return;
    this.followButton.setAttribute("aria-pressed", String(fixed));
    this.followButton.textContent = fixed ? "fixed" : "auto";
    this.followButton.title = fixed
      ? "This scale is fixed: press to follow the values"
      : "This scale follows: press to fix it";
    this.followButton.setAttribute(
      "aria-label",
      `Scale of ${this.options.label}: ${this.followButton.title}`,
    );
  }

  /** Not while somebody types there. */
  private showLimit(input: HTMLInputElement, value: number): void {
    const text = limit(value);
    if (input.value !== text && document.activeElement !== input) input.value = text;
  }

  private limitInput(label: string, end: "low" | "high"): HTMLInputElement {
    const input = create("input", {
      type: "text",
      inputmode: "decimal",
      class: `limit ${end}`,
      "aria-label": label,
      title: `${label}: type a number to fix it`,
      autocomplete: "off",
      "data-testid": `${this.options.testId}-${end}`,
    });
    const take = (): void => {
      const value = parseLimit(input.value);
      const shown = end === "low" ? this.scale.low : this.scale.high;
      if (limit(value) !== limit(shown)) this.fixAt(end, value);
      this.listener.changed();
    };
    input.addEventListener("change", take);
    input.addEventListener("keydown", (event) => {
      if (event.key === "Enter" || event.key === "Escape") {
        if (event.key === "Escape") input.value = "";
        input.blur();
      }
    });
    return input;
  }

  private fixAt(end: "low" | "high", value: number): void {
    const { scale } = this;
    if (scale.kind === "symmetric") scale.fix(-Math.abs(value), Math.abs(value));
    else if (end === "low") scale.fix(value, scale.high);
    else scale.fix(scale.low, value);
  }

  /** The largest image of the right shape that fits into the frame. */
  private fit(): void {
    const width = Math.floor(Math.min(this.frame.clientWidth, this.frame.clientHeight / this.options.aspect));
    const height = Math.floor(width * this.options.aspect);
    if (width < 8 || height < 8) return;
    this.canvas.style.width = `${width}px`;
    this.canvas.style.height = `${height}px`;
    const pixels = (length: number): number => Math.round(length * devicePixelRatio);
    this.size = { width: pixels(width), height: pixels(height), scale: pixels(width) / width };
    this.listener.changed();
  }

  private cellAt(event: PointerEvent): Cell | null {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const row = Math.floor(((event.clientY - top) / height) * this.options.rows);
    const column = Math.floor(((event.clientX - left) / width) * this.options.columns);
    const inside = row >= 0 && row < this.options.rows && column >= 0 && column < this.options.columns;
    return inside ? { row, column } : null;
  }

  private listen(): void {
    const { canvas, listener } = this;
    canvas.addEventListener("pointermove", (event) => {
      if (event.pointerType !== "touch") listener.hover(this.cellAt(event));
    });
    canvas.addEventListener("pointerleave", () => listener.hover(null));
    canvas.addEventListener("pointerdown", (event) => {
      const cell = this.cellAt(event);
      if (cell !== null) listener.pick(cell);
    });
    const moves: Record<string, [number, number]> = {
      ArrowUp: [-1, 0],
      ArrowDown: [1, 0],
      ArrowLeft: [0, -1],
      ArrowRight: [0, 1],
      Home: [0, -Infinity],
      End: [0, Infinity],
      PageUp: [-Infinity, 0],
      PageDown: [Infinity, 0],
    };
    canvas.addEventListener("keydown", (event) => {
      const move = moves[event.key];
      if (move !== undefined) listener.move(...move);
      else if (event.key === "Escape") listener.leave();
      else return;
      event.preventDefault();
    });
  }
}
