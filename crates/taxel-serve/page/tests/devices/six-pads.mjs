// The board of six-pads.toml: counts of six pads on the standard output. Its argument is the state: quiet, touched,
// overloaded or fault.

const state = process.argv[2] ?? "touched";
/** Counts of a press, and the end of the converter. */
const PRESS = { quiet: 0, touched: 140, overloaded: 900, fault: 90 }[state] ?? 0;
const FULL = 1023;
const REST_FRAMES = 75;

// A fixed sequence, so that the pictures are the same each time.
let seed = 7;
const random = () => (seed = (seed * 16807) % 2147483647) / 2147483647;

let frame = 0;
setInterval(() => {
  const time = frame / 50;
  const values = Array.from({ length: 6 }, (_, pad) => {
    const noise = 3 * (random() + random() - 1);
    const press = frame < REST_FRAMES || pad % 2 === 1 ? 0 : PRESS * (0.9 + 0.1 * Math.sin(2 * time - pad));
    return Math.min(FULL, Math.round(500 + 12 * pad + press + noise));
  });
  // A pad whose lead is off: the converter gives nothing.
  if (state === "fault" && frame >= REST_FRAMES) values[3] = "";
  process.stdout.write(`${frame % 65536},${values.join(",")}\n`);
  frame += 1;
}, 20);
