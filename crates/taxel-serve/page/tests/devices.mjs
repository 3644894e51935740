// Nine devices in their states, for the proof of the layout: what `taxel live` is started with, and when to look.

import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { program, repository, screenshots, tests } from "./harness.mjs";

export const STATES = ["rest", "touched", "overloaded", "fault", "lost", "ended"];

const made = join(screenshots, "made");
const recordings = join(repository, "crates/taxel-recording/tests/recordings");
const sensors = join(repository, "crates/taxel/sensors");

/** A file that a test needs and that is not committed. */
function file(name, text) {
  mkdirSync(made, { recursive: true });
  const path = join(made, name);
  writeFileSync(path, text);
  return path;
}

const at = (time, position, force) => `  { time = "${time} s", ${position}force = ["0 N", "0 N", "${force}"] },\n`;

/** A script of the twin: someone presses from 2 s on and holds, or nobody does. */
function script(name, { finger, probe, touched, overloaded }, state) {
  const force = state === "overloaded" ? overloaded : touched;
  let text = `schema = 1\nname = "${name} ${state}"\nduration = "600 s"\n`;
  const position = finger === undefined ? "" : `at = ["${finger[0]}", "${finger[1]}"], `;
  const path = `path = [\n${at(2, position, "0 N")}${at(2.5, position, force)}${at(599, position, force)}]\n`;
  if (state !== "rest") {
    text += finger === undefined ? `\n[[probe]]\ntaxel = [${probe}]\n${path}` : `\n[[finger]]\nradius = "${finger[2]}"\n${path}`;
  }
  if (state === "fault") text += `\n[[fault]]\nchannel = { taxel = [0, 0] }\nreads = "dead"\nfrom = "3 s"\nto = "600 s"\n`;
  return file(`${name}-${state}.toml`, text);
}

/** A sensor whose frames come from the twin. `ended` is a replay of what it gave when it was touched. */
function simulated(name, loads, sensor = () => name) {
  return {
    name,
    start(state) {
      if (state === "ended") {
        const saved = join(made, `${name}-touched.csv`);
        if (!existsSync(saved)) {
          const source = `sim:${script(name, loads, "touched")}`;
          const device = [sensor(), "--source", source, "--no-tare"];
          const rate = name.startsWith("piezo") ? 1000 : name === "three-axis-8x8" ? 60 : name.startsWith("resistive") ? 50 : 100;
          execFileSync(program(), ["live", ...device, "--headless", "--speed", "max", "--frames", String(3 * rate), "--save", saved], { stdio: ["ignore", "ignore", "ignore"] });
        }
        return [sensor(), "--source", `replay:${saved}`, "--speed", "10"];
      }
      return [sensor(), "--source", `sim:${script(name, loads, state === "lost" ? "touched" : state)}`];
    },
  };
}

/** The piezoelectric array as a sleeve. */
function sleeve() {
  const text = readFileSync(join(sensors, "piezo-1.5mm.toml"), "utf8");
  const round = text.replace('mount = "flat"', 'mount = { cylinder = { radius = "6 mm", unstretched_plane = "0.5 mm" } }');
  if (round === text) throw new Error("piezo-1.5mm.toml is not flat");
  return file("piezo-sleeve.toml", round);
}

const lattice = {
  name: "eflesh-lattice",
  start(state) {
    const calibration = join(made, "lattice.toml");
    mkdirSync(made, { recursive: true });
    if (!existsSync(calibration)) {
      execFileSync(program(), ["calibrate", "eflesh-lattice", join(recordings, "lattice"), "-o", calibration], { stdio: "ignore" });
    }
    const lines = readFileSync(join(recordings, "lattice/force_sensor.csv"), "utf8").trim().split("\n");
    // The recording begins at rest and presses again and again.
    const rows = lines.map((line) => line.split(",").map(Number));
    const rest = rows[0];
    let picked = rows;
    // Nothing presses in its first frames, which are played again and again.
    if (state === "rest") picked = Array.from({ length: 400 }, (_, row) => [0.04 * row, ...rows[row % 20].slice(1)]);
    if (state === "ended") picked = rows.slice(0, 200);
    if (state === "overloaded") picked = rows.map(([time, ...values]) => [time, ...values.map((value, channel) => rest[channel + 1] + 3 * (value - rest[channel + 1]))]);
    if (state === "fault") picked = rows.map(([time, ...values], row) => [time, ...values.map((value, channel) => (channel === 4 && row > 30 ? 0 : value))]);
    const source = file(`lattice-${state}.csv`, `${picked.map((row) => row.join(",")).join("\n")}\n`);
    const speed = state === "ended" ? ["--speed", "20"] : [];
    return ["eflesh-lattice", "--calibration", calibration, "--source", `replay:${source}`, ...speed];
  },
};

const pads = {
  name: "six-pads",
  start(state) {
    const board = ["--raw", "--board", join(tests, "devices/six-pads.toml")];
    if (state === "ended") {
      const saved = join(made, "six-pads.csv");
      if (!existsSync(saved)) {
        execFileSync(program(), ["live", ...board, "--source", `exec:node '${join(tests, "devices/six-pads.mjs")}' touched`, "--headless", "--frames", "100", "--save", saved], { stdio: "ignore" });
      }
      return ["--raw", "--source", `replay:${saved}`, "--speed", "10"];
    }
    const shown = { rest: "quiet", lost: "touched" }[state] ?? state;
    return [...board, "--source", `exec:node '${join(tests, "devices/six-pads.mjs")}' ${shown}`];
  },
};

export const DEVICES = [
  simulated("three-axis-8x8", { finger: ["1 mm", "0 mm", "4 mm"], touched: "80 mN", overloaded: "2 N" }),
  simulated("liquid-metal-2x4", { probe: [0, 1], touched: "3 mN", overloaded: "40 mN" }),
  simulated("in-plane-50um", { probe: [0, 0], touched: "12 N", overloaded: "90 N" }),
  simulated("piezo-sleeve", { finger: ["-2 mm", "2 mm", "1.5 mm"], touched: "0.4 N", overloaded: "40 N" }, sleeve),
  lattice,
  simulated("resistive-mat-8x8", { probe: [2, 5], touched: "5 N", overloaded: "80 N" }),
  simulated("pressure-chips-1x8", { finger: ["4 mm", "0 mm", "6 mm"], touched: "0.4 N", overloaded: "20 N" }),
  simulated("magnet-over-four-hall", { probe: [0, 0], touched: "0.6 N", overloaded: "8 N" }),
  pads,
];
