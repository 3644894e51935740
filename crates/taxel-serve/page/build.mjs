// Builds dist/ from src/. With --check: builds in memory and compares with dist/, byte for byte.

import { mkdir, readFile, readdir, rm, writeFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import * as esbuild from "esbuild";

const page = dirname(fileURLToPath(import.meta.url));
const dist = join(page, "dist");

/** The files of dist/, by name. The same sources give the same bytes. */
async function bundle() {
  const { version } = JSON.parse(await readFile(join(page, "node_modules/uplot/package.json"), "utf8"));
  const license = await readFile(join(page, "node_modules/uplot/LICENSE"), "utf8");
  const notice = `/*! Contains uPlot ${version}.\n\n${license.replaceAll("\r", "").trim()}\n*/`;
  const { outputFiles } = await esbuild.build({
    absWorkingDir: page,
    entryPoints: { app: "src/main.ts", "app.css": "src/style.css" },
    entryNames: "[name]",
    outdir: "dist",
    bundle: true,
    minify: true,
    format: "iife",
    target: "es2022",
    charset: "utf8",
    legalComments: "none",
    footer: { js: notice },
    write: false,
    logLevel: "warning",
  });
  const files = new Map();
  for (const file of outputFiles) {
    const name = file.path.endsWith(".css") ? "app.css" : "app.js";
    files.set(name, Buffer.from(file.contents));
  }
  files.set("index.html", await readFile(join(page, "src/index.html")));
  return files;
}

/** What is wrong with the committed dist/, in words; empty if it is current. */
async function differences(files) {
  const committed = await readdir(dist).catch(() => []);
  const found = committed
    .filter((name) => !files.has(name))
    .map((name) => `dist/${name} is not built any more`);
  for (const [name, fresh] of files) {
    const old = await readFile(join(dist, name)).catch(() => null);
    if (old === null) found.push(`dist/${name} is missing`);
    else if (!old.equals(fresh))
      found.push(`dist/${name} is stale (${old.length} bytes, now ${fresh.length})`);
  }
  return found;
}

const files = await bundle();
if (process.argv.includes("--check")) {
  const found = await differences(files);
  if (found.length > 0) {
    console.error(
      `${found.join("\n")}\nThe committed page is not that of src/: run \`npm run build\` and commit dist/.`,
    );
    process.exit(1);
  }
  console.log("dist/ is current");
} else {
  await rm(dist, { recursive: true, force: true });
  await mkdir(dist, { recursive: true });
  for (const [name, content] of files) {
    await writeFile(join(dist, name), content);
    console.log(`dist/${name}  ${content.length} bytes`);
  }
}
