// The drawing of the device, to scale, in a dialog.

import { byId, create, setText } from "./dom";
import type { Hello } from "./protocol";

export class Drawing {
  /** Whether the device has a drawing: a recording that describes itself has none. */
  exists = false;
  private readonly address: URL;
  /** Opens it; it stands with the image of the skin. */
  readonly button = create("button", { type: "button", class: "small", "data-testid": "drawing", "aria-haspopup": "dialog", "aria-keyshortcuts": "D", title: "The device to scale, as its sensor file describes it (D)" }, "Drawing");
  private readonly dialog = byId<HTMLDialogElement>("drawing-dialog");
  private readonly image = byId<HTMLImageElement>("drawing-image");

  constructor(page: Location) {
    this.address = new URL("drawing.svg", page.href);
    this.address.search = "";
    this.address.hash = "";
    this.address.searchParams.set("token", new URLSearchParams(page.search).get("token") ?? "");
    this.button.addEventListener("click", () => this.toggle());
    byId("drawing-close").addEventListener("click", () => this.dialog.close());
    // A click outside the dialog is one on its backdrop, whose target is the dialog itself.
    this.dialog.addEventListener("click", ({ target, clientX, clientY }) => {
      const { left, right, top, bottom } = this.dialog.getBoundingClientRect();
      const inside = clientX >= left && clientX <= right && clientY >= top && clientY <= bottom;
      if (target === this.dialog && !inside) this.dialog.close();
    });
    this.image.addEventListener("error", () => this.failed(true));
    this.image.addEventListener("load", () => this.failed(false));
  }

  get open(): boolean {
    return this.dialog.open;
  }

  /** Takes the device of a connection. */
  show(hello: Hello): void {
    this.exists = hello.sensor_hash !== "";
    this.button.hidden = !this.exists;
    setText(byId("drawing-title"), hello.name);
    this.image.alt = `Drawing of ${hello.name}, to scale`;
    // Asked for anew at the next opening: this may be another device.
    this.image.removeAttribute("src");
    if (this.open && this.exists) this.image.src = this.address.href;
    else this.dialog.close();
  }

  toggle(): void {
    if (this.open) {
      this.dialog.close();
      return;
    }
    if (!this.image.hasAttribute("src")) this.image.src = this.address.href;
    this.dialog.showModal();
  }

  private failed(failed: boolean): void {
    this.image.hidden = failed;
    byId("drawing-failed").hidden = !failed;
    // The next opening tries again.
    if (failed) this.image.removeAttribute("src");
  }
}
