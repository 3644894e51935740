// Every shipped file is valid for its schema, and one mistake gives one error at its key: by Taplo,
// which editors use, and by a JSON-schema validator. Run with `npm test`.
import { spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { test } from "node:test";
import assert from "node:assert/strict";
import Ajv from "ajv/dist/2020.js";
import { parse } from "smol-toml";

const here = fileURLToPath(new URL(".", import.meta.url));
const sensors = join(here, "../../sensors");
const taplo = join(here, "node_modules/@taplo/cli/dist/cli.js");
const folder = mkdtempSync(join(tmpdir(), "taxel-schema-"));
process.on("exit", () => rmSync(folder, { recursive: true, force: true }));

const kinds = {
    sensor: { files: sensors, schema: join(sensors, "sensor.schema.json") },
    stimulus: { files: join(sensors, "stimuli"), schema: join(sensors, "stimulus.schema.json") },
};
const ajv = new Ajv({ allErrors: true, strict: false, logger: false });
for (const kind of Object.values(kinds)) {
    kind.validate = ajv.compile(JSON.parse(readFileSync(kind.schema, "utf8")));
}

/// Errors of the validator as the path of their key. `if` only repeats what `then` found.
function validated(kind, text) {
    if (kind.validate(parse(text))) return [];
    return kind.validate.errors
        .filter((error) => error.keyword !== "if")
        .map((error) => error.instancePath.slice(1).replaceAll("/", "."));
}

/// Different errors of Taplo in each of the files of `texts`, each with the line of its first mark. Taplo
/// marks an error of a table under the table and once more under every key in it.
function checked(kind, texts) {
    const files = texts.map((text, index) => {
        const file = join(folder, `${index}.toml`);
        writeFileSync(file, text);
        return file;
    });
    // One run for all: it takes two seconds to start.
    const options = ["check", "--colors", "never", "--schema", pathToFileURL(kind.schema).href];
    const run = spawnSync(process.execPath, [taplo, ...options, ...files], {
        encoding: "utf8",
        cwd: folder,
        maxBuffer: 1 << 28,
    });
    const output = run.stdout + run.stderr;
    const found = files.map(() => new Map());
    for (const [, message, file, line] of output.matchAll(/^error: (.*)\n.*┌─ (.*):(\d+):\d+$/gm)) {
        const errors = found[files.indexOf(file)];
        if (!errors.has(message)) errors.set(message, Number(line));
    }
    assert.equal(run.status === 0, found.every((errors) => errors.size === 0), output.slice(0, 2000));
    return found.map((errors) => [...errors.values()]);
}

for (const [name, kind] of Object.entries(kinds)) {
    test(`every shipped ${name} is valid`, () => {
        const files = readdirSync(kind.files).filter((file) => file.endsWith(".toml"));
        assert.ok(files.length > 1);
        // Without the directive that names a schema beside the file.
        const texts = files.map((file) => readFileSync(join(kind.files, file), "utf8").replace(/^#:schema.*/, ""));
        for (const [index, text] of texts.entries()) assert.deepEqual(validated(kind, text), [], files[index]);
        for (const [index, errors] of checked(kind, texts).entries()) assert.deepEqual(errors, [], files[index]);
    });
}

// What is written in the place of what, the key that the error names, and its line where it is not
// that of the mistake.
const mistakes = [
    ["sensor", "three-axis-8x8", "unit", 'air_gap = "6 um"', 'air_gap = "6 kPa"', "element.three_axis_capacitor.plates.air_gap"],
    ["sensor", "in-plane-50um", "unit in a table of a table", 'thickness = "950 um"', 'thickness = "950 N"', "element.in_plane_capacitor.layer.thickness"],
    ["sensor", "three-axis-unit", "misspelt key", "centre_distance = ", "center_distance = ", "element.three_axis_capacitor.suspension.center_distance"],
    ["sensor", "piezo-1.5mm", "unknown key", "[element.piezoelectric.cover]", '[element.piezoelectric.cover]\ncolour = "grey"', "element.piezoelectric.cover.colour", "colour"],
    ["sensor", "piezo-2.3mm", "sign", 'preload = "', 'preload = "-', "element.piezoelectric.cover.preload"],
    ["sensor", "liquid-metal-2x4", "range of a number", "poisson_ratio = 0.5", "poisson_ratio = 0.6", "element.microchannel.closed_form.poisson_ratio"],
    ["sensor", "in-plane-20um", "wrong name of a value", 'law = "mechanics"', 'law = "mechanik"', "element.in_plane_capacitor.law"],
    ["sensor", "three-axis-8x8", "wrong name beside tables", 'mount = "flat"', 'mount = "flatt"', "array.mount"],
    ["sensor", "piezo-1.5mm", "wrong name of a table", "element.piezoelectric", "element.piezo_electric", "element.piezo_electric"],
    ["sensor", "eflesh-lattice", "missing key", /^rows = .*\n/m, "", "array", "[array]"],
    ["sensor", "three-axis-8x8", "type", "rows = 8", 'rows = "8"', "array.rows"],
    ["stimulus", "finger", "unit", 'radius = "4 mm"', 'radius = "4 mN"', "finger.0.radius"],
    ["stimulus", "press", "unknown key", 'schema = 1', 'schema = 1\nspeed = 2', "speed", "speed"],
];

for (const [of, kind] of Object.entries(kinds)) {
    const cases = mistakes.filter(([file]) => file === of);
    const wrong = cases.map(([, name, what, from, to]) => {
        const text = readFileSync(join(kind.files, `${name}.toml`), "utf8").replace(/^#:schema.*/, "");
        return what === "wrong name of a table" ? text.replaceAll(from, to) : text.replace(from, to);
    });
    test(`${of}: one mistake is one error at its key, in a validator`, () => {
        for (const [index, [, , what, , , key]] of cases.entries()) {
            assert.deepEqual(validated(kind, wrong[index]), [key], what);
        }
    });
    test(`${of}: one mistake is one error at its key, in Taplo`, () => {
        for (const [index, errors] of checked(kind, wrong).entries()) {
            const [, , what, , to, , at] = cases[index];
            const line = wrong[index].split("\n").findIndex((line) => line.includes(at ?? to)) + 1;
            assert.deepEqual(errors, [line], what);
        }
    });
}
