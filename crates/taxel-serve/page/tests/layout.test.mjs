// The layout, measured: no text is cut, nothing overlaps, words have a contrast of 4.5, targets 44 px on a phone.
// Nine devices, four sizes, light, dark and forced colours.
//
//   npm run test:layout                 each device when it is touched: the short form of the gate
//   ALL=1 npm run test:layout           in all states: at rest, touched, overloaded, with a fault, link lost, ended
//   DEVICE=six-pads STATE=fault ALL=1 npm run test:layout
//
// Pictures are written to tests/screenshots/DEVICE-STATE-WIDTH-COLOURS.png. Settings as in harness.mjs.

import assert from "node:assert/strict";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { DEVICES, STATES } from "./devices.mjs";
import { drawn, faultsOfLayout, launch, moreFrames, opened, program, screenshots, started } from "./harness.mjs";

const SIZES = [[390, 844], [1024, 768], [1440, 900], [1920, 1080]];
const COLOURS = {
  light: { colorScheme: "light", forcedColors: "none" },
  dark: { colorScheme: "dark", forcedColors: "none" },
  forced: { colorScheme: "dark", forcedColors: "active" },
};
const all = process.env.ALL === "1";
/** What is looked at in the short form: every size, and every colours at one of them. */
const looked = (width, colours) => all || colours === "light" || width === 1024 || (width === 390 && colours === "dark");

let browser;
before(async () => (browser = await launch()));
after(() => browser?.close());

for (const { name, start } of DEVICES.filter(({ name }) => (process.env.DEVICE ?? name) === name)) {
  for (const state of STATES.filter((one) => (process.env.STATE ?? (all ? one : "touched")) === one)) {
    test(`${name}, ${state}`, async (context) => {
      const { url, stop } = await started(program(), ["live", ...start(state), "--port", "0"]);
      context.after(stop);
      const { tab, complaints, close } = await opened(browser, url, { expectErrors: state === "lost", viewport: { width: 1440, height: 900 } });
      context.after(close);
      await tab.waitForFunction(() => ["live", "ended"].includes(window.taxelTest.badge));
      if (state === "ended") await tab.waitForFunction(() => window.taxelTest.badge === "ended");
      else {
        await tab.waitForTimeout(name === "eflesh-lattice" ? 6000 : 3600);
        await moreFrames(tab, 2);
      }
      if (state === "lost") {
        await stop();
        await tab.waitForFunction(() => window.taxelTest.badge === "disconnected");
      }
      const skin = tab.locator('[data-testid="skin"]');
      if ((await skin.count()) > 0) {
        await skin.focus();
        await tab.keyboard.press("Home");
      }
      const wrong = [];
      for (const [width, height] of SIZES) {
        await tab.setViewportSize({ width, height });
        for (const [colours, media] of Object.entries(COLOURS)) {
          if (!looked(width, colours)) continue;
          await tab.emulateMedia(media);
          await drawn(tab);
          await tab.waitForTimeout(150);
          const found = await faultsOfLayout(tab, { targets: width === 390 });
          wrong.push(...found.map((words) => `${width} ${colours}: ${words}`));
          await tab.screenshot({ path: join(screenshots, `${name}-${state}-${width}-${colours}.png`), fullPage: width === 390 });
        }
      }
      assert.deepEqual(wrong, []);
      assert.deepEqual(complaints, []);
    });
  }
}
