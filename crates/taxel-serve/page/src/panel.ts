// The image of the skin: one layer at a time, with its colour bar and the limits of its scale.

import type { ColourMap } from "./colour";
import { gradientOf } from "./colour";
import { create, cssValue, setData, setText } from "./dom";
import { limit, parseLimit } from "./format";
import type { Turn } from "./image";
import { drawArea, drawCells, drawContacts, drawSelected, drawShear, extremes, Layout } from "./image";
import type { Layer } from "./layers";
import { markColours } from "./marks";
import type { Frame, Hello } from "./protocol";
import type { Theme } from "./theme";
import type { Shown } from "./units";

/** A taxel of the array; row 0 is at the top, column 0 at the left. */
export interface Cell {
  row: number;
  column: number;
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

/** What is to be drawn. */
export interface Scene {
  frame: Frame;
  selected: Cell | null;
  theme: Theme;
  /** ms */
  now: number;
}

/** By how much a key turns a cylinder, rad. */
const TURN_STEP = Math.PI / 12;
/** Of a small picture: around it, and below it for its words, px. */
const PADDING = 12;
const LABEL = 18;
/** A pointer that moved further than this turns, and does not pick; px. */
const DRAG = 4;

export class Panel {
  readonly canvas: HTMLCanvasElement;
  readonly frame: HTMLElement;
  /** The row below the image: colour bar and limits. */
  readonly scaleRow: HTMLElement;
  private readonly bar = create("div", { class: "bar", "aria-hidden": "true" });
  private readonly tick = create("span", { class: "tick", hidden: "" });
  private readonly low = this.limitInput("low");
  private readonly high = this.limitInput("high");
  private readonly unit = create("span", { class: "unit" });
  private readonly follow: HTMLButtonElement;
  private readonly hello: Hello;
  private readonly listener: PanelListener;
  private readonly turn: Turn | null;
  private layer: Layer;
  private aspect: number;
  private drawnMap: ColourMap | null = null;
  private shown: Shown = { per: 1, symbol: "" };
  /** Of the canvas, device pixels, and how many of them are one CSS pixel. */
  private size = { width: 1, height: 1, scale: 1 };

  constructor(hello: Hello, layer: Layer, listener: PanelListener) {
    this.hello = hello;
    this.layer = layer;
    this.listener = listener;
    const [rowPitch, columnPitch] = hello.pitch_m ?? [1, 1];
    const across = hello.columns * columnPitch;
    const { kind, radius_m: radius } = hello.mount;
    this.turn = kind === "cylinder" && radius !== undefined ? { arc: across / radius, angle: 0 } : null;
    this.aspect = (hello.rows * rowPitch) / (this.turn === null ? across : 2 * (radius as number));
    this.canvas = create("canvas", {
      "data-testid": "skin",
      tabindex: "0",
      role: "application",
      "aria-roledescription": "sensor image",
    });
    this.frame = create("div", { class: "frame" }, this.canvas);
    this.frame.style.setProperty("--aspect", String(1 / this.aspect));
    this.bar.append(this.tick);
    this.follow = create("button", { type: "button", class: "small follow", "data-testid": "follow", "aria-keyshortcuts": "L" });
    this.follow.addEventListener("click", () => this.toggleScale());
    this.scaleRow = create("div", { class: "scale" }, this.low, this.bar, this.high, this.unit, this.follow);
    new ResizeObserver(() => this.fit()).observe(this.frame);
    this.listen();
    this.use(layer);
  }

  /** Whether it shows a cylinder. */
  get turns(): boolean {
    return this.turn !== null;
  }

  /** Turns a cylinder, to the right. */
  turnBy(angle: number): void {
    if (this.turn === null) return;
    this.turn.angle += angle;
    setData(this.canvas, "turn", this.turn.angle.toFixed(3));
    this.listener.changed();
  }

  use(layer: Layer): void {
    this.layer = layer;
    this.drawnMap = null;
    setData(this.canvas, "layer", layer.id);
    const turning = this.turns ? " Comma and full stop turn the cylinder." : "";
    this.canvas.setAttribute("aria-label", `${layer.label}. Arrow keys inspect a taxel, Escape leaves it.${turning}`);
    this.scaleRow.style.visibility = layer.quantity === null ? "hidden" : "visible";
  }

  toggleScale(): void {
    const { scale } = this.layer;
    if (scale.fixed) scale.release();
    else scale.fix(scale.low, scale.high);
    this.listener.changed();
  }

  draw({ frame, selected, theme, now }: Scene): void {
    const context = this.canvas.getContext("2d");
    if (context === null) return;
    const { layer, hello } = this;
    const { picture, scale } = layer;
    layer.fill(frame);
    const { low, high, largest } = extremes(picture);
    if (layer.quantity !== null) scale.follow(low, high, now / 1000);
    setData(this.canvas, "max", Number.isFinite(largest) ? largest.toPrecision(6) : "");
    // A canvas of another size is empty: it takes its size when there is something to draw, not before.
    const { width, height, scale: dots } = this.size;
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    const layout = new Layout(width, height, dots, picture.rows, picture.columns, this.turn);
    const map = layer.map(theme);
    const area = hello.wiring.kind === "shared" && layer.over;
    const pitch = hello.pitch_m ?? ([1, 1] as const);
    if (area) drawArea(context, layout, hello, frame.header.zeroKnown ? frame.contacts : [], { map, high: scale.high });
    else drawCells(context, layout, picture, { map, low: scale.low, high: scale.high, colours: markColours(layer.grayscale) });
    if (layer.over && frame.header.zeroKnown) {
      const taxels = new Layout(width, height, dots, hello.rows, hello.columns, this.turn);
      if (hello.components === 3) drawShear(context, taxels, hello.rows, hello.columns, frame.value, frame.deviation, scale.high);
      drawContacts(context, taxels, hello.rows, hello.columns, pitch, frame.contacts, frame.header);
    }
    if (selected !== null && !area) drawSelected(context, layout, picture, selected.row, selected.column);
    this.showScale(map);
  }

  private showScale(map: ColourMap): void {
    const { layer } = this;
    const { scale, quantity } = layer;
    setData(this.canvas, "low", String(scale.low));
    setData(this.canvas, "high", String(scale.high));
    if (quantity === null) return;
    if (map !== this.drawnMap) {
      this.drawnMap = map;
      this.bar.style.backgroundImage = gradientOf(map);
    }
    this.shown = quantity.at(Math.max(Math.abs(scale.low), Math.abs(scale.high)));
    setText(this.unit, this.shown.symbol);
    for (const [input, value] of [[this.low, scale.low], [this.high, scale.high]] as const) {
      const text = limit(value / this.shown.per);
      if (input.value !== text && document.activeElement !== input) input.value = text;
    }
    setText(this.follow, scale.fixed ? "fixed" : "auto");
    this.follow.setAttribute("aria-pressed", String(scale.fixed));
    this.follow.title = scale.fixed ? "The scale stays; let it follow the values again (L)" : "The scale follows the values; keep it as it is (L)";
    const { verified } = this.hello;
    const place = verified === null || !layer.over ? Number.NaN : (verified - scale.low) / (scale.high - scale.low);
    this.tick.hidden = !(place > 0 && place < 1);
    if (!this.tick.hidden) this.tick.style.left = `${100 * place}%`;
    this.tick.title = "The model is trusted up to here";
  }

  private limitInput(end: "low" | "high"): HTMLInputElement {
    const name = end === "low" ? "Lower limit of the colours" : "Upper limit of the colours";
    const input = create("input", {
      type: "text",
      inputmode: "decimal",
      class: `limit ${end}`,
      "aria-label": name,
      title: `${name}: type a number to fix it`,
      autocomplete: "off",
      "data-testid": `limit-${end}`,
    });
    input.addEventListener("change", () => {
      const { scale } = this.layer;
      const value = parseLimit(input.value) * this.shown.per;
      const before = end === "low" ? scale.low : scale.high;
      if (limit(value) === limit(before)) return;
      if (scale.kind === "symmetric") scale.fix(-Math.abs(value), Math.abs(value));
      else if (end === "low") scale.fix(value, scale.high);
      else scale.fix(scale.low, value);
      this.listener.changed();
    });
    input.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== "Escape") return;
      if (event.key === "Escape") input.value = "";
      input.blur();
    });
    return input;
  }

  /** The largest image of the right shape that fits into the frame. */
  private fit(): void {
    const width = Math.floor(Math.min(this.frame.clientWidth, this.frame.clientHeight / this.aspect));
    const height = Math.floor(width * this.aspect);
    if (width < 8 || height < 8) return;
    this.canvas.style.width = `${width}px`;
    this.canvas.style.height = `${height}px`;
    const pixels = (length: number): number => Math.round(length * devicePixelRatio);
    this.size = { width: pixels(width), height: pixels(height), scale: pixels(width) / width };
    this.listener.changed();
  }

  private cellAt(event: PointerEvent): Cell | null {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const { rows, columns } = this.hello;
    const share = new Layout(width, height, 1, rows, columns, this.turn).shareAt((event.clientX - left) / width);
    const [row, column] = [Math.floor(((event.clientY - top) / height) * rows), Math.floor(share * columns)];
    return row >= 0 && row < rows && column >= 0 && column < columns ? { row, column } : null;
  }

  private listen(): void {
    const { canvas, listener } = this;
    let held: { x: number; turned: boolean } | null = null;
    canvas.addEventListener("pointermove", (event) => {
      if (held !== null && this.turns && (held.turned || Math.abs(event.clientX - held.x) > DRAG)) {
        held.turned = true;
        this.turnBy((2 * event.movementX) / canvas.clientWidth);
      } else if (event.pointerType !== "touch") listener.hover(this.cellAt(event));
    });
    canvas.addEventListener("pointerleave", () => listener.hover(null));
    canvas.addEventListener("pointerdown", (event) => {
      held = { x: event.clientX, turned: false };
      if (this.turns) canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointerup", (event) => {
      const cell = held?.turned === true ? null : this.cellAt(event);
      held = null;
      if (cell !== null) listener.pick(cell);
    });
    canvas.addEventListener("pointercancel", () => (held = null));
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
      else if (event.key === "," && this.turns) this.turnBy(-TURN_STEP);
      else if (event.key === "." && this.turns) this.turnBy(TURN_STEP);
      else return;
      event.preventDefault();
    });
  }
}

/** A small picture of another layer, which chooses it. */
export class Thumb {
  readonly button: HTMLButtonElement;
  readonly layer: Layer;
  // Without a frame it takes no room.
  private readonly canvas = create("canvas", { "aria-hidden": "true", width: "1", height: "1" });
  private readonly aspect: number;

  constructor(layer: Layer, aspect: number, choose: () => void) {
    this.layer = layer;
    this.aspect = aspect;
    this.button = create("button", { type: "button", class: "thumb", "data-testid": `thumb-${layer.id}`, title: `Show ${layer.label}` });
    this.button.append(this.canvas, create("span", {}, layer.label));
    this.button.addEventListener("click", choose);
  }

  draw({ frame, theme, now }: Scene): void {
    const { clientWidth, clientHeight } = this.button;
    const width = Math.min(clientWidth - PADDING, (clientHeight - PADDING - LABEL) / this.aspect);
    const context = this.canvas.getContext("2d");
    if (context === null || width < 8) return;
    const { picture, scale, quantity } = this.layer;
    this.layer.fill(frame);
    const { low, high } = extremes(picture);
    if (quantity !== null) scale.follow(low, high, now / 1000);
    const size = { width: Math.round(width * devicePixelRatio), height: Math.round(width * this.aspect * devicePixelRatio) };
    if (this.canvas.width !== size.width || this.canvas.height !== size.height) {
      Object.assign(this.canvas, size);
      Object.assign(this.canvas.style, { width: `${width}px`, height: `${Math.round(width * this.aspect)}px` });
    }
    const layout = new Layout(size.width, size.height, devicePixelRatio, picture.rows, picture.columns);
    const colours = markColours(this.layer.grayscale);
    context.fillStyle = cssValue("--panel");
    drawCells(context, layout, picture, { map: this.layer.map(theme), low: scale.low, high: scale.high, colours });
  }
}
