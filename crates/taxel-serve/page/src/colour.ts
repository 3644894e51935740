// Colour maps. Lightness changes evenly along each, so that they read well for colour-blind eyes and in grey.

/** A map as 256 CSS colours, lowest value first. */
export type ColourMap = readonly string[];

type Triple = readonly [number, number, number];

const STEPS = 256;

/** Nine colours of viridis (S. van der Walt, N. Smith, E. Firing; CC0). */
const VIRIDIS: readonly Triple[] = [
  [68, 1, 84],
  [71, 45, 123],
  [59, 82, 139],
  [44, 114, 142],
  [33, 144, 140],
  [39, 173, 129],
  [93, 200, 99],
  [170, 220, 50],
  [253, 231, 37],
];

/** Ten colours of inferno (S. van der Walt, N. Smith; CC0). */
const INFERNO: readonly Triple[] = [
  [0, 0, 4],
  [27, 12, 65],
  [74, 12, 107],
  [120, 28, 109],
  [165, 44, 96],
  [207, 68, 70],
  [237, 105, 37],
  [251, 155, 6],
  [247, 209, 61],
  [252, 255, 164],
];

/** The colours of heat, from zero upwards. */
export const HEAT: ColourMap = table((t) => along(INFERNO, t));

/** From black to white. */
export const GREY: ColourMap = table((t) => [255 * t, 255 * t, 255 * t]);

/** From zero upwards. */
export const SEQUENTIAL: ColourMap = table((t) => along(VIRIDIS, t));

/**
 * Blue below zero, red above, neutral at zero. In the dark the neutral colour is a grey that is plainly lighter than the
 * page, so that zero is seen as a value.
 */
export const DIVERGING: Record<"light" | "dark", ColourMap> = {
  light: diverging([0.4, -0.035, -0.135], [0.965, 0, 0], [0.44, 0.15, 0.085]),
  dark: diverging([0.86, -0.06, -0.085], [0.42, 0, -0.005], [0.84, 0.075, 0.1]),
};

/** Place of `value` in a map from `low` to `high`; values outside take the end colours. */
export function colourOf(map: ColourMap, value: number, low: number, high: number): string {
  const t = (value - low) / (high - low);
  const index = Math.min(map.length - 1, Math.max(0, Math.floor(t * map.length)));
  return map[index] ?? "transparent";
}

/** The map as a CSS gradient from left to right. */
export function gradientOf(map: ColourMap): string {
  const stops = Array.from({ length: 17 }, (_, stop) => map[Math.round((stop / 16) * (map.length - 1))]);
  return `linear-gradient(to right, ${stops.join(", ")})`;
}

function table(colour: (t: number) => Triple): ColourMap {
  return Array.from({ length: STEPS }, (_, step) => {
    const [red, green, blue] = colour(step / (STEPS - 1));
    return `rgb(${Math.round(red)}, ${Math.round(green)}, ${Math.round(blue)})`;
  });
}

/** Straight lines in OKLab from each end to the neutral colour: lightness is linear in the value. */
function diverging(negative: Triple, neutral: Triple, positive: Triple): ColourMap {
  return table((t) => fromOklab(along([negative, neutral, positive], t)));
}

function along(stops: readonly Triple[], t: number): Triple {
  const place = t * (stops.length - 1);
  const index = Math.min(Math.floor(place), stops.length - 2);
  const from = stops[index] as Triple;
  const to = stops[index + 1] as Triple;
  const mix = (k: 0 | 1 | 2): number => from[k] + (to[k] - from[k]) * (place - index);
  return [mix(0), mix(1), mix(2)];
}

/** OKLab (B. Ottosson, public domain) to sRGB in 0..255. */
function fromOklab([lightness, a, b]: Triple): Triple {
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
  return [
    gamma(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
    gamma(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
    gamma(-0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s),
  ];
}

function gamma(linear: number): number {
  const clipped = Math.min(1, Math.max(0, linear));
  return 255 * (clipped <= 0.0031308 ? 12.92 * clipped : 1.055 * clipped ** (1 / 2.4) - 0.055);
}
