// Recording from the page: a name, start and stop, and what the file has taken so far.

import { byId, setText } from "./dom";
import { fixed } from "./format";
import type { Command, Status } from "./protocol";

/** A size as people read it. */
export function bytesInWords(bytes: number): string {
  const units = ["B", "kB", "MB", "GB", "TB"];
  const step = Math.min(units.length - 1, bytes > 0 ? Math.floor(Math.log10(bytes) / 3) : 0);
  const size = bytes / 1000 ** step;
  return `${step === 0 ? String(bytes) : fixed(size, size < 10 ? 1 : 0)} ${units[step]}`;
}

export function lengthInWords(seconds: number): string {
  const whole = Math.floor(seconds);
  const parts = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60].map((part) => String(part).padStart(2, "0"));
  return (whole < 3600 ? parts.slice(1) : parts).join(":");
}

export class RecordControl {
  private readonly button = byId<HTMLButtonElement>("record");
  private readonly chip = byId("recording");
  private readonly dialog = byId<HTMLDialogElement>("record-dialog");
  private readonly name = byId<HTMLInputElement>("record-name");
  private status: Status | null = null;

  constructor(send: (command: Command) => void) {
    this.button.addEventListener("click", () => {
      if (this.status?.recording == null) this.ask();
      else send({ command: "stop_recording" });
    });
    byId("record-cancel").addEventListener("click", () => this.dialog.close());
    byId<HTMLFormElement>("record-form").addEventListener("submit", (event) => {
      event.preventDefault();
      const name = this.name.value.trim();
      if (name !== "") send({ command: "start_recording", name });
      this.dialog.close();
    });
  }

  take(status: Status | null): void {
    this.status = status;
    const recording = status?.recording ?? null;
    this.button.hidden = status === null || (status.records_to === null && recording === null);
    setText(this.button, recording === null ? "Record" : "Stop");
    this.button.title = recording === null ? "Record the run from now on (R)" : `Stop recording ${recording.name} (R)`;
    this.button.setAttribute("aria-pressed", String(recording !== null));
    this.chip.hidden = recording === null;
    if (recording === null) return;
    const { name, length_s: length, bytes, free_bytes: free, lost, failure } = recording;
    const words = failure !== null ? `recording failed: ${name}` : `● ${lengthInWords(length)} ${name}`;
    const parts = [words, bytesInWords(bytes), ...(free === null ? [] : [`${bytesInWords(free)} free`]), ...(lost > 0 ? [`${lost} messages lost`] : [])];
    setText(this.chip, parts.join(", "));
    this.chip.title = failure ?? parts.join(", ");
    this.chip.dataset["failed"] = String(failure !== null || lost > 0);
  }

  toggle(): void {
    if (!this.button.hidden) this.button.click();
  }

  get open(): boolean {
    return this.dialog.open;
  }

  private ask(): void {
    const stamp = new Date().toISOString().slice(0, 19).replace("T", "-").replaceAll(":", "");
    this.name.value = `run-${stamp}`;
    setText(byId("record-folder"), this.status?.records_to ?? "");
    this.dialog.showModal();
    this.name.select();
  }
}
