"""Calibration: from measurements to the constants of a sensor."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from . import _taxel
from ._sensor import Sensor

Path = str | os.PathLike[str]


@dataclass(frozen=True)
class Parameter:
    """A constant of a sensor with its uncertainty, SI."""

    #: Best value, standard deviation and 95 % interval.
    value: float
    deviation: float
    interval: tuple[float, float]
    #: SI unit; empty for a plain number.
    unit: str
    #: What the data say of it, such as ``"identified"`` or ``"not_identifiable"``.
    verdict: str


class Calibration:
    """A calibration, as its file describes it.

    Args:
        source: Path of a calibration file; or its name, where ``text`` is given.
        text: The text of a calibration file.

    Raises:
        InputError: the first mistake, at its place.
    """

    def __init__(self, source: Path, *, text: str | None = None, _html: str | None = None, _json: str | None = None) -> None:
        name = os.fspath(source)
        self._core = _taxel.Calibration(name, _taxel.read_text(name) if text is None else text)
        self._html, self._json = _html, _json

    @property
    def _named(self) -> tuple[str, str]:
        return self._core.file, self._core.text

    @property
    def text(self) -> str:
        """The calibration file."""
        return self._core.text

    @property
    def model(self) -> str:
        """Name of the model whose constants these are."""
        return self._core.model

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Name to value, deviation, interval, unit and verdict."""
        return {
            name: Parameter(value, deviation, (interval[0], interval[1]), unit, verdict)
            for name, value, deviation, interval, unit, verdict in self._core.parameters()
        }

    @property
    def remarks(self) -> list[str]:
        """What the user should know, in words."""
        return self._core.remarks

    @property
    def details(self) -> dict[str, Any]:
        """All that ``taxel calibrate --format json`` prints.

        Raises:
            ValueError: a calibration that was read from its file.
        """
        return json.loads(self._made("details", self._json))  # type: ignore[no-any-return]

    def save(self, path: Path) -> None:
        """Writes the calibration file; a file that is there is replaced.

        Raises:
            OSError: it cannot be written.
        """
        _taxel.write_text(os.fspath(path), self.text)

    def report(self, path: Path) -> None:
        """Writes the report with its figures, HTML.

        Raises:
            ValueError: a calibration that was read from its file: the report needs the data.
            OSError: it cannot be written.
        """
        _taxel.write_text(os.fspath(path), self._made("a report", self._html))

    def _made(self, what: str, of: str | None) -> str:
        if of is None:
            raise ValueError(f"{what} needs the data: this calibration was read from its file; use taxel.calibrate")
        return of

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Calibration):
            return NotImplemented
        return self._named == other._named

    def __hash__(self) -> int:
        return hash(self._named)

    def __reduce__(self) -> tuple[Any, ...]:
        return _calibration_of, (*self._named, self._html, self._json)

    def __repr__(self) -> str:
        return f"<Calibration {self.model}: {', '.join(self.parameters)}>"

    def _repr_html_(self) -> str:
        rows = [
            f"<tr><td>{name}</td><td>{one.value:.5g} {one.unit}</td><td>{one.deviation:.2g}</td>"
            f"<td>{one.interval[0]:.5g} to {one.interval[1]:.5g}</td><td>{one.verdict}</td></tr>"
            for name, one in self.parameters.items()
        ]
        head = "".join(f"<th>{title}</th>" for title in ("parameter", "value", "deviation", "95 % interval", "verdict"))
        return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def _calibration_of(name: str, text: str, html: str | None, details: str | None) -> Calibration:
    return Calibration(name, text=text, _html=html, _json=details)


def _files(data: Any) -> list[str] | None:
    """Names of files, if that is what is given."""
    files = [data] if isinstance(data, (str, os.PathLike)) else data
    if isinstance(files, Sequence) and all(isinstance(file, (str, os.PathLike)) for file in files):
        return [os.fspath(file) for file in files]
    return None


def _sensors(beside: Sequence[Sensor | Path]) -> list[_taxel.Sensor]:
    return [(one if isinstance(one, Sensor) else Sensor(one))._core for one in beside]


def calibrate(
    sensor: Sensor | Path,
    data: Path | Sequence[Path],
    *,
    beside: Sequence[Sensor | Path] = (),
    hold_out: str = "20%",
    model: str | None = None,
    profile: bool = False,
    robust: bool = False,
    rate: float | None = None,
    scale_unit: str | None = None,
) -> Calibration:
    """Fits the constants of a sensor to measurements, or trains a map from recordings.

    Args:
        sensor: The sensor, its file, or a shipped name.
        data: Calibration data, CSV, or recordings and folders of them for an array without a model.
        beside: Sensors that share constants with it, and whose readings are in the data.
        hold_out: Share of the readings that the fit does not see.
        model: Model in the place of the one that the data choose.
        profile: Intervals from the profile of the likelihood.
        robust: Outliers count for less.
        rate: Rows a second of tables without a time, Hz, of a device that is trained.
        scale_unit: Unit of the scale in recordings without a header, of a device that is trained, "g" or "N"; without
            it grams, unless the sensor file speaks against it.

    Raises:
        InputError: a mistake in the data, with file, line and column.
    """
    core = _sensors([sensor])[0]
    text, html, details, _ = _taxel.calibrate(
        core,
        _sensors(beside),
        _files(data) or [],
        hold_out,
        model,
        profile,
        robust,
        rate,
        scale_unit,
    )
    return Calibration("calibration.toml", text=text, _html=html, _json=details)


def calibration_data(
    sensor: Sensor | Path,
    *,
    beside: Sequence[Sensor | Path] = (),
    seed: int = 1,
    readings: int = 200,
    noise: float = 0.01,
) -> str:
    """Synthetic calibration data of a sensor and those beside it, CSV: ``taxel twin``.

    Args:
        readings: Readings of each sensor.
        noise: Standard deviation over the range of the signal.
    """
    return _taxel.synthetic(_sensors([sensor])[0], _sensors(beside), seed, readings, noise)
