// Makes the picture of the README: the shipped finger script while two fingers push against each other.
//
//   node tests/picture.mjs [SECONDS] [FILE]      (TAXEL and CHROMIUM as in browser.test.mjs)

import { spawn } from "node:child_process";
import { dirname, join } from "node:path";
import { createInterface } from "node:readline";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

const repository = join(dirname(fileURLToPath(import.meta.url)), "../../../..");
const seconds = Number(process.argv[2] ?? 16.2);
const file = process.argv[3] ?? join(repository, "docs/images/live.png");
const program = process.env.TAXEL ?? join(repository, "target/release/taxel");

const server = spawn(program, ["live", "--port", "0"], { stdio: ["ignore", "pipe", "inherit"] });
try {
  const started = Date.now();
  const url = await new Promise((resolve) => createInterface({ input: server.stdout }).once("line", resolve));
  const browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--disable-gpu", "--disable-background-networking"],
  });
  const tab = await browser.newPage({ viewport: { width: 1366, height: 768 }, colorScheme: "light" });
  await tab.goto(url);
  const box = await tab.getByTestId("image-fz").boundingBox();
  await tab.mouse.move(box.x + (1.5 / 8) * box.width, box.y + (3.5 / 8) * box.height);
  await tab.waitForTimeout(seconds * 1000 - (Date.now() - started));
  await tab.screenshot({ path: file });
  await browser.close();
} finally {
  server.kill("SIGINT");
}
