// What the marks mean, drawn by the same functions as in the images.

import { colourOf, SEQUENTIAL } from "./colour";
import { create, cssValue } from "./dom";
import { drawArrow, drawCentreOfPressure, drawEllipse, drawPlus } from "./image";
import type { Box } from "./marks";
import { drawHatch, drawMarks, drawNoValue, Mark } from "./marks";

type Draw = (context: CanvasRenderingContext2D, box: Box, scale: number) => void;

const SIZE = 18;

const over =
  (marks: number): Draw =>
  (context, box, scale) =>
    drawMarks(context, box, marks, scale);

const colours = (): { none: string; hatch: string } => ({
  none: cssValue("--none"),
  hatch: cssValue("--hatch"),
});

const STATES: [string, Draw][] = [
  ["no value", (context, box) => drawNoValue(context, box, colours(), true)],
  ["masked", (context, box, scale) => drawHatch(context, box, colours(), scale)],
  ["faulty", over(Mark.faulty)],
  ["electrodes touch", over(Mark.contact)],
  ["out of range", over(Mark.outOfRange)],
  ["not converged", over(Mark.notConverged)],
  ["inconsistent", over(Mark.inconsistent)],
  ["unchecked", over(Mark.unchecked)],
];

const SHEAR: [string, Draw] = [
  "shear",
  (context, { x, y, width, height }, scale) =>
    drawArrow(context, x + width * 0.2, y + height * 0.75, width * 0.6, -height * 0.5, scale),
];

const CONTACTS: [string, Draw][] = [
  [
    "contact, 2σ",
    (context, { x, y, width, height }, scale) => {
      const [middleX, middleY] = [x + width / 2, y + height / 2];
      drawEllipse(context, scale, middleX, middleY, [(width * 0.19) ** 2, 0, (height * 0.15) ** 2]);
      drawPlus(context, middleX, middleY, 2.5 * scale, scale);
    },
  ],
  [
    "centre of pressure",
    (context, { x, y, width, height }, scale) =>
      drawCentreOfPressure(context, x + width / 2, y + height / 2, scale),
  ],
];

/** The legend for a kind of device. */
export class Legend {
  readonly root: HTMLElement;
  private readonly samples: [HTMLCanvasElement, Draw][] = [];

  constructor(kind: "three_axis" | "pressure_map") {
    const map: [string, Draw][] = [
      ["no reading", STATES[0]?.[1] as Draw],
      ["no sensel", STATES[1]?.[1] as Draw],
      ["faulty", over(Mark.faulty)],
      ["out of range", over(Mark.outOfRange)],
    ];
    const entries = kind === "three_axis" ? [...STATES, SHEAR, ...CONTACTS] : [...map, ...CONTACTS];
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
    for (const [canvas, draw] of this.samples) {
      const scale = devicePixelRatio;
      const size = Math.round(SIZE * scale);
      canvas.width = size;
      canvas.height = size;
      const context = canvas.getContext("2d");
      if (context === null) continue;
      context.fillStyle = colourOf(SEQUENTIAL, 0.3, 0, 1);
      context.fillRect(0, 0, size, size);
      draw(context, { x: 0, y: 0, width: size, height: size }, scale);
    }
  }
}
