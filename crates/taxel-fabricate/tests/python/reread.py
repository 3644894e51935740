"""Reads the files of `taxel fabricate` again with the programs of others: ezdxf, gdstk, trimesh.

    python -m venv venv && venv/bin/pip install -r requirements.txt
    taxel fabricate SENSOR -o FOLDER --format json > FOLDER.json
    venv/bin/python reread.py FOLDER FOLDER.json

FOLDER.json is what the command prints with `--format json`: areas of the masks and volumes of the
moulds, computed before anything was rounded to the grid. Ends with 1 and a sentence if a file is
not sound or differs from them.
"""

import json
import sys
from pathlib import Path

import ezdxf
import ezdxf.math
import gdstk
import trimesh

AREA = 1e-9  # relative: the grid of 1 nm holds the lengths of the shipped sensors
VOLUME = 1e-6  # relative: STL has numbers of 24 bits


def close(what, found, expected, tolerance):
    # Of an inverted mask of the whole field nothing is left.
    error = abs(found - expected) / (abs(expected) or 1)
    print(f"{what:55} {found:.9g}  off by {error:.1e}")
    if not error <= tolerance:
        sys.exit(f"{what}: {found!r} instead of {expected!r}")


def polygon_area(corners):
    pairs = zip(corners, corners[1:] + corners[:1])
    return sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in pairs) / 2


def dxf(path, masks, missing):
    drawing = ezdxf.readfile(path)
    audit = drawing.audit()
    if audit.errors or audit.fixes:
        sys.exit(f"{path}: {audit.errors} {audit.fixes}")
    if drawing.dxfversion != "AC1009":
        sys.exit(f"{path}: not release 12 but {drawing.dxfversion}")
    space = drawing.modelspace()
    for name, area in masks.items():
        lines = space.query(f'POLYLINE[layer=="{name.upper()}"]')
        if not all(line.is_closed for line in lines):
            sys.exit(f"{path}: an outline of {name} is open")
        found = sum(polygon_area([tuple(v.dxf.location)[:2] for v in line.vertices]) for line in lines)
        close(f"{path.name} {name} [mm2]", found, area * 1e6, AREA)
    notes = [text.dxf.text for text in space.query('TEXT[layer=="NOTES"]')]
    named(path, notes, missing)


def gds(path, masks, missing):
    library = gdstk.read_gds(path)
    (cell,) = library.top_level()
    for layer, (name, area) in enumerate(masks.items(), start=1):
        polygons = [p for p in cell.polygons if (p.layer, p.datatype) == (layer, 0)]
        unit = library.unit
        close(f"{path.name} {name} [mm2]", sum(p.area() for p in polygons) * unit**2 * 1e6, area * 1e6, AREA)
    named(path, [label.text for label in cell.labels if label.layer == 63], missing)


def named(path, notes, missing):
    for what in missing:
        if not any(what[:40] in note for note in notes):
            sys.exit(f"{path}: its notes do not name: {what}")


def stl(path, volume):
    mesh = trimesh.load_mesh(path)
    if not (mesh.is_watertight and mesh.is_winding_consistent):
        sys.exit(f"{path}: not watertight")
    close(f"{path.name} [mm3]", mesh.volume, volume * 1e9, VOLUME)


def main():
    folder = Path(sys.argv[1])
    said = json.loads(Path(sys.argv[2]).read_text())
    masks = {row["what"]: row["area_m2"] for row in said["rows"] if "masks.dxf" in row["file"]}
    missing = said["not_in_the_sensor_file"]
    dxf(folder / "masks.dxf", masks, missing)
    gds(folder / "masks.gds", masks, missing)
    for row in said["rows"]:
        if row["file"].endswith(".stl"):
            stl(folder / row["file"], row["volume_m3"])
    print(f"{folder}: sound")


if __name__ == "__main__":
    main()
