// One image on a canvas: cells in colour, marks, and what lies over them.

import type { ColourMap } from "./colour";
import { colourOf } from "./colour";
import { cssValue } from "./dom";
import type { Box, MarkColours } from "./marks";
import { drawBelowZeroGround, drawHatch, drawMarks, drawNoValue, drawSelection, Mark, path } from "./marks";
import type { Contact, FrameHeader, Hello } from "./protocol";

/** What an image shows: values in shown units, row by row. */
export interface Picture {
  rows: number;
  columns: number;
  /** Cells of a taxel along each side: 2 for capacitors, otherwise 1. */
  block: 1 | 2;
  values: Float64Array;
  marks: Uint16Array;
}

/** Extremes of a picture; NaN if it has no values at all. */
export function extremes(picture: Picture): { low: number; high: number; largest: number } {
  let low = Number.POSITIVE_INFINITY;
  let high = Number.NEGATIVE_INFINITY;
  picture.values.forEach((value, cell) => {
    if (!Number.isFinite(value) || ((picture.marks[cell] as number) & Mark.masked) !== 0) return;
    low = Math.min(low, value);
    high = Math.max(high, value);
  });
  if (low > high) return { low: Number.NaN, high: Number.NaN, largest: Number.NaN };
  return { low, high, largest: Math.max(Math.abs(low), Math.abs(high)) };
}

/** How an array on a cylinder is seen: the axis is upright, and the eye far away. */
export interface Turn {
  /** Angle that the array covers, rad. */
  arc: number;
  /** Angle by which its middle is turned to the right, rad. */
  angle: number;
}

/** Where the cells of a picture lie on a canvas. */
export class Layout {
  readonly width: number;
  readonly height: number;
  /** Device pixels for one CSS pixel. */
  readonly scale: number;
  readonly rows: number;
  readonly columns: number;
  readonly turn: Turn | null;

  constructor(width: number, height: number, scale: number, rows: number, columns: number, turn: Turn | null = null) {
    this.width = width;
    this.height = height;
    this.scale = scale;
    this.rows = rows;
    this.columns = columns;
    this.turn = turn;
  }

  /** Where a position across the array lies, from 0 to 1; behind the cylinder NaN. */
  across(share: number): number {
    if (this.turn === null) return share * this.width;
    const angle = aroundZero((share - 0.5) * this.turn.arc + this.turn.angle);
    return Math.abs(angle) > Math.PI / 2 ? Number.NaN : (this.width / 2) * (1 + Math.sin(angle));
  }

  /** By how much lengths across the array are shortened there. */
  shortened(share: number): number {
    return this.turn === null ? 1 : Math.max(0, Math.cos((share - 0.5) * this.turn.arc + this.turn.angle));
  }

  /** The position across the array, from 0 to 1, that is seen at a share of the width. */
  shareAt(place: number): number {
    if (this.turn === null) return place;
    const angle = Math.asin(Math.min(1, Math.max(-1, 2 * place - 1)));
    return aroundZero(angle - this.turn.angle) / this.turn.arc + 0.5;
  }

  /** The box of `span` x `span` cells from this one, with gaps between blocks of `block` cells; without width behind a cylinder. */
  box(row: number, column: number, block: number, span = 1): Box {
    const size = Math.min(this.width / this.columns, this.height / this.rows);
    const gap = size * block < 8 * this.scale ? 0 : this.scale;
    // Small cells keep a line on one side only, so that the lines do not outshine the values.
    const closing = size * block < 24 * this.scale ? 0 : gap;
    const hair = block > 1 && size > 8 * this.scale ? Math.max(1, Math.floor(this.scale / 2)) : 0;
    const [from, to] = this.ends(column, span);
    const left = Math.round(from) + (column % block === 0 ? gap : hair);
    const top = Math.round((row * this.height) / this.rows) + (row % block === 0 ? gap : hair);
    const right = Math.round(to);
    const bottom = Math.round(((row + span) * this.height) / this.rows);
    const endGap = (cell: number): number => (cell % block === 0 ? closing : 0);
    return {
      x: left,
      y: top,
      width: Math.max(0, right - left - endGap(column + span)),
      height: bottom - top - endGap(row + span),
    };
  }

  /** Left and right end of columns. */
  private ends(column: number, span: number): [number, number] {
    if (this.turn === null) return [(column * this.width) / this.columns, ((column + span) * this.width) / this.columns];
    const half = (this.turn.arc * span) / this.columns / 2;
    const middle = aroundZero(((column + span / 2) / this.columns - 0.5) * this.turn.arc + this.turn.angle);
    const place = (angle: number): number => (this.width / 2) * (1 + Math.sin(Math.min(Math.PI / 2, Math.max(-Math.PI / 2, angle))));
    return [place(middle - half), place(middle + half)];
  }
}

/** The same direction from -π to π. */
function aroundZero(angle: number): number {
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}

export interface Colouring {
  map: ColourMap;
  low: number;
  high: number;
  colours: MarkColours;
}

/** Draws all cells with their marks. */
export function drawCells(
  context: CanvasRenderingContext2D,
  layout: Layout,
  picture: Picture,
  { map, low, high, colours }: Colouring,
): void {
  context.clearRect(0, 0, layout.width, layout.height);
  if (layout.turn !== null) drawCylinder(context, layout);
  for (let row = 0; row < picture.rows; row++) {
    for (let column = 0; column < picture.columns; column++) {
      const cell = row * picture.columns + column;
      const value = picture.values[cell] as number;
      const marks = picture.marks[cell] as number;
      const box = layout.box(row, column, picture.block);
      if (box.width < 1) continue;
      if (marks & Mark.masked) {
        drawHatch(context, box, colours, layout.scale);
        continue;
      }
      if (Number.isFinite(value) && (marks & Mark.belowZero) !== 0) {
        drawBelowZeroGround(context, box, colours);
      } else if (Number.isFinite(value)) {
        context.fillStyle = colourOf(map, value, low, high);
        context.fillRect(box.x, box.y, box.width, box.height);
      } else {
        drawNoValue(context, box, colours, (marks & (Mark.faulty | Mark.closed | Mark.ambiguous)) === 0);
      }
      if (marks !== 0) drawMarks(context, box, marks, layout.scale);
    }
  }
}

/** The body of the cylinder behind the taxels, darker towards its sides. */
function drawCylinder(context: CanvasRenderingContext2D, { width, height }: Layout): void {
  const shade = context.createLinearGradient(0, 0, width, 0);
  const [side, middle] = [cssValue("--cylinder-side"), cssValue("--cylinder")];
  for (const [at, colour] of [[0, side], [0.5, middle], [1, side]] as const) shade.addColorStop(at, colour);
  context.fillStyle = shade;
  context.fillRect(0, 0, width, height);
}

/** Draws the brackets around a taxel. */
export function drawSelected(
  context: CanvasRenderingContext2D,
  layout: Layout,
  picture: Picture,
  row: number,
  column: number,
): void {
  const box = layout.box(row * picture.block, column * picture.block, picture.block, picture.block);
  if (box.width < 1) return;
  drawSelection(context, box, layout.scale);
}

/** Spacing of the grid over an area, parts of its shorter side. */
const GRID = 4;

/** The area of a sensor that gives a position and no image: its ground, a grid, where it was trained, and each contact in the colour of its force. */
export function drawArea(
  context: CanvasRenderingContext2D,
  layout: Layout,
  { rows, columns, pitch_m: pitch, trained_m: trained }: Pick<Hello, "rows" | "columns" | "pitch_m" | "trained_m">,
  contacts: readonly Contact[],
  { map, high }: Pick<Colouring, "map" | "high">,
): void {
  const { width, height, scale } = layout;
  context.fillStyle = cssValue("--ground");
  context.fillRect(0, 0, width, height);
  context.strokeStyle = cssValue("--grid");
  context.lineWidth = scale;
  const step = Math.min(width, height) / GRID;
  context.beginPath();
  for (let x = width / 2 - step * Math.floor(width / 2 / step); x < width; x += step) context.rect(x, 0, 0, height);
  for (let y = height / 2 - step * Math.floor(height / 2 / step); y < height; y += step) context.rect(0, y, width, 0);
  context.stroke();
  context.strokeRect(scale / 2, scale / 2, width - scale, height - scale);
  const [rowPitch, columnPitch] = pitch ?? [1, 1];
  const across = (x: number): number => width / 2 + (x / columnPitch / columns) * width;
  const down = (y: number): number => height / 2 - (y / rowPitch / rows) * height;
  if (trained !== null) {
    const [[left, right], [bottom, top]] = trained;
    context.save();
    context.setLineDash([6 * scale, 4 * scale]);
    context.strokeStyle = cssValue("--dim");
    context.strokeRect(across(left), down(top), across(right) - across(left), down(bottom) - down(top));
    context.restore();
  }
  for (const { centre, force, certainty } of contacts) {
    if (certainty === "unknown") continue;
    const [x, y] = [across(centre[0]), down(centre[1])];
    if (!Number.isFinite(x) || !Number.isFinite(y) || !Number.isFinite(force[2])) continue;
    context.fillStyle = colourOf(map, force[2], 0, high);
    context.beginPath();
    context.arc(x, y, Math.min(width, height) / 14, 0, 2 * Math.PI);
    context.fill();
    context.stroke();
  }
}

/** Draws the shear of each taxel as an arrow from its centre; `limit` makes one of a taxel's length. */
export function drawShear(
  context: CanvasRenderingContext2D,
  layout: Layout,
  rows: number,
  columns: number,
  force: Float32Array,
  deviation: Float32Array,
  limit: number,
): void {
  const pitch = Math.min(layout.width / columns, layout.height / rows);
  for (let taxel = 0; taxel < rows * columns; taxel++) {
    const [x, y] = [force[3 * taxel] as number, force[3 * taxel + 1] as number];
    const shear = Math.hypot(x, y);
    const noise = Math.hypot(deviation[3 * taxel] as number, deviation[3 * taxel + 1] as number);
    const length = Math.min(1.6, shear / limit) * pitch;
    // An arrow within two standard deviations would only show noise.
    if (!(length > 3 * layout.scale) || shear < 2 * noise) continue;
    const share = ((taxel % columns) + 0.5) / columns;
    const startX = layout.across(share);
    if (Number.isNaN(startX)) continue;
    const startY = ((Math.floor(taxel / columns) + 0.5) * layout.height) / rows;
    drawArrow(context, startX, startY, (x / shear) * length * layout.shortened(share), (-y / shear) * length, layout.scale);
  }
}

/** An arrow in canvas coordinates (y down). */
export function drawArrow(
  context: CanvasRenderingContext2D,
  x: number,
  y: number,
  dx: number,
  dy: number,
  scale: number,
): void {
  const length = Math.hypot(dx, dy);
  const head = Math.min(6 * scale, length * 0.45);
  const [ux, uy] = [dx / length, dy / length];
  const [tipX, tipY] = [x + dx, y + dy];
  path(context, scale, 1.5, () => {
    context.moveTo(x, y);
    context.lineTo(tipX, tipY);
    context.moveTo(tipX - head * (ux - 0.6 * uy), tipY - head * (uy + 0.6 * ux));
    context.lineTo(tipX, tipY);
    context.lineTo(tipX - head * (ux + 0.6 * uy), tipY - head * (uy - 0.6 * ux));
  });
}

/** Draws centre, 95 % ellipse and number of each contact, and the centre of pressure. `pitch` in m, or 1 for cells. */
export function drawContacts(
  context: CanvasRenderingContext2D,
  layout: Layout,
  rows: number,
  columns: number,
  pitch: readonly [number, number],
  contacts: readonly Contact[],
  header: FrameHeader,
): void {
  const share = (x: number): number => x / (columns * pitch[1]) + 0.5;
  const flat = layout.turn === null ? layout.width / (columns * pitch[1]) : (layout.width * layout.turn.arc) / (2 * columns * pitch[1]);
  const perMetreY = layout.height / (rows * pitch[0]);
  const place = ([x, y]: readonly [number, number]): [number, number] => [
    layout.across(share(x)),
    layout.height / 2 - y * perMetreY,
  ];
  for (const { centre, covariance, id, certainty } of contacts) {
    const [x, y] = place(centre);
    if (!Number.isFinite(x) || !Number.isFinite(y)) continue;
    const [xx, xy, yy] = covariance;
    const perMetreX = flat * layout.shortened(share(centre[0]));
    drawEllipse(context, layout.scale, x, y, [
      xx * perMetreX ** 2,
      -xy * perMetreX * perMetreY,
      yy * perMetreY ** 2,
    ]);
    drawPlus(context, x, y, 4 * layout.scale, layout.scale);
    if (id > 0) drawNumber(context, layout, x, y, `${certainty === "exact" ? "" : certainty === "at_least" ? "≥ " : "? "}${id}`);
  }
  const [x, y] = place(header.centre);
  if (Number.isFinite(x) && Number.isFinite(y)) drawCentreOfPressure(context, x, y, layout.scale);
}

/** The number of a contact on a dark plate, beside its centre and within the image. */
function drawNumber(
  context: CanvasRenderingContext2D,
  { width, scale }: Layout,
  x: number,
  y: number,
  text: string,
): void {
  context.save();
  context.font = `600 ${12 * scale}px ${cssValue("--font")}`;
  context.textBaseline = "middle";
  const [plate, high, off] = [context.measureText(text).width + 6 * scale, 16 * scale, 8 * scale];
  const left = x + off + plate > width ? x - off - plate : x + off;
  const top = Math.max(0, y - off - high);
  context.fillStyle = "rgba(10, 12, 16, 0.85)";
  context.beginPath();
  context.roundRect(left, top, plate, high, 4 * scale);
  context.fill();
  context.fillStyle = "#fff";
  context.fillText(text, left + 3 * scale, top + high / 2 + scale / 2);
  context.restore();
}

/** Half axes of the ellipse that holds 95 % of a plane normal distribution, in deviations: the root of 5.991. */
const WITHIN_95 = 2.4477;

/** The 95 % ellipse of a covariance in canvas coordinates. */
export function drawEllipse(
  context: CanvasRenderingContext2D,
  scale: number,
  x: number,
  y: number,
  [xx, xy, yy]: readonly [number, number, number],
): void {
  const middle = (xx + yy) / 2;
  const radius = Math.hypot((xx - yy) / 2, xy);
  const major = WITHIN_95 * Math.sqrt(Math.max(0, middle + radius));
  const minor = WITHIN_95 * Math.sqrt(Math.max(0, middle - radius));
  if (!Number.isFinite(major) || major < scale) return;
  const angle = Math.atan2(2 * xy, xx - yy) / 2;
  path(context, scale, 1.25, () => context.ellipse(x, y, major, minor, angle, 0, 2 * Math.PI));
}

/** Centre of a contact. */
export function drawPlus(
  context: CanvasRenderingContext2D,
  x: number,
  y: number,
  size: number,
  scale: number,
): void {
  path(context, scale, 1.25, () => {
    context.moveTo(x - size, y);
    context.lineTo(x + size, y);
    context.moveTo(x, y - size);
    context.lineTo(x, y + size);
  });
}

/** The centre of pressure: a ring with a point. */
export function drawCentreOfPressure(
  context: CanvasRenderingContext2D,
  x: number,
  y: number,
  scale: number,
): void {
  path(context, scale, 1.5, () => context.arc(x, y, 6 * scale, 0, 2 * Math.PI));
  path(context, scale, 1, () => context.arc(x, y, 1.2 * scale, 0, 2 * Math.PI), true);
}
