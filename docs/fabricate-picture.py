"""Draws what `taxel fabricate` wrote, as an SVG: the masks of a GDSII file beside a mould (STL).

    taxel fabricate three-axis-unit -o unit
    taxel fabricate three-axis-8x8 -o array
    python docs/fabricate-picture.py unit/masks.gds array/mould-bumps.stl > masks-three-axis.svg

Needs gdstk, numpy and trimesh (crates/taxel-fabricate/tests/python/requirements.txt).
"""

import sys

import gdstk
import numpy as np
import trimesh

NAMES = ["lower electrodes", "walls", "upper electrodes", "bump base", "bump top"]
COLOURS = ["#d9a400", "#8a7a55", "#b8860b", "#c98a4b", "#7a3e12"]
SIZE = 150  # px of one mask
GAP = 24


def masks(path, elements):
    (cell,) = gdstk.read_gds(path).top_level()
    polygons = [p for p in cell.polygons if p.datatype == 0]
    layers = sorted({p.layer for p in polygons})
    points = np.vstack([p.points for p in polygons])
    low, high = points.min(0), points.max(0)
    scale = SIZE / (high - low).max()
    for number, layer in enumerate(layers):
        column, row = number % 3, number // 3
        corner = np.array([GAP + column * (SIZE + GAP), 40 + row * (SIZE + 46)])
        name = NAMES[layer - 1] if len(layers) == len(NAMES) else f"layer {layer}"
        elements.append(f'<text x="{corner[0]}" y="{corner[1] - 8}">{layer}: {name}</text>')
        elements.append(
            f'<rect x="{corner[0]}" y="{corner[1]}" width="{SIZE}" height="{SIZE}" fill="#fbfaf6" stroke="#999"/>'
        )
        for polygon in (p for p in polygons if p.layer == layer):
            flat = (polygon.points - low) * scale
            flat[:, 1] = SIZE - flat[:, 1]
            path = " ".join(f"{x:.2f},{y:.2f}" for x, y in flat + corner)
            elements.append(f'<polygon points="{path}" fill="{COLOURS[(layer - 1) % 5]}"/>')


def mould(path, elements):
    mesh = trimesh.load_mesh(path)
    turn = np.array([[1, 0, 0], [0, np.cos(0.95), np.sin(0.95)], [0, -np.sin(0.95), np.cos(0.95)]]) @ np.array(
        [[np.cos(0.6), -np.sin(0.6), 0], [np.sin(0.6), np.cos(0.6), 0], [0, 0, 1]]
    )
    points = (mesh.vertices - mesh.bounds.mean(0)) @ (turn.T)
    normals = mesh.face_normals @ turn.T
    scale = 280 / np.ptp(points[:, :2], axis=0).max()
    centre = np.array([GAP + 3 * (SIZE + GAP) + 150, 220])
    elements.append(f'<text x="{centre[0] - 130}" y="32">mould of the bumps</text>')
    light = np.array([0.35, 0.45, 0.82])
    order = np.argsort(points[mesh.faces][:, :, 2].mean(1))
    for face in order:
        if normals[face][2] <= 0:
            continue
        shade = 0.35 + 0.6 * max(0.0, float(normals[face] @ light))
        grey = [int(255 * min(1.0, shade * c)) for c in (0.86, 0.88, 0.93)]
        corners = points[mesh.faces[face]][:, :2] * scale * [1, -1] + centre
        path = " ".join(f"{x:.2f},{y:.2f}" for x, y in corners)
        colour = "#{:02x}{:02x}{:02x}".format(*grey)
        elements.append(f'<polygon points="{path}" fill="{colour}" stroke="{colour}" stroke-width=".7"/>')


def main():
    elements = []
    masks(sys.argv[1], elements)
    mould(sys.argv[2], elements)
    width, height = GAP + 3 * (SIZE + GAP) + 310, 40 + 2 * (SIZE + 46)
    print(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        'font-family="sans-serif" font-size="13"><rect width="100%" height="100%" fill="#fff"/>'
    )
    print("\n".join(elements))
    print("</svg>")


if __name__ == "__main__":
    main()
