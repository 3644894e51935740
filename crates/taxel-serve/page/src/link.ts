// What the badge says about source and connection.

import { fixed } from "./format";
import type { Link, Status } from "./protocol";

export type LinkState = "connecting" | "waiting" | "live" | "paused" | "stale" | "ended" | "disconnected" | "refused";

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
  if (status?.replay?.paused === true && messageAge <= SILENCE) return "paused";
  if (status?.stale === true || messageAge > SILENCE) return "stale";
  if (frameAge === Number.POSITIVE_INFINITY) return "waiting";
  return frameAge > 1000 * staleAfter + MARGIN ? "stale" : "live";
}

/** Whether the last frame says how the sensor is: of what no frame shows, nothing is called well. */
export function isCurrent(state: LinkState): boolean {
  return ["live", "paused", "ended"].includes(state);
}

/** One sentence for people, beside the badge. */
export function linkInWords(state: LinkState, frameAge: number, hadHello: boolean): string {
  switch (state) {
    case "stale": {
      const age = Number.isFinite(frameAge) ? ` for ${(frameAge / 1000).toFixed(1)} s` : "";
      return `no frames${age}`;
    }
    case "paused":
      return "the replay is paused";
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

/** How the clock of the board stands to that of the computer; null while it is not known. */
export function clockInWords(link: Link | null | undefined): string | null {
  const clock = link?.clock ?? null;
  if (clock === null || link?.state !== "in_step") return null;
  const ms = (seconds: number): string => `${fixed(1e3 * seconds, 2)} ms`;
  // Both clocks count as equally fast until the stamps tell.
  const ppm = 1e6 * clock.rate_difference;
  const pace = `${fixed(Math.abs(ppm), 1)} ppm ${ppm < 0 ? "fast" : "slow"}`;
  const rate =
    ppm === 0
      ? "How much faster or slower the clock of the board runs is not known yet."
      : `The clock of the board runs ${pace.replace(" ppm ", " ppm too ")}.`;
  const { before_s: before, behind_s: behind } = clock;
  const times = [clock.device_time_ns, clock.host_ns].map((time) => fixed(time / 1e9, 3));
  const known =
    before === null
      ? `at most ${ms(behind)} behind it; how long before it is not known, since the board file states no delay`
      : `at most ${ms(before)} before and ${ms(behind)} behind it`;
  const segment = clock.segments > 1 ? ` Segment ${clock.segments} of the clock.` : "";
  return (
    `${times[0]} s by the clock of the board was ${times[1]} s by that of the computer since the program began, ` +
    `${known}. ${rate}${segment}`
  );
}
