// A mark: words that the operator notes at the newest frame, in a dialog.

import { byId } from "./dom";

export class MarkDialog {
  private readonly dialog = byId<HTMLDialogElement>("mark-dialog");
  private readonly text = byId<HTMLInputElement>("mark-text");

  /** `send` takes the words of a mark. */
  constructor(send: (text: string) => void) {
    byId("mark").addEventListener("click", () => this.show());
    byId("mark-cancel").addEventListener("click", () => this.dialog.close());
    byId<HTMLFormElement>("mark-form").addEventListener("submit", (event) => {
      event.preventDefault();
      const text = this.text.value.trim();
      if (text !== "") send(text);
      this.dialog.close();
    });
  }

  get open(): boolean {
    return this.dialog.open;
  }

  show(): void {
    this.text.value = "";
    this.dialog.showModal();
    this.text.focus();
  }
}
