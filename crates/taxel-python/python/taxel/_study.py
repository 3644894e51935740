"""Design studies: what becomes of a sensor when its file is varied."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future, wait
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _taxel
from ._answers import Answers
from ._sensor import Sensor, toml_value

Path = str | os.PathLike[str]
#: Designs that one call of a worker computes: between these.
_LEAST, _MOST = 1, 64


@dataclass(frozen=True)
class Design:
    """An evaluated design."""

    #: The study that it belongs to.
    study: Study
    #: Value of each variable, SI; the index of a word: ``(variables,)``.
    point: tuple[float, ...]
    #: ``"done"``, ``"refused"``, ``"ended"`` or ``"outside"``.
    status: str
    #: Why it is not done.
    reason: str
    #: Answers: name to number in SI or word; those that are missing are NaN.
    answers: Mapping[str, float | str]
    _row: Any

    @property
    def sensor(self) -> Sensor:
        """The design as a sensor."""
        return self.study.sensor_at(self.point)

    @property
    def values(self) -> dict[str, float]:
        """Value of each variable, SI; the index of a word."""
        return dict(zip(self.study.variables, self.point))

    def __hash__(self) -> int:
        return hash((self.study, self.point))


class Result:
    """Designs of a study: the rows of a sweep, or the front of an optimisation."""

    def __init__(
        self,
        study: Study,
        table: Answers,
        *,
        computed: int = 0,
        evaluations: int = 0,
        dominated: Answers | None = None,
        points: Sequence[Sequence[float]] = (),
        active: Sequence[str] = (),
    ) -> None:
        #: The study.
        self.study = study
        #: One row for each design: variables, answers, status, reason.
        self.table = table
        #: Designs that were computed, not found in the store.
        self.computed = computed
        #: Designs that the optimiser asked for.
        self.evaluations = evaluations
        #: Constraints and bounds that hold the best design, in words.
        self.active = tuple(active)
        self._dominated, self._points = dominated, [tuple(point) for point in points]

    def pareto(self) -> Answers:
        """Designs that no other one dominates, one row each; of one objective the best design.

        Raises:
            ValueError: the result of a sweep.
        """
        self._optimised()
        return self.table

    @property
    def dominated(self) -> Answers:
        """The other designs of an optimisation."""
        self._optimised()
        assert self._dominated is not None
        return self._dominated

    @property
    def best(self) -> Design:
        """The best design by the first objective.

        Raises:
            ValueError: the result of a sweep, or no design fulfils all constraints.
        """
        self._optimised()
        if not self._points:
            raise ValueError("no design fulfils all constraints: loosen one, or widen the ranges")
        return self.study.ask(self._points[0])

    def _optimised(self) -> None:
        if self._dominated is None:
            raise ValueError("a sweep compares nothing: use table, or Study.optimize")

    def to_pandas(self) -> Any:
        """:attr:`table` as a ``pandas.DataFrame``."""
        return self.table.to_pandas()

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Result):
            return NotImplemented
        return (
            self.study == other.study and self.table == other.table and self._dominated == other._dominated
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<Result of {self.study.name}: {self.table.rows} designs, {self.computed} computed>"

    def _repr_html_(self) -> str:
        return self.table._repr_html_()


class Study:
    """A design study.

    Args:
        source: A study file or the name of a shipped one (``taxel.shipped("study")``); or a
            :class:`Sensor`, whose study the other arguments describe.
        text: The text of a study file; ``source`` is then its name.
        variables, answers, constraints, objectives, links, set, sweep, optimize, tolerance: Tables
            of the study file, as mappings of the keys that the guide describes.

    Raises:
        InputError: the first mistake, under its word.

    >>> import taxel
    >>> study = taxel.Study(
    ...     taxel.Sensor("in-plane-50um"),
    ...     variables={"thickness": {"key": "element.in_plane_capacitor.layer.thickness",
    ...                              "range": ["500 um", "870 um"], "points": 3}},
    ...     answers={"rest": {"of": "check", "quantity": "rest_capacitance"}},
    ... )
    >>> study.run().table["rest"].shape
    (3,)
    """

    def __init__(
        self,
        source: Path | Sensor,
        *,
        text: str | None = None,
        variables: Mapping[str, Any] | None = None,
        answers: Mapping[str, Any] | None = None,
        constraints: Mapping[str, Any] | None = None,
        objectives: Mapping[str, Any] | None = None,
        links: Mapping[str, Any] | None = None,
        set: Mapping[str, Any] | None = None,
        sweep: Mapping[str, Any] | None = None,
        optimize: Mapping[str, Any] | None = None,
        tolerance: Mapping[str, Any] | None = None,
        name: str = "study",
    ) -> None:
        sensor = None
        if isinstance(source, Sensor):
            tables = {
                "set": set, "variables": variables, "links": links, "answers": answers, "constraints": constraints,
                "objectives": objectives, "sweep": sweep, "optimize": optimize, "tolerance": tolerance,
            }  # fmt: skip
            file, text = name, _written(name, source.file, tables)
            sensor = (source.file, source.text)
        elif text is not None:
            file = os.fspath(source)
        else:
            file, text = _taxel.study_text(os.fspath(source))
        self._core = _taxel.Study(file, text, sensor)

    @property
    def name(self) -> str:
        """Name of the study."""
        return self._core.name

    @property
    def text(self) -> str:
        """Text of the study file."""
        return self._core.text

    @property
    def sensor(self) -> Sensor:
        """The sensor that is varied."""
        name, text = self._core.sensor
        return Sensor(name, text=text)

    @property
    def variables(self) -> dict[str, str]:
        """Name to key of each variable, in the order of a point."""
        return dict(self._core.variables())

    @property
    def answers(self) -> tuple[str, ...]:
        """Names of what is asked."""
        return tuple(self._core.answers())

    def sensor_at(self, point: ArrayLike | Mapping[str, Any]) -> Sensor:
        """The sensor of a design."""
        text = self._core.sensor_of(self._point(point))
        return Sensor(self._core.sensor[0], text=text)

    def run(self, *, store: Path | None = None, executor: Executor | None = None) -> Result:
        """Evaluates the designs of the plan: ``taxel sweep``.

        The table has the columns that ``[sweep] columns`` names, or else all: variables, answers,
        status and reason.

        Args:
            store: Folder that keeps each finished design; a run that was ended goes on from there.
            executor: Anything with ``submit`` of ``concurrent.futures``: a process pool, Dask's
                ``client.get_executor()``, mpi4py's. Workers write to the store themselves, so no
                finished design is lost when one dies.

        Raises:
            InputError: a plan that the study cannot have.
            KeyboardInterrupt: Ctrl-C; the store keeps what is done.
        """
        table, computed = self._core.sweep(_path(store), self._submit(executor, store))
        return Result(self, Answers(table), computed=computed)

    def optimize(
        self,
        *,
        store: Path | None = None,
        executor: Executor | None = None,
        seed: int | None = None,
        evaluations: int | None = None,
    ) -> Result:
        """Finds the best design, or those that no other one dominates: ``taxel optimize``.

        The same seed gives the same designs, with an executor or without, and again from a store.
        Arguments are those of :meth:`run`; ``seed`` and ``evaluations`` in the place of those of
        the study file.
        """
        found = self._core.optimize(seed, evaluations, _path(store), self._submit(executor, store))
        return Result(
            self,
            Answers(found["front"]),
            computed=found["computed"],
            evaluations=found["evaluations"],
            dominated=Answers(found["dominated"]),
            points=found["points"],
            active=found["active"],
        )

    def tolerance(
        self, *, seed: int | None = None, samples: int | None = None, after: str | None = None, store: Path | None = None
    ) -> Tolerance:
        """What becomes of devices that are not made as drawn: ``taxel tolerance``.

        Args:
            samples: Base samples in the place of those of the study file.
            after: What is corrected on each made device: ``"as_drawn"``, ``"rest"`` or ``"bench"``.
            store: Folder that keeps each finished device.
        """
        found = self._core.tolerance(seed, samples, after, _path(store))
        return Tolerance(Answers(found["table"]), found["devices"], found["failed"], found["tighten_first"])

    def ask(self, point: ArrayLike | Mapping[str, Any], *, store: Path | None = None) -> Design:
        """Evaluates one design that another optimiser proposes.

        Args:
            point: Value of each variable in SI, in the order of :attr:`variables` or by name; of
                a variable of words the word or its index.
            store: Folder to look it up in.
        """
        row = self._core.evaluate(np.array([self._point(point)]), _path(store))[0]
        assert row is not None
        values, status, reason, answers = row
        read = {
            name: text if kind == "word" else number for name, (kind, number, text) in zip(self.answers, answers)
        }
        return Design(self, tuple(values), status, reason, read, row)

    def tell(self, *designs: Design, store: Path) -> None:
        """Keeps designs in a store, for all that work on the same sensor and answers."""
        self._core.keep([design._row for design in designs], os.fspath(store))

    def _point(self, point: ArrayLike | Mapping[str, Any]) -> list[float]:
        names = list(self.variables)
        if isinstance(point, Mapping):
            unknown = [name for name in point if name not in names]
            missing = [name for name in names if name not in point]
            if unknown or missing:
                raise ValueError(f"a point has the variables {', '.join(names)}; it was given {', '.join(map(str, point))}")
            values = [point[name] for name in names]
        else:
            values = list(np.atleast_1d(np.asarray(point, dtype=object)))
        for index, (value, words) in enumerate(zip(values, self._core.words())):
            if isinstance(value, str) and words is not None:
                if value not in words:
                    raise ValueError(f"{names[index]}: {value!r} is none of {', '.join(words)}")
                values[index] = words.index(value)
        return [float(value) for value in values]

    def _submit(self, executor: Executor | None, store: Path | None) -> Any:
        if executor is None:
            return None
        folder = _path(store)

        def submit(points: list[list[float]], stopped: Callable[[], bool]) -> list[Any]:
            share = max(_LEAST, min(_MOST, -(-len(points) // 64)))
            parts = [points[start : start + share] for start in range(0, len(points), share)]
            work: list[Future[list[Any]]] = [executor.submit(_worked, self, part, folder) for part in parts]
            waiting = set(work)
            while waiting and not stopped():
                waiting = wait(waiting, timeout=0.1).not_done
            if not waiting:
                return [row for future in work for row in future.result()]
            for future in work:
                future.cancel()
            return [None] * len(points)

        return submit

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Study):
            return NotImplemented
        return self.__reduce__() == other.__reduce__()

    def __hash__(self) -> int:
        return hash(self.__reduce__())

    def __reduce__(self) -> tuple[Any, ...]:
        return _study_of, (self._core.file, self._core.text, self._core.sensor)

    def __repr__(self) -> str:
        return f"<Study {self.name}: varies {', '.join(self.variables)} of {self._core.sensor[0]}>"

    def _repr_html_(self) -> str:
        rows = "".join(f"<tr><td>{name}</td><td>{key}</td></tr>" for name, key in self.variables.items())
        return f"<table><thead><tr><th>variable</th><th>key</th></tr></thead><tbody>{rows}</tbody></table>"


def _study_of(file: str, text: str, sensor: tuple[str, str]) -> Study:
    study = Study.__new__(Study)
    study._core = _taxel.Study(file, text, sensor)
    return study


def _worked(study: Study, points: list[list[float]], store: str | None) -> list[Any]:
    """What a worker does: computes designs on one thread and keeps them."""
    _taxel.threads(1)
    return study._core.evaluate(np.array(points, dtype=float).reshape(len(points), -1), store)


def _path(path: Path | None) -> str | None:
    return None if path is None else os.fspath(path)


def _written(name: str, sensor: str, tables: Mapping[str, Mapping[str, Any] | None]) -> str:
    """The study file of these tables."""
    lines = ["schema = 2", f"name = {toml_value(name)}", f"sensor = {toml_value(sensor)}"]
    for table, keys in tables.items():
        if keys:
            lines.append(f"\n[{table}]")
            lines.extend(f"{toml_value(str(key))} = {toml_value(value)}" for key, value in keys.items())
    return "\n".join(lines) + "\n"


@dataclass(frozen=True)
class Tolerance:
    """What becomes of made devices."""

    #: One row for each number: answer, quantity, of which spread, value, unit, standard error, interval.
    table: Answers
    #: Devices that were made, and those that failed.
    devices: int
    failed: int
    #: The spread to tighten first; None without limits.
    tighten_first: str | None

    def value(self, answer: str, quantity: str, of: str = "") -> float:
        """One number, such as ``value("all limits", "yield")``, in the unit of its row.

        Raises:
            KeyError: there is no such row.
        """
        table = self.table
        found: NDArray[np.bool_] = (table["answer"] == answer) & (table["quantity"] == quantity) & (table["of"] == of)
        if not found.any():
            raise KeyError((answer, quantity, of))
        return float(table["value"][found][0])

    def _repr_html_(self) -> str:
        return self.table._repr_html_()
