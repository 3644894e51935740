// The bar of a replay: where it is, pause, step, speed, loop, and the events and marks so far.

import { byId, create, setText } from "./dom";
import type { EventList } from "./events";
import { eventInWords } from "./events";
import { fixed } from "./format";
import type { Command, Replay, Status } from "./protocol";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10] as const;
/** Parts of the length by which the arrow keys of the slider go. */
const STEPS = 1000;
/** The service is asked to go somewhere no more often than this, ms. */
const PAUSE = 150;

export class ReplayBar {
  private readonly root = byId("replay");
  private readonly play = byId<HTMLButtonElement>("replay-play");
  private readonly slider = byId<HTMLInputElement>("replay-at");
  private readonly signs = byId("replay-events");
  private readonly speed = byId<HTMLSelectElement>("replay-speed");
  private readonly loop = byId<HTMLButtonElement>("replay-loop");
  private readonly time = byId("replay-time");
  private replay: Replay | null = null;
  private held = false;
  private askedAt = Number.NEGATIVE_INFINITY;
  private shownEvents = "";

  constructor(send: (command: Command) => void, private readonly events: EventList) {
    for (const speed of SPEEDS) this.speed.append(create("option", { value: String(speed) }, `${speed} x`));
    this.slider.max = String(STEPS);
    const go = (): void => {
      if (this.replay === null) return;
      const { from_ns: from, to_ns: to } = this.replay;
      send({ command: "seek", time_ns: Math.round(from + (Number(this.slider.value) / STEPS) * (to - from)) });
    };
    this.play.addEventListener("click", () => this.toggle(send));
    byId("replay-step").addEventListener("click", () => send({ command: "step" }));
    byId("replay-begin").addEventListener("click", () => {
      if (this.replay !== null) send({ command: "seek", time_ns: this.replay.from_ns });
    });
    this.speed.addEventListener("change", () => send({ command: "speed", speed: Number(this.speed.value) }));
    this.loop.addEventListener("click", () => send({ command: "loop", on: this.replay?.loop !== true }));
    this.slider.addEventListener("input", () => {
      this.held = true;
      if (performance.now() - this.askedAt < PAUSE) return;
      this.askedAt = performance.now();
      go();
    });
    this.slider.addEventListener("change", () => {
      go();
      this.held = false;
    });
  }

  take(status: Status | null): void {
    this.replay = status?.replay ?? null;
    const { replay } = this;
    this.root.hidden = replay === null;
    if (replay === null) return;
    const { from_ns: from, to_ns: to, at_ns: at, paused, speed, loop, ended } = replay;
    setText(this.play, paused || ended ? "▶" : "❚❚");
    this.play.setAttribute("aria-label", paused || ended ? "Play" : "Pause the replay");
    this.loop.setAttribute("aria-pressed", String(loop));
    if (speed !== null && ![...this.speed.options].some(({ value }) => Number(value) === speed)) {
      this.speed.append(create("option", { value: String(speed) }, `${speed} x`));
    }
    if (document.activeElement !== this.speed) this.speed.value = speed === null ? "" : String(speed);
    const place = at === null || to <= from ? 0 : (at - from) / (to - from);
    if (!this.held) this.slider.value = String(Math.round(STEPS * place));
    const words = `${fixed(((at ?? from) - from) / 1e9, 1)} of ${fixed((to - from) / 1e9, 1)} s`;
    setText(this.time, words);
    this.slider.setAttribute("aria-valuetext", words);
    this.showEvents(replay);
  }

  toggle(send: (command: Command) => void): void {
    const { replay } = this;
    if (replay === null) return;
    if (replay.ended) send({ command: "seek", time_ns: replay.from_ns });
    send({ command: "pause", on: !(replay.paused || replay.ended) });
  }

  private showEvents({ from_ns: from, to_ns: to }: Replay): void {
    const events = this.events.all;
    const state = `${events.length} ${events[events.length - 1]?.index ?? ""} ${from} ${to}`;
    if (state === this.shownEvents) return;
    this.shownEvents = state;
    this.signs.replaceChildren(
      ...events.map((event) => {
        const sign = create("span", { class: event.kind === "mark" ? "sign mark" : "sign", title: eventInWords(event) });
        sign.style.left = `${(100 * (event.time_ns - from)) / (to - from)}%`;
        return sign;
      }),
    );
  }
}
