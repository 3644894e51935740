// What the marks mean, drawn by the same functions as in the images.

import type { ColourMap } from "./colour";
import { colourOf, GREY, HEAT, SEQUENTIAL } from "./colour";
import { create, cssValue } from "./dom";
import { drawArrow, drawCentreOfPressure, drawEllipse, drawPlus } from "./image";
import type { Box, MarkColours } from "./marks";
import { drawBelowZeroGround, drawHatch, drawMarks, drawNoValue, Mark, markColours } from "./marks";
import type { Hello } from "./protocol";

type Draw = (context: CanvasRenderingContext2D, box: Box, scale: number, colours: MarkColours) => void;

const SIZE = 18;

const over =
  (marks: number): Draw =>
  (context, box, scale) =>
    drawMarks(context, box, marks, scale);

/** Of devices whose pressing has one sign. */
const BELOW_ZERO = "below zero: the zero is wrong";

const STATES: [string, Draw][] = [
  ["no value", (context, box, _, colours) => drawNoValue(context, box, colours, true)],
  ["masked", (context, box, scale, colours) => drawHatch(context, box, colours, scale)],
  ["faulty", over(Mark.faulty)],
  ["electrodes closed", over(Mark.closed)],
  ["out of range", over(Mark.outOfRange)],
  ["not converged", over(Mark.notConverged)],
  ["inconsistent", over(Mark.inconsistent)],
  ["unchecked", over(Mark.unchecked)],
  [
    BELOW_ZERO,
    (context, box, scale, colours) => {
      drawBelowZeroGround(context, box, colours);
      drawMarks(context, box, Mark.belowZero, scale);
    },
  ],
];

const BOUNDS: [string, Draw][] = [
  ["saturated: a bound", over(Mark.saturated)],
  ["ambiguous: one of several positions that explain the readings equally well", over(Mark.ambiguous)],
];

const SHEAR: [string, Draw] = [
  "shear",
  (context, { x, y, width, height }, scale) =>
    drawArrow(context, x + width * 0.2, y + height * 0.75, width * 0.6, -height * 0.5, scale),
];

const CONTACTS: [string, Draw][] = [
  [
    "contact with its number, 95 % ellipse",
    (context, { x, y, width, height }, scale) => {
      const [middleX, middleY] = [x + width / 2, y + height / 2];
      drawEllipse(context, scale, middleX, middleY, [(width * 0.155) ** 2, 0, (height * 0.12) ** 2]);
      drawPlus(context, middleX, middleY, 2.5 * scale, scale);
    },
  ],
  [
    "centre of pressure",
    (context, { x, y, width, height }, scale) =>
      drawCentreOfPressure(context, x + width / 2, y + height / 2, scale),
  ],
];

const TRAINED: [string, Draw] = [
  "dashed: pressed here in training",
  (context, { x, y, width, height }, scale) => {
    context.setLineDash([3 * scale, 2 * scale]);
    context.strokeStyle = cssValue("--ink");
    context.strokeRect(x + width * 0.2, y + height * 0.2, width * 0.6, height * 0.6);
  },
];

/** The legend for a device. */
export class Legend {
  readonly root: HTMLElement;
  private readonly samples: [HTMLCanvasElement, Draw][] = [];
  private readonly map: ColourMap;
  private readonly grayscale: boolean;

  constructor({ components, picture, signed, trained_m: trained }: Hello) {
    this.grayscale = picture === "grayscale";
    this.map = this.grayscale ? GREY : components === 1 && picture !== "map" ? HEAT : SEQUENTIAL;
    const ofMaps: [string, Draw][] = [
      ["no reading", STATES[0]?.[1] as Draw],
      ["no taxel", STATES[1]?.[1] as Draw],
      ["faulty", over(Mark.faulty)],
      ["out of range", over(Mark.outOfRange)],
    ];
    const states = (picture === "map" ? ofMaps : STATES).filter(([words]) => !(signed && components === 1) || words !== BELOW_ZERO);
    const entries = components === 3 ? [...states, SHEAR, ...CONTACTS] : [...states, ...CONTACTS];
    if (trained !== null) entries.push(TRAINED);
    if (components === 1 && picture !== "map") entries.push(...BOUNDS);
    if (this.grayscale && signed) entries.push(["pulled: a force below zero, as behind a finger that is pushed", over(Mark.pulled)]);
    this.root = create("ul", { class: "legend", "aria-label": "Legend" });
    for (const [words, draw] of entries) {
      const canvas = create("canvas", { "aria-hidden": "true" });
      this.samples.push([canvas, draw]);
      this.root.append(create("li", {}, canvas, words));
    }
    this.draw();
  }

  /** Draws the samples in the colours of the theme. */
  draw(): void {
    const colours = markColours(this.grayscale);
    for (const [canvas, draw] of this.samples) {
      const scale = devicePixelRatio;
      const size = Math.round(SIZE * scale);
      canvas.width = size;
      canvas.height = size;
      const context = canvas.getContext("2d");
      if (context === null) continue;
      context.fillStyle = colourOf(this.map, 0.3, 0, 1);
      context.fillRect(0, 0, size, size);
      draw(context, { x: 0, y: 0, width: size, height: size }, scale, colours);
    }
  }
}
