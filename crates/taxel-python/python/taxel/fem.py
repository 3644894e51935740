"""Finite elements: a layer with a row of voids under pressure.

Lengths and pressures are in any consistent units: in micrometres and kilopascals as well as in
metres and pascals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _taxel
from ._answers import _needed, same

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["Closure", "Mesh", "MooneyRivlin", "VoidCell", "VoidStudy"]


@dataclass(frozen=True)
class MooneyRivlin:
    """The incompressible solid ``W = c10 (I1 - 3) + c01 (I2 - 3)``; ``c01 = 0`` is neo-Hookean."""

    #: Factors of the invariants, a pressure.
    c10: float
    c01: float = 0.0


@dataclass(frozen=True)
class VoidCell:
    """One void of a row in a layer: lengths in one unit."""

    #: Width and height of the void.
    width: float
    height: float
    #: Thickness of the solid above and below it.
    cover: float
    base: float
    #: Distance from one void to the next.
    pitch: float
    #: Radius of the corners of the void; zero for sharp ones.
    fillet: float = 0.0


@dataclass(frozen=True)
class Closure:
    """A void at one load."""

    #: Pressure on the top and in the void.
    pressure: float
    inside: float
    #: Area over its value at rest.
    area_ratio: float
    #: Smallest distance between roof and floor.
    gap: float
    #: Length of each wall that has folded onto the other at the upper corner.
    fold: float
    #: Greatest von Mises stress.
    stress: float


@dataclass(frozen=True, eq=False)
class Mesh:
    """A mesh with the names and the order of nodes of meshio."""

    #: ``(n, 3)``.
    points: NDArray[np.float64]
    #: Shape and nodes ``(cells, nodes)`` of the cells of each shape, such as ``("quad9", ...)``.
    cells: list[tuple[str, NDArray[np.int64]]]
    #: Index into :attr:`names` of each cell, shape by shape: ``(cells,)``.
    regions: list[NDArray[np.int64]]
    #: Names of the regions.
    names: list[str]

    def plot(self, displacement: NDArray[np.float64] | None = None, ax: Axes | None = None) -> Axes:
        """Draws the edges of the cells, deformed by ``displacement`` ``(n, 3)``.

        Needs matplotlib: ``pip install matplotlib``. Returns the axes.
        """
        if ax is None:
            _, ax = _needed("matplotlib.pyplot").subplots()
        points = self.points if displacement is None else self.points + displacement
        for shape, cells in self.cells:
            # Corner, middle of the side, corner.
            order = [0, 4, 1, 5, 2, 6, 3, 7, 0] if shape == "quad9" else [0, 3, 1, 4, 2, 5, 0]
            outlines = points[cells[:, order], :2]
            ax.add_collection(_needed("matplotlib.collections").LineCollection(list(outlines), linewidths=0.5))
        ax.autoscale()
        ax.set_aspect("equal")
        return ax

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Mesh):
            return NotImplemented
        return (
            same(self.points, other.points)
            and self.names == other.names
            and [name for name, _ in self.cells] == [name for name, _ in other.cells]
            and all(same(one, two) for (_, one), (_, two) in zip(self.cells, other.cells))
        )

    def __repr__(self) -> str:
        shown = ", ".join(f"{len(cells)} {shape}" for shape, cells in self.cells)
        return f"<Mesh: {len(self.points)} points, {shown}>"

    def _repr_svg_(self) -> str:
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        width, height = float(high[0] - low[0]), float(high[1] - low[1])
        lines = []
        for shape, cells in self.cells:
            order = [0, 4, 1, 5, 2, 6, 3, 7, 0] if shape == "quad9" else [0, 3, 1, 4, 2, 5, 0]
            for outline in self.points[cells[:, order], :2]:
                corners = " ".join(f"{x - low[0]:g},{high[1] - y:g}" for x, y in outline)
                lines.append(f'<polyline points="{corners}"/>')
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="480" viewBox="0 0 {width:g} {height:g}">'
            f'<g fill="none" stroke="#345" stroke-width="{width / 500:g}">{"".join(lines)}</g></svg>'
        )


class VoidStudy:
    """Half a cell with its void, bonded below and pressed all over the top.

    Args:
        cell: The lengths.
        material: The solid, its constants in the unit of the pressures.
        gas: Pressure scale of a gas that is trapped in the void, ``p = gas (A0/A - 1)``; without
            it the void is vented.
        sealed: True if the void keeps its volume.

    Raises:
        SolveError: lengths that make no cell.
        ValueError: constants of no solid.

    >>> from taxel import fem
    >>> cell = fem.VoidCell(width=400, height=20, cover=140, base=340, pitch=600)    # um
    >>> study = fem.VoidStudy(cell, fem.MooneyRivlin(c10=75.5, c01=5.7))             # kPa
    >>> study.press(6.0).area_ratio < 1
    True
    """

    def __init__(self, cell: VoidCell, material: MooneyRivlin, *, gas: float | None = None, sealed: bool = False) -> None:
        #: What was given.
        self.cell, self.material, self.gas, self.sealed = cell, material, gas, sealed
        self._path: list[tuple[str, float]] = []
        lengths = (cell.width, cell.height, cell.cover, cell.base, cell.pitch, cell.fillet)
        self._core = _taxel.VoidStudy(lengths, (material.c10, material.c01), gas, sealed)

    def press(self, pressure: float) -> Closure:
        """Brings the pressure on the top to ``pressure``, from where it stands.

        Raises:
            SolveError: there is no equilibrium on the way; the last one stays.
        """
        return self._moved("press", pressure)

    def close(self, area_ratio: float) -> Closure:
        """Finds the pressure that brings the area of the void to a share of that at rest.

        Raises:
            SolveError: there is no equilibrium on the way; the last one stays.
        """
        return self._moved("close", area_ratio)

    def _moved(self, how: str, target: float) -> Closure:
        found = Closure(**getattr(self._core, how)(target))
        self._path.append((how, target))
        return found

    @property
    def mesh(self) -> Mesh:
        """The mesh, undeformed."""
        found = self._core.mesh()
        cells = [(shape, nodes) for shape, nodes, _ in found["cells"]]
        return Mesh(found["points"], cells, [regions for _, _, regions in found["cells"]], found["regions"])

    @property
    def displacement(self) -> NDArray[np.float64]:
        """Displacement of each point: ``(n, 3)``."""
        return self._core.displacement()

    def __reduce__(self) -> tuple[Any, ...]:
        return _void_study_of, (self.cell, self.material, self.gas, self.sealed, tuple(self._path))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, VoidStudy):
            return NotImplemented
        return self.__reduce__() == other.__reduce__()

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<VoidStudy of {asdict(self.cell)}>"

    def _repr_svg_(self) -> str:
        mesh = self.mesh
        return Mesh(mesh.points + self.displacement, mesh.cells, mesh.regions, mesh.names)._repr_svg_()


def _void_study_of(
    cell: VoidCell, material: MooneyRivlin, gas: float | None, sealed: bool, path: Sequence[tuple[str, float]]
) -> VoidStudy:
    study = VoidStudy(cell, material, gas=gas, sealed=sealed)
    for how, target in path:
        # The same steps lead to the same state.
        study._moved(how, target)
    return study
