#!/usr/bin/env python3
"""Public recordings that are no part of this repository: what the program finds in them, beside what it found when
this table was written. Ends with 1 if a figure differs.

    bench/public.py [PROGRAM] [FOLDER]

PROGRAM is `target/release/taxel` by default, FOLDER `$TAXEL_PUBLIC` or `../shared/data`; a folder that is missing is
said, and nothing is compared. FOLDER has `pressure-formats` (Telfer/pressuRe, f847da53, `inst/extdata`),
`eflesh` (notvenky/eFlesh, ab5ca56a, `characterization/datasets`) and `boards/optoforce/capture.bin`
(alknemeyer/optoforce, 88cfbf5f, `tests/test-data.bin`).
"""

import csv
import json
import os
import subprocess
import sys
import tempfile
from bisect import bisect_left
from math import sqrt
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "target/release/taxel").resolve()
FOLDER = Path(sys.argv[2] if len(sys.argv) > 2 else os.environ.get("TAXEL_PUBLIC", ROOT.parent / "shared/data"))
GRAM = 9.80665e-3  # N

# Figure: what the program found, and by how much another processor may differ: counts not at all, sums by their
# rounding, trained maps by what rounding moves in a search that ends at a tolerance.
WRITTEN = {
    "iscan: frames": (309, 0),
    "iscan: last time, ns": (31100000000, 0),
    "iscan: largest sum of readings": (838.0, 1e-6),
    "iscan: largest reading": (100, 0),
    "iscan: touch": (1, 0),
    "iscan: split": (0, 0),
    "iscan: merged": (0, 0),
    "iscan: release": (1, 0),
    "fscan: frames": (205, 0),
    "fscan: last time, ns": (6528000000, 0),
    "fscan: largest sum of readings": (35819.0, 1e-6),
    "fscan: largest reading": (760, 0),
    "fscan: touch": (17, 0),
    "fscan: split": (16, 0),
    "fscan: merged": (6, 0),
    "fscan: release": (27, 0),
    "xsensor.left: frames": (101, 0),
    "xsensor.left: last time, ns": (1331000000, 0),
    "xsensor.left: largest sum of readings": (43730.17, 1e-6),
    "xsensor.left: largest reading": (2957.46, 0),
    "xsensor.left: touch": (3, 0),
    "xsensor.left: split": (2, 0),
    "xsensor.left: merged": (1, 0),
    "xsensor.left: release": (4, 0),
    "xsensor.right: frames": (101, 0),
    "xsensor.right: last time, ns": (1331000000, 0),
    "xsensor.right: largest sum of readings": (27825.92, 1e-6),
    "xsensor.right: largest reading": (929.46, 0),
    "xsensor.right: touch": (2, 0),
    "xsensor.right: split": (1, 0),
    "xsensor.right: merged": (0, 0),
    "xsensor.right: release": (2, 0),
    "optoforce: frames": (34320, 0),
    "optoforce: lost": (54, 0),
    "optoforce: last number": (45999, 0),
    "position, fixed depth: rows without a position": (0, 0),
    "position, fixed depth: distance, mm rms": (0.2507, 1e-3),
    "position, fixed depth: within 95 % intervals, %": (95.7, 0.2),
    "position, depths: rows without a position": (0, 0),
    "position, depths: distance, mm rms": (0.4655, 1e-3),
    "position, depths: within 95 % intervals, %": (97.7, 0.2),
    "force, first run to second: readings": (1836, 0),
    "force, first run to second: N rms": (0.3128, 1e-3),
    "force, second run to first: readings": (1845, 0),
    "force, second run to first: N rms": (0.4662, 1e-3),
    "force, last fifth of the shear run: readings": (723, 0),
    "force, last fifth of the shear run: N rms": (0.0867, 1e-3),
}


def taxel(*arguments: object) -> str:
    done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode not in (0, 3):  # 3: frames were lost, as in the capture
        sys.exit(f"taxel {' '.join(map(str, arguments))}\n{done.stderr}")
    return done.stdout


def numbers(path: Path) -> list[list[float]]:
    with open(path, newline="") as file:
        return [[float(cell) for cell in row] for row in csv.reader(file)]


def table(path: Path) -> list[dict[str, float]]:
    def value(cell: str) -> float:
        try:
            return float(cell)
        except ValueError:
            return float("nan")

    with open(path, newline="") as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        return [{key: value(cell) for key, cell in row.items()} for row in rows]


def rms(values: list[float]) -> float:
    return sqrt(sum(value * value for value in values) / len(values))


def maps(work: Path):
    for name, file, part in [
        ("iscan", "iscan_test.csv", 1), ("fscan", "fscan_testL.asf", 1),
        ("xsensor.left", "xsensor_data.csv", 1), ("xsensor.right", "xsensor_data.csv", 2),
    ]:  # fmt: skip
        saved = work / "frames.csv"
        more = ["--part", part] if file.startswith("xsensor") else []
        source = f"replay:{FOLDER / 'pressure-formats' / file}"
        found = json.loads(taxel("live", "--headless", "--speed", "max", "--format", "json", "--source", source,
                                 *more, "--save", saved, "--force"))  # fmt: skip
        frames = [[v for k, v in row.items() if k.startswith("r") and v == v] for row in table(saved)]
        yield f"{name}: frames", found["frames"]
        yield f"{name}: last time, ns", found["last_time_ns"]
        yield f"{name}: largest sum of readings", max(map(sum, frames))
        yield f"{name}: largest reading", max(map(max, frames))
        for kind in ("touch", "split", "merged", "release"):
            yield f"{name}: {kind}", found["events"].get(kind, 0)


def capture(work: Path):
    source = f"replay:{FOLDER / 'boards/optoforce/capture.bin'}"
    found = json.loads(taxel("live", "--raw", "--board", "optoforce-16", "--headless", "--speed", "max",
                             "--format", "json", "--source", source))  # fmt: skip
    yield "optoforce: frames", found["frames"]
    yield "optoforce: lost", found["lost"]
    yield "optoforce: last number", found["last_sequence"]


def sensor(work: Path, channels: int) -> Path:
    """The shipped lattice with as many magnetometers as the recording has."""
    text = (ROOT / "crates/taxel/sensors/eflesh-lattice.toml").read_text()
    groups = [line for line in text.splitlines(True) if "magnetometer" in line and "name = \"magn" in line]
    all_groups = "".join(groups[0].replace("magnetometer 1", f"magnetometer {n + 1}") for n in range(channels // 3))
    path = work / f"lattice-{channels}.toml"
    path.write_text(text.replace("".join(groups), all_groups))
    return path


def trained(work: Path, run: Path, share: float, test: Path | None = None):
    """Estimates of `test` after training on the first share of the rows of a run: rows of the table and of the stage."""
    part = work / "part"
    part.mkdir(exist_ok=True)
    for name in ("sensor.csv", "states.csv"):
        lines = (run / name).read_text().splitlines(True)
        (part / name).write_text("".join(lines[: int(share * len(lines))]))
    described = sensor(work, len(numbers(run / "sensor.csv")[0]) - 1)
    calibration, out = work / "c.toml", work / "touch.csv"
    taxel("calibrate", described, part, "-o", calibration, "--force")
    test = test or run
    taxel("estimate", described, test / "sensor.csv", "--calibration", calibration, "-o", out, "--force")
    return table(out), numbers(test / "states.csv")


def positions(work: Path):
    for name, run in [("fixed depth", "20250317_134149_probe"), ("depths", "20250316_155729_probe_first60")]:
        found, stage = trained(work, FOLDER / "eflesh/spatial_resolution" / run, 0.8)
        start = int(0.8 * len(stage))
        # The middle of the area is that of the presses of training.
        middle = [(min(r[i] for r in stage[:start]) + max(r[i] for r in stage[:start])) / 2 for i in (1, 2)]
        rows = [(f, s) for f, s in list(zip(found, stage))[start:] if f["x [m]"] == f["x [m]"]]
        errors = [[1e3 * f[key] - (s[i + 1] - middle[i]) for i, key in enumerate(("x [m]", "y [m]"))] for f, s in rows]
        inside = [
            abs(e) <= 1.96 * 1e3 * f[key]
            for (f, _), pair in zip(rows, errors)
            for e, key in zip(pair, ("x_deviation [m]", "y_deviation [m]"))
        ]
        yield f"position, {name}: rows without a position", len(stage) - start - len(rows)
        yield f"position, {name}: distance, mm rms", rms([sqrt(a * a + b * b) for a, b in errors])
        yield f"position, {name}: within 95 % intervals, %", 100 * sum(inside) / len(inside)


def forces(work: Path):
    normal, shear = FOLDER / "eflesh/normal_force", FOLDER / "eflesh/shear_force/20250416_200533_probe"
    one, two = normal / "20250401_014340_probe", normal / "20250401_015037_probe"
    for name, run, share, test in [
        ("first run to second", one, 1.0, two), ("second run to first", two, 1.0, one),
        ("last fifth of the shear run", shear, 0.8, shear),
    ]:  # fmt: skip
        found, stage = trained(work, run, share, test)
        times = [row["time [s]"] for row in found]
        errors = []
        for row in stage[int(share * len(stage)) if share < 1 else 0 :]:
            at = bisect_left(times, row[0])
            if row[4] < 0 or not 0 < at < len(times):
                continue
            before, after = found[at - 1]["force_z [N]"], found[at]["force_z [N]"]
            part = (row[0] - times[at - 1]) / (times[at] - times[at - 1])
            errors.append(before + part * (after - before) - GRAM * row[4])
        errors = [error for error in errors if error == error]
        yield f"force, {name}: readings", len(errors)
        yield f"force, {name}: N rms", rms(errors)


def main() -> int:
    if not FOLDER.is_dir():
        print(f"{FOLDER} is not there: the public recordings were not compared")
        return 0
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        for group in (maps, capture, positions, forces):
            for name, found in group(Path(folder)):
                written, tolerance = WRITTEN.get(name, (float("nan"), 0.0))
                same = abs(found - written) <= tolerance
                wrong += not same
                print(f"{'' if same else 'DIFFERS '}{name}: {found:.10g} (written {written:.10g})", flush=True)
    return min(wrong, 1)


if __name__ == "__main__":
    sys.exit(main())
