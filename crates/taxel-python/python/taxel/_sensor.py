"""The sensor and what follows from its file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _taxel
from ._answers import Answers, same

if TYPE_CHECKING:
    from ._calibration import Calibration
    from ._touch import Estimator, Twin

#: A quantity: a number in SI, or a text with its unit such as ``"5 N"``.
Quantity = float | str


def _text(path: str | os.PathLike[str]) -> str:
    return os.fspath(path)


def toml_value(value: Any) -> str:
    """A value as TOML writes it."""
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        return '"' + "".join(c if c >= " " and c != "\x7f" else f"\\u{ord(c):04x}" for c in escaped) + '"'
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{toml_value(str(key))} = {toml_value(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, (list, tuple, np.ndarray)):
        return "[" + ", ".join(toml_value(inner) for inner in value) + "]"
    raise TypeError(f"a {type(value).__name__} has no place in a sensor file: give a text, a number, a flag or a list")


class Sensor:
    """A soft tactile sensor as its file describes it.

    Args:
        source: Path of a sensor file, or the name of a shipped one: see :func:`taxel.shipped`.
        text: The text of a sensor file in the place of a path; ``source`` is then its name.

    Raises:
        InputError: the first mistake, with its line and key.

    >>> import taxel
    >>> taxel.Sensor("three-axis-8x8").shape
    (8, 8)
    """

    __slots__ = ("_core",)

    def __init__(self, source: str | os.PathLike[str] | None = None, *, text: str | None = None) -> None:
        if text is not None:
            name = "sensor.toml" if source is None else _text(source)
        elif source is None:
            raise TypeError("Sensor needs a file, the name of a shipped sensor, or text=")
        else:
            name, text = _taxel.sensor_text(_text(source))
        self._core = _taxel.Sensor(name, text)

    @property
    def file(self) -> str:
        """Name of the file, or of the shipped sensor."""
        return self._core.file

    @property
    def text(self) -> str:
        """Text of the file."""
        return self._core.text

    @property
    def hash(self) -> str:
        """SHA-256 of the text, as results of the command name it."""
        return self._core.hash

    @property
    def name(self) -> str:
        """Name of the device."""
        return self._core.name

    @property
    def element(self) -> str:
        """Key of the element, such as ``"three_axis_capacitor"``."""
        return self._core.element

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of taxels; row 0 is at +y, column 0 at -x."""
        return self._core.shape

    @property
    def positions(self) -> NDArray[np.float64]:
        """Position of each taxel in the frame of the sensor, m: ``(rows, columns, 3)``."""
        return np.array([position for position, _ in self._core.poses()]).reshape(*self.shape, 3)

    @property
    def facts(self) -> dict[str, dict[str, float | str]]:
        """What ``taxel check`` prints: group to name to value, SI or a word."""
        found: dict[str, dict[str, float | str]] = {}
        for group, name, value, _, _ in self._core.facts():
            found.setdefault(group, {})[name] = value
        return found

    @property
    def loads(self) -> dict[str, str]:
        """Loads that :meth:`predict` takes: name to meaning, with the short name and the SI unit."""
        return {
            name: f"{about} ({short}{f', {unit}' if unit else ''})"
            for name, short, unit, about in self._core.load_columns()
        }

    def predict(
        self,
        loads: str | os.PathLike[str] | None = None,
        *,
        load: str | None = None,
        mechanics: str | None = None,
        calibration: Calibration | None = None,
        **values: ArrayLike | str | None,
    ) -> Answers:
        """What the sensor reads under loads.

        Args:
            loads: Path of a CSV file of loads, as ``taxel predict --loads`` reads it.
            load: One load in words, such as ``"fx=1 mN, fz=5 mN"``.
            mechanics: ``"closed_form"`` or ``"fem"`` in the place of what the file says. Finite
                elements take seconds.
            calibration: Constants of a made device; answers then carry their deviation.
            **values: Loads by name (:attr:`loads`), each a number in SI, a text with its unit, or
                an array ``(n,)`` of them. What is given once holds for all ``n``.

        Returns:
            One row for each load: the columns of ``taxel predict``.

        Raises:
            InputError: a load that the device does not take, with the range.
            SolveError: finite elements found no solution.
        """
        return Answers(
            self._core.predict(
                values,
                load,
                None if loads is None else _text(loads),
                mechanics,
                None if calibration is None else calibration._named,
            )
        )

    def information(
        self,
        load: str | None = None,
        *,
        noise: Quantity | None = None,
        radius: str | tuple[Quantity, Quantity] | None = None,
        **values: ArrayLike | str | None,
    ) -> Information:
        """What one frame says of a load.

        Args:
            load: The load in words, such as ``"fz=5 N"``; or give it by names as in :meth:`predict`.
            noise: Standard deviation of a reading in the place of that of the board.
            radius: Of the contact: ``"known"`` (default), ``"unknown"``, or the least and the
                greatest radius.

        Raises:
            InputError: a load beyond the model, or a device without a model.
        """
        return Information._of(self._core.information(values, load, noise, radius))

    def replace(self, changes: Mapping[str, Any], *, name: str | None = None) -> Sensor:
        """The sensor with other values, made by editing the text of its file: comments stay.

        Args:
            changes: Path of a key (see the reference of the sensor file) to its value: a text with
                its unit, a number, a word, a flag or a list.
            name: Name of the new file in messages; default that of this one.

        Raises:
            InputError: a key that does not exist, with the nearest ones; a value that it does not
                take; a rule between keys that does not hold any more.
        """
        lines = [f"{toml_value(key)} = {toml_value(value)}" for key, value in changes.items()]
        # A study asks something of each design; what it is does not matter here.
        asked = next(name for _, name, value, _, _ in self._core.facts() if isinstance(value, float))
        question = ["[answers.it]", 'of = "check"', f"quantity = {toml_value(asked)}"]
        head = ["schema = 2", 'name = "replace"', 'sensor = "this"', "[set]"]
        text = "\n".join([*head, *lines, *question, ""])
        study = _taxel.Study("replace", text, (self.file, self.text))
        return Sensor(name or self.file, text=study.sensor_of([]))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the sensor file; a file that is there is replaced.

        Raises:
            OSError: it cannot be written.
        """
        _taxel.write_text(_text(path), self.text)

    def drawing(self) -> str:
        """The drawing to scale, top view and cross-section, SVG."""
        return self._core.drawing()

    def twin(self, script: str | os.PathLike[str] | None = None, *, seed: int = 1) -> Twin:
        """A simulated piece of this sensor under a stimulus.

        Args:
            script: A shipped script (``taxel.shipped("stimulus")``) or a file; default the usual
                script of the device.
            seed: Of the noise; the same seed gives the same frames.

        Raises:
            InputError: a script with a mistake, or one that does not fit; a device without a model.
        """
        from ._touch import Twin

        return Twin(self, script, seed=seed)

    def estimator(self, *, calibration: Calibration | None = None) -> Estimator:
        """An estimator of the frames of this sensor, as drawn or with a calibration.

        Raises:
            InputError: a calibration of another sensor; a device of which nothing was learned yet.
        """
        from ._touch import Estimator

        return Estimator(self, calibration=calibration)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Sensor):
            return NotImplemented
        return self.file == other.file and self.text == other.text

    def __hash__(self) -> int:
        return hash((self.file, self.text))

    def __reduce__(self) -> tuple[Any, ...]:
        return _sensor_of, (self.file, self.text)

    def __copy__(self) -> Sensor:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Sensor:
        # It cannot be changed.
        return self

    def __repr__(self) -> str:
        return f"<Sensor {self.file}: {self.name}, {self.shape[0]} x {self.shape[1]} taxels>"

    def _repr_html_(self) -> str:
        rows = []
        for group, name, value, unit, _ in self._core.facts():
            shown = f"{value:.5g} {unit}" if isinstance(value, float) else str(value)
            rows.append(f"<tr><td>{group}</td><td>{name}</td><td>{shown.replace('<', '&lt;')}</td></tr>")
        return f"{self.drawing()}<table>{''.join(rows)}</table>"


def _sensor_of(name: str, text: str) -> Sensor:
    return Sensor(name, text=text)


@dataclass(frozen=True, eq=False)
class Information:
    """What one frame says of a load, by the slopes and the noise of the channels.

    ``k`` unknowns are estimated from ``n`` channels. A frame that does not determine them has no
    covariance: NaN, and an infinite condition.
    """

    #: Name of each unknown, such as ``"force_z"``.
    unknowns: tuple[str, ...]
    #: SI unit of each unknown.
    units: tuple[str, ...]
    #: Slope of each channel over each unknown, SI: ``(n, k)``.
    jacobian: NDArray[np.float64]
    #: Standard deviation of a reading of each channel, SI: ``(n,)``.
    noise: NDArray[np.float64]
    #: Fisher matrix of one frame, SI: ``(k, k)``.
    fisher: NDArray[np.float64]
    #: Its inverse, SI: ``(k, k)``; NaN where it is singular.
    covariance: NDArray[np.float64]
    #: Condition number of the Fisher matrix, scaled by the full scales.
    condition: float
    #: Trace, determinant and greatest eigenvalue of the covariance of what is asked for, SI.
    a_criterion: float
    d_criterion: float
    e_criterion: float
    #: Standard deviation of the place of a contact, m; NaN for a device that finds none.
    place_deviation: float

    @classmethod
    def _of(cls, found: dict[str, Any]) -> Information:
        names, units, _ = zip(*found["unknowns"])
        count = len(names)
        covariance = found["covariance"]
        number = {
            key: float("nan") if found[key] is None else found[key]
            for key in ("condition", "a_criterion", "d_criterion", "e_criterion", "place_deviation")
        }
        return cls(
            unknowns=names,
            units=units,
            jacobian=np.array(found["jacobian"], float).reshape(-1, count),
            noise=np.array(found["noise"], float),
            fisher=np.array(found["fisher"], float),
            covariance=np.full((count, count), np.nan) if covariance is None else np.array(covariance, float),
            **number,
        )

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviation of each unknown from one frame, SI."""
        diagonal = np.sqrt(np.diag(self.covariance))
        return {name: float(value) for name, value in zip(self.unknowns, diagonal)}

    @property
    def deviation(self) -> float:
        """Standard deviation of the only unknown, SI.

        Raises:
            ValueError: several unknowns; see :attr:`deviations`.
        """
        if len(self.unknowns) != 1:
            raise ValueError(f"several numbers are estimated: use deviations, of {', '.join(self.unknowns)}")
        return self.deviations[self.unknowns[0]]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Information):
            return NotImplemented
        return self.unknowns == other.unknowns and all(
            same(np.asarray(getattr(self, name)), np.asarray(getattr(other, name)))
            for name in ("jacobian", "noise", "fisher", "covariance")
        )

    def __repr__(self) -> str:
        shown = ", ".join(f"{name} {value:.4g} {unit}" for (name, value), unit in zip(self.deviations.items(), self.units))
        return f"<Information: deviations of one frame {shown}>"
