// One image on a canvas: cells in colour, marks, and what lies over them.

import type { ColourMap } from "./colour";
import { colourOf } from "./colour";
import { cssValue } from "./dom";
import type { Box, MarkColours } from "./marks";
import { drawBelowZeroGround, drawHatch, drawMarks, drawNoValue, drawSelection, Mark, path } from "./marks";
import type { Contact, FrameHeader } from "./protocol";

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

/** Where the cells of a picture lie on a canvas. */
export class Layout {
  readonly width: number;
  readonly height: number;
  /** Device pixels for one CSS pixel. */
  readonly scale: number;
  private readonly rows: number;
  private readonly columns: number;

  constructor(width: number, height: number, scale: number, rows: number, columns: number) {
    this.width = width;
    this.height = height;
    this.scale = scale;
    this.rows = rows;
    this.columns = columns;
  }

  /** The box of `span` x `span` cells from this one, with gaps between blocks of `block` cells. */
  box(row: number, column: number, block: number, span = 1): Box {
    const size = Math.min(this.width / this.columns, this.height / this.rows);
    const gap = size * block < 8 * this.scale ? 0 : this.scale;
    // Small cells keep a line on one side only, so that the lines do not outshine the values.
    const closing = size * block < 24 * this.scale ? 0 : gap;
    const hair = block > 1 && size > 8 * this.scale ? Math.max(1, Math.floor(this.scale / 2)) : 0;
    const left = Math.round((column * this.width) / this.columns) + (column % block === 0 ? gap : hair);
    const top = Math.round((row * this.height) / this.rows) + (row % block === 0 ? gap : hair);
    const right = Math.round(((column + span) * this.width) / this.columns);
    const bottom = Math.round(((row + span) * this.height) / this.rows);
    const endGap = (cell: number): number => (cell % block === 0 ? closing : 0);
    return {
      x: left,
      y: top,
      width: right - left - endGap(column + span),
      height: bottom - top - endGap(row + span),
    };
  }
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
  for (let row = 0; row < picture.rows; row++) {
    for (let column = 0; column < picture.columns; column++) {
      const cell = row * picture.columns + column;
      const value = picture.values[cell] as number;
      const marks = picture.marks[cell] as number;
      const box = layout.box(row, column, picture.block);
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

/** Draws the brackets around a taxel. */
export function drawSelected(
  context: CanvasRenderingContext2D,
  layout: Layout,
  picture: Picture,
  row: number,
  column: number,
): void {
  const box = layout.box(row * picture.block, column * picture.block, picture.block, picture.block);
  drawSelection(context, box, layout.scale);
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
    const startX = (((taxel % columns) + 0.5) * layout.width) / columns;
    const startY = ((Math.floor(taxel / columns) + 0.5) * layout.height) / rows;
    drawArrow(context, startX, startY, (x / shear) * length, (-y / shear) * length, layout.scale);
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

/** Draws centre, 95 % ellipse and number of each contact, and the centre of pressure. `pitch` in m. */
export function drawContacts(
  context: CanvasRenderingContext2D,
  layout: Layout,
  rows: number,
  columns: number,
  pitch: readonly [number, number],
  contacts: readonly Contact[],
  header: FrameHeader,
): void {
  const perMetreX = layout.width / (columns * pitch[1]);
  const perMetreY = layout.height / (rows * pitch[0]);
  const place = ([x, y]: readonly [number, number]): [number, number] => [
    layout.width / 2 + x * perMetreX,
    layout.height / 2 - y * perMetreY,
  ];
  for (const { centre, covariance, id } of contacts) {
    const [x, y] = place(centre);
    if (!Number.isFinite(x) || !Number.isFinite(y)) continue;
    const [xx, xy, yy] = covariance;
    drawEllipse(context, layout.scale, x, y, [
      xx * perMetreX ** 2,
      -xy * perMetreX * perMetreY,
      yy * perMetreY ** 2,
    ]);
    drawPlus(context, x, y, 4 * layout.scale, layout.scale);
    if (id > 0) drawNumber(context, layout, x, y, String(id));
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
