// The marks of a cell's state. Each has its own shape, so that no state depends on colour alone.

import { cssValue } from "./dom";

/** What is marked in one cell; bits. */
export const Mark = {
  none: 0,
  masked: 1,
  faulty: 2,
  closed: 4,
  outOfRange: 8,
  notConverged: 16,
  inconsistent: 32,
  unchecked: 64,
  saturated: 128,
  ambiguous: 256,
  belowZero: 512,
  /** No state: a force of the other sign in a picture in grey, which shows sizes alone. */
  pulled: 1024,
} as const;

const MARK_OF_STATE: Record<string, number> = {
  masked: Mark.masked,
  faulty: Mark.faulty,
  closed: Mark.closed,
  out_of_range: Mark.outOfRange,
  not_converged: Mark.notConverged,
  inconsistent: Mark.inconsistent,
  unchecked: Mark.unchecked,
  saturated: Mark.saturated,
  ambiguous: Mark.ambiguous,
  below_zero: Mark.belowZero,
};

/** Marks by state code, for the list of states of the server. */
export function marksOfStates(states: readonly string[]): number[] {
  return states.map((state) => MARK_OF_STATE[state] ?? Mark.none);
}

export interface Box {
  x: number;
  y: number;
  width: number;
  height: number;
}

/** Colours that a mark needs besides black and white. */
export interface MarkColours {
  /** Ground of a cell without a value. */
  none: string;
  /** Lines on that ground. */
  hatch: string;
  /** Ground of a cell whose pressing reads below zero. */
  belowZero: string;
}

/** Those of the theme. In a picture in grey they are blue, since every grey is a value there. */
export function markColours(grayscale: boolean): MarkColours {
  const suffix = grayscale ? "-in-grey" : "";
  return { none: cssValue(`--none${suffix}`), hatch: cssValue(`--hatch${suffix}`), belowZero: cssValue("--below-zero") };
}

/** A cell without a value: never the colour of zero. */
export function drawNoValue(
  context: CanvasRenderingContext2D,
  box: Box,
  colours: MarkColours,
  dash: boolean,
): void {
  context.fillStyle = colours.none;
  context.fillRect(box.x, box.y, box.width, box.height);
  if (!dash || box.width < 6) return;
  context.fillStyle = colours.hatch;
  const length = Math.round(box.width * 0.36);
  const thickness = Math.max(1, Math.round(box.height * 0.07));
  context.fillRect(box.x + (box.width - length) / 2, box.y + (box.height - thickness) / 2, length, thickness);
}

/** The ground of a cell that reads below zero: a colour of no map, since the low end of a map would say zero. */
export function drawBelowZeroGround(context: CanvasRenderingContext2D, box: Box, colours: MarkColours): void {
  context.fillStyle = colours.belowZero;
  context.fillRect(box.x, box.y, box.width, box.height);
}

/** Hatching for a masked cell. */
export function drawHatch(
  context: CanvasRenderingContext2D,
  { x, y, width, height }: Box,
  colours: MarkColours,
  scale: number,
): void {
  context.save();
  context.beginPath();
  context.rect(x, y, width, height);
  context.clip();
  context.fillStyle = colours.none;
  context.fillRect(x, y, width, height);
  context.strokeStyle = colours.hatch;
  context.lineWidth = scale;
  context.beginPath();
  const step = Math.max(4 * scale, Math.min(6 * scale, width / 3));
  // Starting on a common grid makes the lines of neighbours meet.
  const first = Math.ceil((x + y) / step) * step;
  for (let sum = first; sum < x + y + width + height; sum += step) {
    context.moveTo(sum - y, y);
    context.lineTo(sum - y - height, y + height);
  }
  context.stroke();
  context.restore();
}

/** Marks that lie over the colour of a cell. */
export function drawMarks(context: CanvasRenderingContext2D, box: Box, marks: number, scale: number): void {
  const size = Math.min(box.width, box.height);
  if (marks & Mark.closed) {
    const inset = Math.max(1.5 * scale, size * 0.09);
    path(context, scale, 1.75, () => {
      context.rect(box.x + inset, box.y + inset, box.width - 2 * inset, box.height - 2 * inset);
    });
  }
  if (marks & Mark.faulty) {
    const inset = size * 0.22;
    path(context, scale, size > 12 * scale ? 1.75 : 1, () => {
      context.moveTo(box.x + inset, box.y + inset);
      context.lineTo(box.x + box.width - inset, box.y + box.height - inset);
      context.moveTo(box.x + box.width - inset, box.y + inset);
      context.lineTo(box.x + inset, box.y + box.height - inset);
    });
  }
  if (marks & Mark.ambiguous) drawAmbiguous(context, box, scale);
  if (marks & Mark.belowZero) drawBelowZero(context, box, scale);
  if (marks & Mark.pulled) drawPulled(context, box, scale);
  if (!(marks & IN_CORNER)) return;
  // One small sign in the upper right corner, where the arrow from the centre rarely reaches.
  const largest = Math.max(4.5 * scale, Math.min(9 * scale, size * 0.05));
  const radius = Math.max(2.5 * scale, Math.min(largest, size * 0.14));
  const x = box.x + box.width - radius - 2.5 * scale;
  const y = box.y + radius + 2.5 * scale;
  if (marks & Mark.unchecked) {
    path(context, scale, 1, () => context.arc(x, y, radius * 0.35, 0, 2 * Math.PI), true);
  }
  path(context, scale, 1.5, () => {
    if (marks & Mark.outOfRange) {
      context.moveTo(x, y - radius);
      context.lineTo(x + radius, y + radius * 0.8);
      context.lineTo(x - radius, y + radius * 0.8);
      context.closePath();
    }
    if (marks & Mark.notConverged) context.arc(x, y, radius * 0.9, 0, 2 * Math.PI);
    if (marks & Mark.inconsistent) {
      context.moveTo(x, y - radius);
      context.lineTo(x + radius, y);
      context.lineTo(x, y + radius);
      context.lineTo(x - radius, y);
      context.closePath();
    }
    if (marks & Mark.saturated) {
      // An arrow against a stop.
      context.moveTo(x - radius, y - radius);
      context.lineTo(x + radius, y - radius);
      context.moveTo(x, y + radius);
      context.lineTo(x, y - radius * 0.4);
      context.moveTo(x - radius * 0.7, y + radius * 0.3);
      context.lineTo(x, y - radius * 0.4);
      context.lineTo(x + radius * 0.7, y + radius * 0.3);
    }
  });
}

const IN_CORNER = Mark.outOfRange | Mark.notConverged | Mark.inconsistent | Mark.unchecked | Mark.saturated;

/** A question mark on a dark disc in a broken frame: plain to see on every colour, and without one. */
function drawAmbiguous(context: CanvasRenderingContext2D, box: Box, scale: number): void {
  const size = Math.min(box.width, box.height);
  const inset = Math.max(1.5 * scale, size * 0.07);
  const dash = Math.max(2 * scale, Math.min(8 * scale, size * 0.16));
  path(context, scale, size > 30 * scale ? 2 : 1.25, () => {
    context.setLineDash([dash, 1.6 * dash]);
    context.rect(box.x + inset, box.y + inset, box.width - 2 * inset, box.height - 2 * inset);
  });
  const radius = Math.max(5 * scale, Math.min(26 * scale, size * 0.3));
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  path(context, scale, radius > 12 * scale ? 2 : 1, () => context.arc(x, y, radius, 0, 2 * Math.PI));
  context.save();
  context.fillStyle = "#0a0c10";
  context.beginPath();
  context.arc(x, y, radius - scale / 2, 0, 2 * Math.PI);
  context.fill();
  context.strokeStyle = "#fff";
  context.fillStyle = "#fff";
  context.lineWidth = Math.max(1.25 * scale, radius * 0.16);
  context.lineCap = "round";
  context.beginPath();
  context.arc(x, y - radius * 0.26, radius * 0.32, -Math.PI, Math.PI * 0.25);
  context.lineTo(x, y + radius * 0.24);
  context.stroke();
  context.beginPath();
  context.arc(x, y + radius * 0.58, Math.max(0.8 * scale, radius * 0.11), 0, 2 * Math.PI);
  context.fill();
  context.restore();
}

/** A line for zero, and an arrow that leads down from it. */
function drawBelowZero(context: CanvasRenderingContext2D, box: Box, scale: number): void {
  const radius = Math.max(2.5 * scale, Math.min(14 * scale, 0.26 * Math.min(box.width, box.height)));
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  path(context, scale, radius > 5 * scale ? 1.75 : 1, () => {
    context.moveTo(x - radius, y - radius);
    context.lineTo(x + radius, y - radius);
    context.moveTo(x, y - radius);
    context.lineTo(x, y + radius);
    context.moveTo(x - radius * 0.6, y + radius * 0.4);
    context.lineTo(x, y + radius);
    context.lineTo(x + radius * 0.6, y + radius * 0.4);
  });
}

/** A minus sign. */
function drawPulled(context: CanvasRenderingContext2D, box: Box, scale: number): void {
  const half = Math.max(2.5 * scale, Math.min(12 * scale, 0.2 * Math.min(box.width, box.height)));
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  path(context, scale, half > 5 * scale ? 2.25 : 1.25, () => {
    context.moveTo(x - half, y);
    context.lineTo(x + half, y);
  });
}

/** The brackets around the inspected cell. */
export function drawSelection(context: CanvasRenderingContext2D, box: Box, scale: number): void {
  const reach = Math.max(3 * scale, Math.min(box.width, box.height) * 0.28);
  const [left, top] = [box.x + scale, box.y + scale];
  const [right, bottom] = [box.x + box.width - scale, box.y + box.height - scale];
  const outline = (): void => {
    for (const [x, y, dx, dy] of [
      [left, top, 1, 1],
      [right, top, -1, 1],
      [right, bottom, -1, -1],
      [left, bottom, 1, -1],
    ] as const) {
      context.moveTo(x + dx * reach, y);
      context.lineTo(x, y);
      context.lineTo(x, y + dy * reach);
    }
  };
  path(context, scale, 2, outline, false, "#ffb31a");
}

/** A bright line in a dark border: visible on every colour of every map. */
export function path(
  context: CanvasRenderingContext2D,
  scale: number,
  width: number,
  outline: () => void,
  fill = false,
  colour = "#fff",
): void {
  context.save();
  context.lineJoin = "round";
  context.lineCap = "round";
  context.beginPath();
  outline();
  context.strokeStyle = "rgba(10, 12, 16, 0.85)";
  context.lineWidth = (width + 1.75) * scale;
  context.stroke();
  context.strokeStyle = colour;
  context.fillStyle = colour;
  context.lineWidth = width * scale;
  context.stroke();
  if (fill) context.fill();
  context.restore();
}
