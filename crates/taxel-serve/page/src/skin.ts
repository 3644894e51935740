// The skin: one large image with layers to choose, the others small below it. A single taxel is a gauge.

import { create, setText } from "./dom";
import { Gauge } from "./gauge";
import type { Layer } from "./layers";
import { layersOf } from "./layers";
import type { PanelListener, Scene } from "./panel";
import { Panel, Thumb } from "./panel";
import type { Hello } from "./protocol";
import { recall, remember } from "./store";
import type { Quantities } from "./units";

/** Time between two drawings of the small pictures, ms: they are glanced at. */
const THUMB_PERIOD = 150;

export class SkinView {
  readonly root: HTMLElement;
  private readonly layers: readonly Layer[];
  private readonly panel: Panel;
  private readonly gauge: Gauge | null;
  private readonly thumbs: readonly Thumb[];
  private readonly buttons = new Map<string, HTMLButtonElement>();
  private readonly foot = create("p", { class: "foot", "data-testid": "skin-foot" });
  private readonly note = create("span", { class: "note" });
  private readonly key: string;
  private layer: Layer;
  private thumbsDrawnAt = Number.NEGATIVE_INFINITY;

  constructor(hello: Hello, quantities: Quantities, rest: () => readonly (number | null)[] | null, listener: PanelListener, tools: readonly HTMLElement[]) {
    this.layers = layersOf(hello, quantities, rest);
    // The choice is that for devices of the same layers.
    this.key = `layer of ${this.layers.map(({ id }) => id).join()}`;
    this.layer = this.layers.find(({ id }) => id === recall(this.key)) ?? (this.layers[0] as Layer);
    this.panel = new Panel(hello, this.layer, listener);
    const single = hello.rows * hello.columns === 1;
    this.gauge = single ? new Gauge(hello, quantities) : null;
    const head = create("div", { class: "panel-head" }, create("h2", {}, "Skin"));
    this.root = create("section", { class: "panel skin", "aria-label": "Skin" }, head);
    const [rowPitch, columnPitch] = hello.pitch_m ?? [1, 1];
    const aspect = (hello.rows * rowPitch) / (hello.columns * columnPitch);
    const shared = hello.wiring.kind === "shared";
    // Below a wide picture there is room.
    this.root.classList.toggle("wide", aspect < 0.8);
    this.thumbs = single || shared ? [] : this.layers.map((layer) => new Thumb(layer, aspect, () => this.choose(layer, listener)));
    if (this.gauge !== null) {
      head.append(...tools);
      this.root.append(this.gauge.root, this.foot);
      return;
    }
    const choice = create("div", { class: "segments", role: "group", "aria-label": "Layer of the image" });
    for (const layer of this.layers) {
      const button = create("button", { type: "button", "data-testid": `layer-${layer.id}` }, layer.label);
      button.addEventListener("click", () => this.choose(layer, listener));
      this.buttons.set(layer.id, button);
      choice.append(button);
    }
    head.append(choice);
    if (this.panel.turns) {
      for (const [words, by, title] of [["↶", -1, "Turn the cylinder to the left (,)"], ["↷", 1, "Turn the cylinder to the right (.)"]] as const) {
        const button = create("button", { type: "button", class: "small", title, "aria-label": title, "data-testid": by < 0 ? "turn-left" : "turn-right" }, words);
        button.addEventListener("click", () => this.panel.turnBy((by * Math.PI) / 12));
        head.append(button);
      }
    }
    head.append(...tools);
    this.root.append(this.panel.frame, create("div", { class: "under" }, this.panel.scaleRow, this.note), this.foot);
    if (this.thumbs.length > 0) this.root.append(create("div", { class: "thumbs", role: "group", "aria-label": "Other layers" }, ...this.thumbs.map(({ button }) => button)));
    this.show();
  }

  /** Draws a frame; `read` is true where the numbers that people read change, too. */
  draw(scene: Scene, read: boolean): void {
    if (this.gauge !== null) {
      this.gauge.draw(scene.frame, scene.now, read);
      return;
    }
    this.panel.draw(scene);
    if (scene.now - this.thumbsDrawnAt < THUMB_PERIOD) return;
    this.thumbsDrawnAt = scene.now;
    for (const thumb of this.thumbs) if (thumb.layer !== this.layer) thumb.draw(scene);
  }

  /** One line below the image about the taxel that is pointed at. */
  setFoot(text: string): void {
    setText(this.foot, text);
  }

  toggleScale(): void {
    this.panel.toggleScale();
  }

  private choose(layer: Layer, listener: PanelListener): void {
    this.layer = layer;
    remember(this.key, layer.id);
    this.show();
    listener.changed();
  }

  private show(): void {
    this.panel.use(this.layer);
    setText(this.note, this.layer.note);
    for (const [id, button] of this.buttons) button.setAttribute("aria-pressed", String(id === this.layer.id));
    for (const { layer, button } of this.thumbs) button.hidden = layer === this.layer;
  }
}
