"""Finite elements: soft bodies at large strain, fields between conductors, voids under pressure.

Lengths and pressures are in any consistent units: in micrometres and kilopascals as well as in
metres and pascals. Capacitances and resistances need metres.

>>> import numpy as np
>>> from taxel import fem
>>> points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
>>> mesh = fem.Mesh(points, [("quad", [[0, 1, 2, 3]])], surfaces={"bottom": points[:, 1] == 0, "top": points[:, 1] == 1})
>>> body = fem.Problem(mesh, fem.MooneyRivlin(c10=75.5, c01=5.7))                # kPa
>>> body.clamp("bottom").drive("top", "y", "travel").support("top", "x").solve(travel=-0.1)
>>> body.displacement[2].tolist()
[0.0, -0.1, 0.0]
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _taxel
from ._answers import _needed, same

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = [
    "Capacitance",
    "Closure",
    "Gent",
    "Laplace",
    "LinearElastic",
    "Mesh",
    "MooneyRivlin",
    "Problem",
    "Resistance",
    "Solid",
    "VoidCell",
    "VoidStudy",
    "Yeoh",
]

_Solid = tuple[str, list[float], float | None]


@dataclass(frozen=True)
class MooneyRivlin:
    """The solid ``W = c10 (I1 - 3) + c01 (I2 - 3)``; ``c01 = 0`` is neo-Hookean."""

    #: Factors of the invariants, a pressure.
    c10: float
    c01: float = 0.0
    #: Bulk modulus, a pressure; None for a solid that keeps its volume.
    bulk: float | None = None

    def _solid(self) -> _Solid:
        return "mooney_rivlin", [self.c10, self.c01], self.bulk


@dataclass(frozen=True)
class Yeoh:
    """The solid ``W = c10 x + c20 x^2 + c30 x^3`` with ``x = I1 - 3`` (Yeoh 1993)."""

    #: Factors, a pressure.
    c10: float
    c20: float
    c30: float
    #: Bulk modulus, a pressure; None for a solid that keeps its volume.
    bulk: float | None = None

    def _solid(self) -> _Solid:
        return "yeoh", [self.c10, self.c20, self.c30], self.bulk


@dataclass(frozen=True)
class Gent:
    """The solid ``W = -shear limit / 2 ln(1 - (I1 - 3) / limit)`` (Gent 1996), which ends at ``I1 - 3 = limit``."""

    #: Shear modulus, a pressure.
    shear: float
    #: Limit of ``I1 - 3``.
    limit: float
    #: Bulk modulus, a pressure; None for a solid that keeps its volume.
    bulk: float | None = None

    def _solid(self) -> _Solid:
        return "gent", [self.shear, self.limit], self.bulk


@dataclass(frozen=True)
class LinearElastic:
    """A stiff part: linear elasticity at small strain and at any rotation (Saint Venant and Kirchhoff)."""

    #: Young's modulus, a pressure.
    youngs_modulus: float
    #: Poisson's ratio; one half keeps the volume.
    poissons_ratio: float

    def _solid(self) -> _Solid:
        shear = self.youngs_modulus / (2 * (1 + self.poissons_ratio))
        room = 1 - 2 * self.poissons_ratio
        return "linear_elastic", [shear], None if room == 0 else self.youngs_modulus / (3 * room)


#: A solid of a body.
Solid = MooneyRivlin | Yeoh | Gent | LinearElastic


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
    """A mesh with the names and the order of nodes of meshio.

    Args:
        points: ``(n, 3)``, or ``(n, 2)`` in a plane.
        cells: Shape and nodes of the cells of each shape: ``triangle``, ``quad``, ``tetra`` or
            ``hexahedron``, also with the middles of their edges (``quad8``, ...) or with all nodes.
        regions: Index into ``names`` of each cell, shape by shape; default 0.
        names: Names of the regions; default ``["solid"]``.
        surfaces: Name to the points of a part of the boundary, or to any points: numbers, or a
            mask of all points.

    The elements have more nodes than corners: :attr:`complete` has those that were missing, after
    the given ones.

    Raises:
        ValueError: shapes, numbers or names that do not belong together.
    """

    #: ``(n, 3)``.
    points: NDArray[np.float64]
    #: Shape and nodes ``(cells, nodes)`` of the cells of each shape, such as ``("quad9", ...)``.
    cells: list[tuple[str, NDArray[np.int64]]]
    #: Index into :attr:`names` of each cell, shape by shape: ``(cells,)``.
    regions: list[NDArray[np.int64]] = field(default_factory=list)
    #: Names of the regions.
    names: list[str] = field(default_factory=lambda: ["solid"])
    #: Numbers of the points of each named surface.
    surfaces: dict[str, NDArray[np.int64]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        points = np.atleast_2d(np.asarray(self.points, dtype=float))
        if points.ndim != 2 or points.shape[1] not in (2, 3):
            raise ValueError(f"points have the shape (n, 2) or (n, 3), not {points.shape}")
        if points.shape[1] == 2:
            points = np.column_stack([points, np.zeros(len(points))])
        cells = [(name, _whole(nodes, "cells", 2)) for name, nodes in self.cells]
        regions = [_whole(one, "regions", 1) for one in self.regions]
        if not regions:
            regions = [np.zeros(len(nodes), np.int64) for _, nodes in cells]
        if len(regions) != len(cells):
            raise ValueError(f"regions: {len(regions)} lists for {len(cells)} shapes of cells")
        surfaces = {}
        for name, given in self.surfaces.items():
            chosen = np.asarray(given)
            if chosen.dtype == np.bool_:
                if chosen.shape != (len(points),):
                    raise ValueError(f"surfaces.{name}: a mask has the shape ({len(points)},), not {chosen.shape}")
                chosen = np.flatnonzero(chosen)
            surfaces[name] = _whole(chosen, f"surfaces.{name}", 1)
        for name, value in (("points", points), ("cells", cells), ("regions", regions), ("surfaces", surfaces)):
            object.__setattr__(self, name, value)

    @property
    def complete(self) -> Mesh:
        """The mesh with all nodes of its elements, the given points first."""
        found = self._core().complete()
        cells = [(shape, nodes) for shape, nodes, _ in found["cells"]]
        regions = [regions for _, _, regions in found["cells"]]
        return Mesh(found["points"], cells, regions, found["regions"], self.surfaces)

    def _core(self) -> _taxel.Mesh:
        blocks = [(name, nodes, regions) for (name, nodes), regions in zip(self.cells, self.regions)]
        surfaces = {name: nodes.tolist() for name, nodes in self.surfaces.items()}
        return _taxel.Mesh(self.points, blocks, list(self.names), surfaces)

    def plot(self, displacement: NDArray[np.float64] | None = None, ax: Axes | None = None) -> Axes:
        """Draws the edges of the cells, deformed by ``displacement`` ``(n, 3)``.

        Needs matplotlib: ``pip install matplotlib``. Returns the axes.
        """
        if ax is None:
            _, ax = _needed("matplotlib.pyplot").subplots()
        points = self.points if displacement is None else self.points + displacement
        for shape, cells in self.cells:
            outlines = points[cells[:, _outline(shape, cells)], :2]
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
            and all(same(one, two) for one, two in zip(self.regions, other.regions))
            and self.surfaces.keys() == other.surfaces.keys()
            and all(same(one, other.surfaces[name]) for name, one in self.surfaces.items())
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        shown = ", ".join(f"{len(cells)} {shape}" for shape, cells in self.cells)
        return f"<Mesh: {len(self.points)} points, {shown}>"

    def _repr_svg_(self) -> str:
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        width, height = float(high[0] - low[0]), float(high[1] - low[1])
        lines = []
        for shape, cells in self.cells:
            for outline in self.points[cells[:, _outline(shape, cells)], :2]:
                corners = " ".join(f"{x - low[0]:g},{high[1] - y:g}" for x, y in outline)
                lines.append(f'<polyline points="{corners}"/>')
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="480" viewBox="0 0 {width:g} {height:g}">'
            f'<g fill="none" stroke="#345" stroke-width="{width / 500:g}">{"".join(lines)}</g></svg>'
        )


def _whole(values: ArrayLike, what: str, dimensions: int) -> NDArray[np.int64]:
    """An array of whole numbers."""
    found = np.asarray(values)
    if found.size and found.dtype.kind not in "iu":
        raise ValueError(f"{what}: whole numbers are needed, not {found.dtype}")
    if found.ndim != dimensions:
        raise ValueError(f"{what}: an array of {dimensions} dimensions is needed, not of the shape {found.shape}")
    return np.ascontiguousarray(found, dtype=np.int64)


def _outline(shape: str, cells: NDArray[np.int64]) -> list[int]:
    """Order of the nodes round a cell of the plane; of a solid one round its first side."""
    corners = 3 if shape.startswith(("triangle", "tetra")) else 4
    if shape.startswith(("triangle", "quad")) and cells.shape[1] >= 2 * corners:
        # Corner, middle of the side, corner.
        return [node for corner in range(corners) for node in (corner, corners + corner)] + [0]
    return [*range(corners), 0]


class Problem:
    """A soft body of any mesh at large strain, with its supports and loads.

    Args:
        mesh: The undeformed body.
        materials: A solid, or name of each region to its solid: :class:`MooneyRivlin`,
            :class:`Yeoh`, :class:`Gent`, :class:`LinearElastic`.
        kinematics: ``"plane_strain"`` (default in a plane), ``"axisymmetric"`` (x is the radius) or
            ``"solid"`` (default in space).

    Supports and loads are added first; :meth:`solve` then brings the parameters to their values,
    from where they stand, in adaptive steps.
    """

    def __init__(
        self,
        mesh: Mesh,
        materials: Solid | Mapping[str, Solid],
        *,
        kinematics: str | None = None,
    ) -> None:
        if not isinstance(materials, Mapping):
            materials = dict.fromkeys(mesh.names, materials)
        if set(materials) != set(mesh.names):
            raise ValueError(f"materials are of {', '.join(materials)}; the regions are {', '.join(mesh.names)}")
        solid = any(shape.startswith(("tetra", "hexahedron")) for shape, _ in mesh.cells)
        #: What was given.
        self.mesh, self.materials = mesh, dict(materials)
        self.kinematics = kinematics or ("solid" if solid else "plane_strain")
        self._supports: list[tuple[str, int, str | None]] = []
        self._pressures: list[tuple[str, str]] = []
        self._path: list[dict[str, float]] = []
        self._mesh = mesh._core()
        self._core: _taxel.Problem | None = None

    def clamp(self, surface: str) -> Problem:
        """Holds all components of a surface."""
        for component in range(3 if self.kinematics == "solid" else 2):
            self._add(self._supports, (surface, component, None))
        return self

    def support(self, surface: str, component: str) -> Problem:
        """Holds the component ``"x"``, ``"y"`` or ``"z"`` of a surface."""
        return self._add(self._supports, (surface, _component(component), None))

    def drive(self, surface: str, component: str, parameter: str) -> Problem:
        """Moves a component of a surface by a parameter, in the unit of the mesh."""
        return self._add(self._supports, (surface, _component(component), parameter))

    def pressure(self, surface: str, parameter: str) -> Problem:
        """Presses on a surface; the pressure stays normal to it."""
        return self._add(self._pressures, (surface, parameter))

    def _add(self, to: list[Any], what: tuple[Any, ...]) -> Problem:
        if self._core is not None:
            raise ValueError("supports and loads are added before the first solution")
        to.append(what)
        return self

    def solve(self, **targets: float) -> None:
        """Brings the parameters to these values; those that are not named stay.

        Raises:
            ValueError: a parameter that nothing is moved by; supports that leave the body free.
            SolveError: there is no equilibrium on the way; the last one stays.
        """
        core = self._posed()
        names = core.parameters()
        unknown = [name for name in targets if name not in names]
        if unknown:
            raise ValueError(f"no parameter is called {unknown[0]}; the parameters are {', '.join(names)}")
        values = {**self.parameters, **{name: float(value) for name, value in targets.items()}}
        if not all(np.isfinite(value) for value in values.values()):
            raise ValueError(f"parameters are finite numbers, not {values}")
        core.solve([values[name] for name in names])
        self._path.append(values)

    def _posed(self) -> _taxel.Problem:
        if self._core is None:
            solids = [self.materials[name]._solid() for name in self.mesh.names]
            self._core = _taxel.Problem(self._mesh, self.kinematics, solids, self._supports, self._pressures)
        return self._core

    @property
    def parameters(self) -> dict[str, float]:
        """Value of each parameter."""
        if self._path:
            return dict(self._path[-1])
        return dict.fromkeys(self._posed().parameters(), 0.0)

    @property
    def displacement(self) -> NDArray[np.float64]:
        """Displacement of each point of ``mesh.complete``: ``(n, 3)``."""
        return self._posed().displacement()

    @property
    def stress(self) -> NDArray[np.float64]:
        """Cauchy stress 11, 22, 33, 12, 23, 13 at each point of ``mesh.complete``: ``(n, 6)``."""
        return self._posed().stress()[0]

    @property
    def von_mises(self) -> NDArray[np.float64]:
        """Von Mises stress at each point of ``mesh.complete``: ``(n,)``."""
        return self._posed().stress()[1]

    def reaction(self, surface: str) -> NDArray[np.float64]:
        """Force that holds or moves a surface, summed over it: ``(3,)``, in a plane per depth."""
        return np.array(self._posed().reaction(surface))

    def __reduce__(self) -> tuple[Any, ...]:
        return _problem_of, (
            self.mesh, self.materials, self.kinematics, list(self._supports), list(self._pressures), list(self._path),
        )  # fmt: skip

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Problem):
            return NotImplemented
        return bool(self.__reduce__()[1] == other.__reduce__()[1])

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<Problem: {self.kinematics}, {self.mesh!r}>"

    def _repr_svg_(self) -> str:
        mesh = self.mesh.complete
        return Mesh(mesh.points + self.displacement, mesh.cells, mesh.regions, mesh.names)._repr_svg_()


def _component(name: str) -> int:
    if name not in ("x", "y", "z"):
        raise ValueError(f"component {name!r} is not one of x, y, z")
    return "xyz".index(name)


def _problem_of(
    mesh: Mesh,
    materials: dict[str, Solid],
    kinematics: str,
    supports: list[tuple[str, int, str | None]],
    pressures: list[tuple[str, str]],
    path: list[dict[str, float]],
) -> Problem:
    problem = Problem(mesh, materials, kinematics=kinematics)
    problem._supports, problem._pressures = list(supports), list(pressures)
    for values in path:
        # The same steps lead to the same state.
        problem.solve(**values)
    return problem


@dataclass(frozen=True, eq=False)
class Capacitance:
    """Capacitances of ``k`` conductors: F, in a plane F/m."""

    #: Maxwell's matrix from the energies: charge of ``i`` with ``j`` at 1 V and the others at zero:
    #: ``(k, k)``.
    matrix: NDArray[np.float64]
    #: The same from the fluxes: the difference shows the error of the mesh.
    by_flux: NDArray[np.float64]
    #: Potential of each point of ``mesh.complete`` with each conductor at 1 V: ``(k, n)``.
    potentials: NDArray[np.float64]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Capacitance):
            return NotImplemented
        return all(same(getattr(self, name), getattr(other, name)) for name in ("matrix", "by_flux", "potentials"))

    __hash__ = None  # type: ignore[assignment]


@dataclass(frozen=True, eq=False)
class Resistance:
    """A resistance: ohm, in a plane ohm m."""

    #: From the power, and from the current.
    value: float
    by_flux: float
    #: Potential of each point of ``mesh.complete`` at 1 V: ``(n,)``.
    potential: NDArray[np.float64]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Resistance):
            return NotImplemented
        return self.value == other.value and self.by_flux == other.by_flux and same(self.potential, other.potential)

    __hash__ = None  # type: ignore[assignment]


class Laplace:
    """The field ``div(k grad phi) = 0`` of a mesh, also in the shape that a body has taken.

    Args:
        mesh: Lengths in m.
        coefficients: Name of each region of the field to its ``k``: permittivity relative to vacuum
            for :meth:`capacitance`, conductivity in S/m for :meth:`resistance`.
        geometry: ``"plane"`` (default in a plane), ``"axisymmetric"`` or ``"solid"`` (default in space).
        displacement: Of each point of ``mesh.complete``, m: ``(n, 3)``, as :attr:`Problem.displacement`.

    What is not named is a mirror: no flux passes.

    >>> import numpy as np
    >>> from taxel import fem
    >>> points = np.array([[0.0, 0.0], [3e-3, 0.0], [3e-3, 1e-3], [0.0, 1e-3]])
    >>> ends = {"low": points[:, 1] == 0, "high": points[:, 1] > 0}
    >>> field = fem.Laplace(fem.Mesh(points, [("quad", [[0, 1, 2, 3]])], surfaces=ends), {"solid": 2.0})
    >>> f"{field.capacitance(['high'], zero=['low']).matrix[0, 0] * 1e12:.3f} pF/m"      # 2 eps0 3 mm/1 mm
    '53.125 pF/m'
    """

    def __init__(
        self,
        mesh: Mesh,
        coefficients: Mapping[str, float],
        *,
        geometry: str | None = None,
        displacement: NDArray[np.float64] | None = None,
    ) -> None:
        solid = any(shape.startswith(("tetra", "hexahedron")) for shape, _ in mesh.cells)
        #: What was given.
        self.mesh, self.coefficients = mesh, {name: float(value) for name, value in coefficients.items()}
        self.geometry = geometry or ("solid" if solid else "plane")
        self.displacement = None if displacement is None else np.ascontiguousarray(displacement, dtype=float)
        self._core = mesh._core()

    def capacitance(
        self, conductors: Sequence[str], *, zero: Sequence[str] = (), floating: Sequence[str] = ()
    ) -> Capacitance:
        """Capacitances between conductors: regions, which are left out of the field, or surfaces.

        Args:
            conductors: Their names, in the order of the rows.
            zero: Names of what is at zero: ground, planes of odd symmetry.
            floating: Names of conductors without charge.

        Raises:
            SolveError: unknown names, conductors that touch, regions without a coefficient, cells
                turned inside out.
        """
        found = _taxel.capacitance(
            self._core, self.geometry, list(self.coefficients.items()), list(conductors), list(zero), list(floating), self.displacement
        )
        return Capacitance(**found)

    def resistance(self, one: str, other: str) -> Resistance:
        """Resistance between two surfaces; all other boundaries insulate.

        Raises:
            SolveError: as :meth:`capacitance`.
        """
        return Resistance(
            *_taxel.resistance(self._core, self.geometry, list(self.coefficients.items()), (one, other), self.displacement)
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return _laplace_of, (self.mesh, self.coefficients, self.geometry, self.displacement)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Laplace):
            return NotImplemented
        mine, theirs = self.displacement, other.displacement
        moved = mine is theirs if mine is None or theirs is None else same(mine, theirs)
        return self.__reduce__()[1][:3] == other.__reduce__()[1][:3] and moved

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<Laplace: {self.geometry}, {self.mesh!r}>"


def _laplace_of(
    mesh: Mesh, coefficients: dict[str, float], geometry: str, displacement: NDArray[np.float64] | None
) -> Laplace:
    return Laplace(mesh, coefficients, geometry=geometry, displacement=displacement)


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
        self._core = _taxel.VoidStudy(lengths, material._solid(), gas, sealed)

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
