// What the badge says about source and connection.

import type { Link, Status } from "./protocol";

export type LinkState = "connecting" | "waiting" | "live" | "stale" | "ended" | "disconnected" | "refused";

/** How the WebSocket stands. */
export type Socket = "connecting" | "open" | "disconnected" | "refused";

export interface Evidence {
  socket: Socket;
  status: Status | null;
  /** Time since any message, ms. */
  messageAge: number;
  /** Time since the last frame, ms; infinite before the first. */
  frameAge: number;
  /** s */
  staleAfter: number;
}

/** A status comes every 100 ms, so this much silence means that nobody is sending, ms. */
export const SILENCE = 400;

/** Time that a frame may need on its way before its absence counts, ms. */
const MARGIN = 50;

/** The server's word counts, and so does its silence: the page never shows an old image as live. */
export function linkState({ socket, status, messageAge, frameAge, staleAfter }: Evidence): LinkState {
  if (socket !== "open") return socket;
  if (status?.ended === true) return "ended";
  if (status?.stale === true || messageAge > SILENCE) return "stale";
  if (frameAge === Number.POSITIVE_INFINITY) return "waiting";
  return frameAge > 1000 * staleAfter + MARGIN ? "stale" : "live";
}

/** One sentence for people, beside the badge. */
export function linkInWords(state: LinkState, frameAge: number, hadHello: boolean): string {
  switch (state) {
    case "stale": {
      const age = Number.isFinite(frameAge) ? ` for ${(frameAge / 1000).toFixed(1)} s` : "";
      return `no frames${age}`;
    }
    case "ended":
      return "the recording is over";
    case "disconnected":
      return "the server does not answer; trying again";
    case "refused":
      return hadHello
        ? "refused: the server was started anew — use the URL printed by taxel live"
        : "refused: wrong token — use the URL printed by taxel live";
    case "waiting":
      return "no frame yet";
    default:
      return "";
  }
}

/** What is to be said of the link to the board; empty while it is in step. */
export function boardLinkInWords(link: Link | null | undefined): string {
  if (link === null || link === undefined || link.state === "in_step") return "";
  const state = `${link.name} is ${link.state}`;
  return link.reason === "" ? state : `${state}: ${link.reason}`;
}
