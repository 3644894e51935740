// What the image of the skin can show: values of one component, readings, their change, states. One picture for each.

import type { ColourMap } from "./colour";
import { DIVERGING, GREY, HEAT, SEQUENTIAL } from "./colour";
import { cssValue } from "./dom";
import type { Picture } from "./image";
import { Mark, marksOfStates } from "./marks";
import type { Frame, Hello } from "./protocol";
import { Scale } from "./scale";
import type { Theme } from "./theme";
import type { Quantities, Quantity } from "./units";

export interface Layer {
  id: string;
  label: string;
  note: string;
  /** Null for states. */
  quantity: Quantity | null;
  scale: Scale;
  picture: Picture;
  grayscale: boolean;
  /** Whether shear arrows and contacts lie over it. */
  over: boolean;
  map(theme: Theme): ColourMap;
  fill(frame: Frame): void;
}

/** The scale of a grey image shrinks no further than to this part of the full scale. */
const GREY_FLOOR = 0.1;
/** Without a full scale it shrinks no further than to this part of the largest value that was ever seen. */
const SEEN_FLOOR = 0.2;
/** A force of the other sign is marked from this many of its standard deviations on, as contacts are. */
const CLEAR = 6;
/** Smallest width of the scale of readings and of their changes, of the mean of the rest values. */
const READING_FLOOR = 0.1;
const CHANGE_FLOOR = 0.02;
const LEAST = 1e-18;

/** Marks of the states of channels, by name. */
const CHANNEL_MARKS: Record<string, number> = {
  masked: Mark.masked,
  faulty: Mark.faulty,
  saturated: Mark.faulty,
  closed: Mark.closed,
};

/** The layers of a device, the first of which is shown at first. `rest` are the rest values in force, SI. */
export function layersOf(hello: Hello, quantities: Quantities, rest: () => readonly (number | null)[] | null): Layer[] {
  const { components, wiring } = hello;
  const layers = components === 3 ? vectorLayers(hello, quantities) : [valueLayer(hello, quantities)];
  const four = wiring.kind === "per_taxel" && wiring.channels === 4;
  const one = wiring.kind === "per_taxel" && wiring.channels === 1;
  if (four || one) {
    // The values of a map are its readings.
    if (hello.picture !== "map") layers.push(readingLayer(hello, quantities, four ? 2 : 1, null));
    layers.push(readingLayer(hello, quantities, four ? 2 : 1, rest));
  }
  return [...layers, stateLayer(hello)];
}

function emptyPicture({ rows, columns }: Hello, block: 1 | 2): Picture {
  const cells = block * block * rows * columns;
  return {
    rows: block * rows,
    columns: block * columns,
    block,
    values: new Float64Array(cells),
    marks: new Uint16Array(cells),
  };
}

/** Least end of the scale of values, SI. */
function scaleFloor({ full_scale: fullScale, picture }: Hello): number {
  if (fullScale === null) return LEAST;
  // Grey shows how taxels compare, and light touches are most of what they read.
  return Number((picture === "grayscale" ? GREY_FLOOR * fullScale : fullScale).toPrecision(3));
}

function vectorLayers(hello: Hello, { value }: Quantities): Layer[] {
  const floor = scaleFloor(hello);
  const pressing = new Scale("positive", floor);
  // The shears share one scale, so that they can be compared.
  const shear = new Scale("symmetric", floor);
  const of = (axis: number): ((frame: Frame) => void) => filler(hello, axis, layers[axis] as Layer);
  const layer = (id: string, label: string, note: string, axis: number): Layer => ({
    id,
    label,
    note,
    quantity: value,
    scale: axis === 2 ? pressing : shear,
    picture: emptyPicture(hello, 1),
    grayscale: false,
    over: axis === 2,
    map: (theme) => (axis === 2 ? SEQUENTIAL : DIVERGING[theme]),
    fill: (frame) => of(axis)(frame),
  });
  const layers = [
    layer("x", "Shear x", "positive to the right", 0),
    layer("y", "Shear y", "positive upwards", 1),
    layer("z", "Pressing", "arrows: shear", 2),
  ];
  return [layers[2], layers[0], layers[1]] as Layer[];
}

function valueLayer(hello: Hello, { value }: Quantities): Layer {
  const { picture, signed } = hello;
  const grayscale = picture === "grayscale";
  const layer: Layer = {
    id: "value",
    label: named(hello.value.quantity),
    note: grayscale && signed ? "brighter: larger; minus: pulled" : "",
    quantity: value,
    scale: new Scale(signed && !grayscale ? "symmetric" : "positive", scaleFloor(hello)),
    picture: emptyPicture(hello, 1),
    grayscale,
    over: true,
    map: (theme) => (picture === "map" && !signed ? SEQUENTIAL : grayscale ? GREY : signed ? DIVERGING[theme] : HEAT),
    fill: (frame) => filler(hello, 0, layer)(frame),
  };
  return layer;
}

/** Puts a component of the values into the picture of a layer. */
function filler(hello: Hello, axis: number, { picture: { values, marks }, scale, grayscale }: Layer): (frame: Frame) => void {
  const { components, full_scale: fullScale } = hello;
  const ofState = marksOfStates(hello.states);
  return (frame) => {
    let largest = 0;
    for (let taxel = 0; taxel < values.length; taxel++) {
      // Before there is a zero a value is no force.
      const value = frame.header.zeroKnown ? (frame.value[components * taxel + axis] as number) : Number.NaN;
      values[taxel] = grayscale ? Math.abs(value) : value;
      if (Math.abs(value) > largest) largest = Math.abs(value);
      const mark = frame.header.zeroKnown ? (ofState[frame.state[taxel] as number] ?? 0) : Mark.none;
      // Shear has either sign: only pressing is shown as below zero.
      marks[taxel] = axis < components - 1 ? mark & ~Mark.belowZero : mark;
      const deviation = frame.deviation[components * taxel + axis] as number;
      if (grayscale && value < -CLEAR * deviation) marks[taxel] = (marks[taxel] as number) | Mark.pulled;
    }
    if (fullScale === null) scale.floor = Math.max(scale.floor, SEEN_FLOOR * largest);
  };
}

/** Channels where they lie in their taxel: four in its corners, or one. Their change against `rest` where it is given. */
function readingLayer(
  hello: Hello,
  { reading }: Quantities,
  block: 1 | 2,
  rest: (() => readonly (number | null)[] | null) | null,
): Layer {
  const { columns } = hello;
  const scale = new Scale(rest === null ? "range" : "symmetric", LEAST);
  const picture = emptyPicture(hello, block);
  const ofState = hello.channel_states.map((state) => CHANNEL_MARKS[state] ?? Mark.none);
  return {
    id: rest === null ? "readings" : "change",
    label: rest === null ? named(hello.reading.quantity) : "Change",
    note: rest === null ? "as measured" : "of the readings, against rest",
    quantity: reading,
    scale,
    picture,
    grayscale: false,
    over: false,
    map: (theme) => (rest === null ? SEQUENTIAL : DIVERGING[theme]),
    fill(frame) {
      const zero = rest?.() ?? null;
      let sum = 0;
      for (let channel = 0; channel < frame.reading.length; channel++) {
        const taxel = block === 2 ? channel >> 2 : channel;
        const [down, right] = block === 2 ? [(channel >> 1) & 1, channel & 1] : [0, 0];
        const row = block * Math.floor(taxel / columns) + down;
        const cell = row * block * columns + block * (taxel % columns) + right;
        const shown = frame.reading[channel] as number;
        if (Number.isFinite(shown)) sum += Math.abs(shown);
        picture.values[cell] = rest === null ? shown : shown - (zero?.[channel] ?? Number.NaN);
        picture.marks[cell] = ofState[frame.channelState[channel] as number] ?? Mark.none;
      }
      const mean = sum / frame.reading.length;
      if (mean > 0) scale.floor = Number(((rest === null ? READING_FLOOR : CHANGE_FLOOR) * mean).toPrecision(2));
    },
  };
}

/** A taxel that is well in one colour, every other state in a second; the marks say which. */
function stateLayer(hello: Hello): Layer {
  const picture = emptyPicture(hello, 1);
  const ofState = marksOfStates(hello.states);
  return {
    id: "state",
    label: "State",
    note: "what the marks mean: ?",
    quantity: null,
    scale: new Scale("positive", 1),
    picture,
    grayscale: false,
    over: false,
    map: () => [cssValue("--well"), cssValue("--ill")],
    fill(frame) {
      for (let taxel = 0; taxel < picture.values.length; taxel++) {
        picture.marks[taxel] = ofState[frame.state[taxel] as number] ?? Mark.none;
        picture.values[taxel] = picture.marks[taxel] === Mark.none ? 0 : 1;
      }
    },
  };
}

/** A quantity of the protocol as a title. */
export function named(quantity: string): string {
  const words = quantity === "raw" ? "readings" : quantity.replaceAll("_", " ");
  return words.charAt(0).toUpperCase() + words.slice(1);
}
