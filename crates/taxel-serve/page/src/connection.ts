// The WebSocket to the server: opens it, reads its text messages, opens it again when it is lost.

import type { BaselineChanges, Command, Health, Hello, Status, TareEntry, TouchEvent } from "./protocol";
import { parseMessage, ProtocolError } from "./protocol";
import type { Socket } from "./link";

export interface Listener {
  hello(hello: Hello): void;
  /** Readings of the empty channels, SI. */
  rest(channels: readonly (number | null)[]): void;
  status(status: Status): void;
  /** New events, the oldest first; `missed` more are not kept any more. */
  events(events: readonly TouchEvent[], missed: number): void;
  /** The whole history of the rest values. */
  tares(entries: readonly TareEntry[]): void;
  baseline(baseline: BaselineChanges): void;
  health(health: Health): void;
  /** A binary message, not yet decoded. */
  frame(bytes: ArrayBuffer): void;
  socket(socket: Socket): void;
  /** A message that the page does not understand. */
  problem(text: string): void;
}

/** Waiting times before the next attempt, ms. */
const BACKOFF = [250, 500, 1000, 2000, 4000];
const BACKOFF_REFUSED = 8000;

export class Connection {
  private readonly url: URL;
  private readonly listener: Listener;
  private socket: WebSocket | null = null;
  private failures = 0;
  private hadHello = false;

  constructor(page: Location, listener: Listener) {
    this.url = new URL("ws", page.href);
    this.url.protocol = page.protocol === "https:" ? "wss:" : "ws:";
    this.url.search = "";
    this.url.hash = "";
    this.url.searchParams.set("token", new URLSearchParams(page.search).get("token") ?? "");
    this.listener = listener;
    this.listener.socket("connecting");
    this.open();
  }

  send(command: Command): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(command));
  }

  private open(): void {
    const socket = new WebSocket(this.url);
    let greeted = false;
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      try {
        if (typeof data !== "string") {
          if (greeted) this.listener.frame(data);
          return;
        }
        const message = parseMessage(data);
        if (message.type === "hello") {
          greeted = true;
          this.hadHello = true;
          this.failures = 0;
          this.listener.hello(message.hello);
          this.listener.socket("open");
        } else if (message.type === "rest") {
          this.listener.rest(message.channels);
        } else if (message.type === "status") {
          this.listener.status(message.status);
        } else if (message.type === "events") {
          this.listener.events(message.events, message.missed);
        } else if (message.type === "tares") {
          this.listener.tares(message.entries);
        } else if (message.type === "baseline") {
          this.listener.baseline(message.baseline);
        } else if (message.type === "health") {
          this.listener.health(message.health);
        }
      } catch (error) {
        if (!(error instanceof ProtocolError)) throw error;
        this.listener.problem(error.message);
      }
    };
    socket.onclose = () => void this.closed(greeted);
    this.socket = socket;
  }

  /** A browser does not say why an upgrade failed, so the page asks for itself again with the same token. */
  private async closed(greeted: boolean): Promise<void> {
    this.socket = null;
    if (greeted) this.listener.socket("disconnected");
    const answer = greeted ? "unknown" : await this.askPage();
    const refused = answer === "refused" || (answer === "served" && !this.hadHello);
    this.listener.socket(refused ? "refused" : "disconnected");
    const wait = refused ? BACKOFF_REFUSED : (BACKOFF[Math.min(this.failures, BACKOFF.length - 1)] as number);
    this.failures += 1;
    setTimeout(() => this.open(), wait);
  }

  private async askPage(): Promise<"served" | "refused" | "unknown"> {
    try {
      const response = await fetch(location.href, { cache: "no-store" });
      if (response.status === 401 || response.status === 403) return "refused";
      return response.ok ? "served" : "unknown";
    } catch {
      return "unknown";
    }
  }
}
