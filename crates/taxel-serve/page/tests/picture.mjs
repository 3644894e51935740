// Makes the picture of the README: the shipped finger script while two fingers push against each other. With a
// sensor, its source and a taxel to point at, that of another device.
//
//   node tests/picture.mjs [SECONDS] [FILE] [SENSOR SOURCE ROW,COLUMN [LEAST]]
//   node tests/picture.mjs 8 ../../../docs/images/live-piezo.png piezo-1.5mm sim:piezo-slide 0,1 100
//   node tests/picture.mjs 8.5 ../../../docs/images/live-liquid-metal.png liquid-metal-2x4 sim:pad-b 0,1
//   node tests/picture.mjs 4.5 ../../../docs/images/live-mat.png resistive-mat-8x8 sim:mat-ghost 1,1
//
// With LEAST, the scale ends there, in the unit that is shown, and the display is frozen after these seconds at the first
// image that has 90 % of it. TAXEL and CHROMIUM are as in harness.mjs.

import { spawn } from "node:child_process";
import { dirname, join } from "node:path";
import { createInterface } from "node:readline";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

const repository = join(dirname(fileURLToPath(import.meta.url)), "../../../..");
const seconds = Number(process.argv[2] ?? 16.2);
const file = process.argv[3] ?? join(repository, "docs/images/live.png");
const program = process.env.TAXEL ?? join(repository, "target/release/taxel");

const [sensor, source, taxel = "3,1", least] = process.argv.slice(4);
const device = sensor === undefined ? [] : [sensor, "--source", source];

const server = spawn(program, ["live", ...device, "--port", "0"], { stdio: ["ignore", "pipe", "inherit"] });
try {
  const started = Date.now();
  const url = await new Promise((resolve) => createInterface({ input: server.stdout }).once("line", resolve));
  const browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--disable-gpu", "--disable-background-networking"],
  });
  const tab = await browser.newPage({ viewport: { width: 1366, height: 768 }, colorScheme: "light" });
  await tab.goto(url);
  const canvas = tab.getByTestId("skin");
  await canvas.focus();
  // The first key selects the first taxel.
  const [row, column] = taxel.split(",").map(Number);
  for (const key of ["Home", ...Array(row).fill("ArrowDown"), ...Array(column).fill("ArrowRight")]) {
    await canvas.press(key);
  }
  await canvas.evaluate((element) => element.blur());
  await tab.waitForTimeout(seconds * 1000 - (Date.now() - started));
  if (least !== undefined) {
    await tab.getByTestId("limit-high").fill(least);
    await tab.getByTestId("limit-high").press("Enter");
    await tab.waitForFunction(() => {
      const { max, high } = document.querySelector("[data-testid=skin]").dataset;
      const reached = Number(max) >= 0.9 * Number(high);
      if (reached) document.getElementById("pause").click();
      return reached;
    });
    await tab.waitForTimeout(300);
  }
  await tab.screenshot({ path: file });
  await browser.close();
} finally {
  server.kill("SIGINT");
}
