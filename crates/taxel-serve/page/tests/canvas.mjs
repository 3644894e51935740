// How old a reading is when it stands on the canvas: from the moment its packet is written to a
// socket, by the clock of this computer. Frames come by the millisecond, the page draws when the
// browser asks for a picture.
//
//   node tests/canvas.mjs [SENSOR [BOARD [SECONDS]]]
//
//   TAXEL, CHROMIUM   as in browser.test.mjs

import { spawn } from "node:child_process";
import { existsSync } from "node:fs";
import { createServer } from "node:net";
import { dirname, join } from "node:path";
import { createInterface } from "node:readline";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

const repository = join(dirname(fileURLToPath(import.meta.url)), "../../../..");
const [sensor = join(repository, "crates/taxel/sensors/force-4x4.toml"), board = "taxel-wire-1", length = "30"] =
  process.argv.slice(2);
const program = process.env.TAXEL ?? join(repository, "target/release/taxel");
if (!existsSync(program)) throw new Error(`the program taxel is missing: ${program}`);
const PERIOD_MS = 1;
const BEFORE_S = 5;
const seconds = Number(length);
const now = () => performance.timeOrigin + performance.now();

/** Packets of a virtual device, each with the zero that ends it. */
async function packets(count) {
  const rate = `${1 / PERIOD_MS} kHz`;
  const device = spawn(program, ["device", sensor, "--board", board, "--on", "-", "--rate", rate, "--frames", String(count)], {
    stdio: ["ignore", "pipe", "inherit"],
  });
  const found = [];
  let rest = Buffer.alloc(0);
  for await (const bytes of device.stdout) {
    rest = Buffer.concat([rest, bytes]);
    for (let end = rest.indexOf(0); end >= 0; end = rest.indexOf(0)) {
      found.push(rest.subarray(0, end + 1));
      rest = rest.subarray(end + 1);
    }
    if (found.length >= count) break;
  }
  device.kill("SIGKILL");
  if (found.length < count) throw new Error(`the virtual device sent ${found.length} packets of ${count}`);
  return found.slice(0, count);
}

/** Writes the packets to who connects, each at its time; when each was written. */
async function board_on_tcp(all) {
  const written = [];
  const server = createServer({ noDelay: true }, (socket) => {
    socket.on("error", () => {});
    const began = now();
    const step = () => {
      while (written.length < all.length && now() >= began + written.length * PERIOD_MS) {
        const packet = all[written.length];
        written.push(now());
        socket.write(packet);
      }
      if (written.length < all.length) setTimeout(step, PERIOD_MS);
    };
    step();
  });
  await new Promise((done) => server.listen(0, "127.0.0.1", done));
  return { written, server, port: server.address().port };
}

const quantile = (sorted, share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
function tell(name, values) {
  const sorted = [...values].sort((a, b) => a - b);
  const [half, most, nearly] = [0.5, 0.99, 0.999].map((share) => quantile(sorted, share).toFixed(2));
  console.log(`${name.padEnd(44)} ${half.padStart(7)} ${most.padStart(7)} ${nearly.padStart(7)} ${String(sorted.length).padStart(7)}`);
}

const all = await packets(((BEFORE_S + seconds) * 1000) / PERIOD_MS);
const { written, server, port } = await board_on_tcp(all);
const live = spawn(program, ["live", sensor, "--board", board, "--source", `tcp:127.0.0.1:${port}`, "--port", "0"], {
  stdio: ["ignore", "pipe", "inherit"],
});
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu", "--disable-background-networking"],
});
try {
  const url = await new Promise((found) =>
    createInterface({ input: live.stdout }).on("line", (line) => {
      const match = /http:\/\/127\.0\.0\.1:\d+\/\?token=[0-9a-f]+/i.exec(line);
      if (match !== null) found(match[0]);
    }),
  );
  const tab = await browser.newPage({ viewport: { width: 1366, height: 768 } });
  await tab.goto(url);
  await tab.waitForFunction(() => window.taxelTest.frames > 0);
  // The clocks of the two programs, by the quickest of many questions.
  let best = { width: Infinity, ahead: 0 };
  for (let question = 0; question < 300; question += 1) {
    const before = now();
    const there = await tab.evaluate(() => performance.timeOrigin + performance.now());
    const after = now();
    if (after - before < best.width) best = { width: after - before, ahead: there - (before + after) / 2 };
  }
  await tab.evaluate(() => {
    window.measured = [];
    window.taxelTest.onDrawn = (header, arrived) => {
      const at = performance.timeOrigin + performance.now();
      window.measured.push([Number(header.sequence), performance.timeOrigin + arrived, at]);
    };
  });
  await new Promise((done) => setTimeout(done, seconds * 1000 - 3000));
  const measured = await tab.evaluate(() => window.measured);
  // A device says now and then who it is; what has another length is no frame.
  const frames = written.filter((_, place) => all[place].length === all[100].length);
  const rows = measured
    .map(([sequence, arrived, drawn]) => [frames[sequence], arrived - best.ahead, drawn - best.ahead])
    .filter(([at]) => at !== undefined);
  console.log(`${all.length} packets of ${all[100].length} bytes, one each ${PERIOD_MS} ms; clocks within ±${(best.width / 2).toFixed(2)} ms`);
  console.log(`${"ms, of the readings drawn".padEnd(44)}    50 %    99 %  99.9 %   count`);
  tell("written to the socket -> read by the page", rows.map(([at, arrived]) => arrived - at));
  tell("read by the page -> on the canvas", rows.map(([, arrived, drawn]) => drawn - arrived));
  tell("written to the socket -> on the canvas", rows.map(([at, , drawn]) => drawn - at));
} finally {
  await browser.close();
  live.kill("SIGTERM");
  server.close();
}
process.exit(0);
