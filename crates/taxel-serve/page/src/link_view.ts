// Everything about the link behind its chip: rates, latency, losses, clock, what came over the wire.

import { create, setText } from "./dom";
import { fixed, NONE } from "./format";
import { boardLinkInWords, clockInWords } from "./link";
import type { FrameHeader, Hello, Status } from "./protocol";

/** Numbers that come from the connection and not from the shown frame. */
export interface Counts {
  header: FrameHeader | null;
  status: Status | null;
  latency: { median: number; largest: number };
  /** Whether frames arrive now. */
  live: boolean;
  /** In words. */
  state: string;
}

const FACTS: readonly (readonly [id: string, label: string])[] = [
  ["link-state", "State"],
  ["frame-rate", "Frames"],
  ["latency", "Latency, median and largest"],
  ["lost", "Lost"],
  ["late", "Late"],
  ["duplicate", "Duplicate"],
  ["dropped", "Dropped by this page"],
  ["clients", "Pages that watch"],
  ["board", "Board"],
  ["wire", "Wire"],
  ["clock", "Clock of the board"],
  ["source-text", "Source"],
  ["program", "Program"],
];

export class LinkView {
  readonly root: HTMLElement;
  private readonly facts = new Map<string, HTMLElement>();

  constructor() {
    const list = create("dl", { class: "facts" });
    for (const [id, label] of FACTS) {
      const value = create("dd", { "data-testid": id }, NONE);
      this.facts.set(id, value);
      list.append(create("dt", {}, label), value);
    }
    this.root = create("div", { class: "scroll", tabindex: "0", "data-testid": "link-view" }, list);
  }

  greet({ source, version, commit, sensor_hash: hash }: Hello): void {
    this.set("source-text", source);
    this.set("program", `taxel ${version} (${commit})${hash === "" ? "" : `, sensor file ${hash.slice(0, 12)}`}`);
  }

  show({ header, status, latency, live, state }: Counts): void {
    const ms = (seconds: number): string => fixed(1e3 * seconds, 2);
    const count = (value: number | undefined): string => (value === undefined ? NONE : Number.isNaN(value) ? "not known" : String(value));
    const link = status?.link ?? null;
    this.set("link-state", [state, boardLinkInWords(link)].filter((words) => words !== "").join("; "));
    this.set("frame-rate", live && header !== null ? `${fixed(header.rate, 1)} Hz` : NONE);
    this.set("latency", `${ms(latency.median)} and ${ms(latency.largest)} ms`);
    this.set("lost", count(header?.lost));
    this.set("late", count(header?.late));
    this.set("duplicate", count(header?.duplicate));
    this.set("dropped", count(status?.dropped));
    this.set("clients", count(status?.clients));
    this.set("board", link === null ? "no link" : `${link.board}, wire class ${link.wire_class}, ${link.name}`);
    const wire = link?.wire;
    this.set("wire", wire === undefined ? NONE : `${wire.delivered} frames, ${wire.damaged} damaged, ${wire.passed_over_bytes} bytes passed over`);
    this.set("clock", clockInWords(link) ?? NONE);
  }

  private set(id: string, text: string): void {
    const element = this.facts.get(id);
    if (element !== undefined) setText(element, text);
  }
}
