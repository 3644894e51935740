"""Maps that are trained from recordings, in the shape of scikit-learn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _taxel
from ._calibration import Calibration, Path, _files
from ._errors import FrameError, InputError
from ._sensor import Sensor
from ._touch import Frames

#: Cells along each side of an area that the places give.
_CELLS = 16


class TrainedMap:
    """Map from the channels of an array without a physical model to place and force.

    ``fit`` trains it as ``taxel calibrate`` does, ``predict`` estimates as ``taxel live`` does.

    Args:
        sensor: An array of the element ``trained``, its file, or a shipped name. None: ``fit`` makes
            one from its arrays, with an area as large as the places.
        hold_out: Share of the readings that the fit does not see.

    >>> import numpy as np, taxel
    >>> taxel.TrainedMap("eflesh-lattice").outputs
    ()
    """

    def __init__(self, sensor: Sensor | Path | None = None, *, hold_out: str = "20%") -> None:
        #: The sensor; None before ``fit`` where none was given.
        self.sensor = sensor if sensor is None or isinstance(sensor, Sensor) else Sensor(sensor)
        if self.sensor is not None and self.sensor.element != "trained":
            raise InputError(f"{self.sensor.file}: a {self.sensor.element} has a model and is not trained: use taxel.calibrate")
        self._hold_out = hold_out
        #: What ``fit`` found, with its report and held-out errors; None before.
        self.calibration: Calibration | None = None

    def fit(
        self,
        frames: Frames | ArrayLike | Path | Sequence[Path],
        places: ArrayLike | None = None,
        force: ArrayLike | None = None,
        *,
        rate: float | None = None,
        scale_unit: str | None = None,
    ) -> TrainedMap:
        """Trains the map and returns it.

        Args:
            frames: Recordings or folders of them, as the guide "Calibrate" describes; or one run of
                frames, or readings ``(n, channels)`` with ``rate``, that begins at rest.
            places: Where it was pressed in each frame, m: ``(n, 2)``, or ``(n, 3)`` with the depth.
                NaN is not allowed.
            force: Pressing force in each frame, N: ``(n,)``.
            rate: Rows a second of readings or recordings without a time, Hz.
            scale_unit: Unit of the scale in recordings without a header, "g" or "N".

        Raises:
            InputError: recordings or arrays that cannot train a map, with the reason.
        """
        given = _files(frames)
        if given is not None:
            if places is not None or force is not None:
                raise InputError("fit: recordings have places and forces of their own: leave places and force out")
            sensor, texts = self._sensor(), None
        else:
            text, sensor = self._table(frames, places, force, rate)
            given, texts = [], [("arrays.csv", text)]
        made, html, details, _ = _taxel.calibrate(
            sensor._core, [], given, self._hold_out, None, False, False, rate if texts is None else None, scale_unit, texts
        )
        self.sensor = sensor
        self.calibration = Calibration("calibration.toml", text=made, _html=html, _json=details)
        return self

    @property
    def outputs(self) -> tuple[str, ...]:
        """Columns of :meth:`predict`: ``"x"`` and ``"y"`` in m, ``"force_z"`` in N; empty before ``fit``."""
        return () if self.calibration is None else tuple(self.calibration._core.outputs())

    def predict(
        self, frames: Frames | ArrayLike, *, rate: float | None = None, rest: int = 0, return_std: bool = False
    ) -> NDArray[np.float64] | tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Place and force in each frame: ``(n, len(outputs))``, SI; NaN for a place that nothing presses on.

        Args:
            frames: Frames, or readings ``(n, channels)`` with ``rate``. Their order counts: the map of
                the force remembers the creep of the body.
            rate: Rows a second of readings, Hz.
            rest: Number of frames at the beginning that are taken as rest; 0 for the rest of the training.
            return_std: True for the standard deviations beside it, of the same shape.

        Raises:
            InputError: before ``fit``.
            FrameError: frames of another device, or a rest that was refused.
        """
        if self.calibration is None:
            raise InputError("predict: this map is not trained: fit it, or load it")
        estimator = self._sensor().estimator(calibration=self.calibration)
        if rest:
            estimator.tare(rest)
        frames = frames if isinstance(frames, Frames) else _frames(frames, rate)
        touch = estimator.push(frames)
        if rest and not estimator.tared:
            raise FrameError(f"predict: rest = {rest} frames, but there are {len(touch)}")
        values = np.full((len(touch), 3), np.nan)
        deviations = np.full((len(touch), 3), np.nan)
        rows = np.searchsorted(touch.sequence, touch.contacts["sequence"])
        values[rows, :2] = touch.contacts["centre"]
        deviations[rows, :2] = np.sqrt(touch.contacts["centre_covariance"][:, [0, 2]])
        values[:, 2], deviations[:, 2] = touch.total_force[:, 2], touch.total_deviation[:, 2]
        columns = [("x", "y", "force_z").index(name) for name in self.outputs]
        return (values[:, columns], deviations[:, columns]) if return_std else values[:, columns]

    def save(self, path: Path) -> None:
        """Writes the calibration file, which ``taxel live --calibration`` reads.

        Raises:
            InputError: before ``fit``.
            OSError: it cannot be written.
        """
        if self.calibration is None:
            raise InputError("save: this map is not trained: fit it")
        self.calibration.save(path)

    @classmethod
    def load(cls, sensor: Sensor | Path, path: Path) -> TrainedMap:
        """The map of a calibration file of a sensor.

        Raises:
            InputError: it cannot be read, or is of another sensor.
        """
        found = cls(sensor)
        found.calibration = Calibration(path)
        # A calibration of another sensor is refused here.
        found._sensor().estimator(calibration=found.calibration)
        return found

    def _sensor(self) -> Sensor:
        if self.sensor is None:
            raise InputError("fit: recordings need the sensor that they are of: give TrainedMap(sensor)")
        return self.sensor

    def _table(
        self, frames: Any, places: ArrayLike | None, force: ArrayLike | None, rate: float | None
    ) -> tuple[str, Sensor]:
        """A recording with a header, and its sensor."""
        run = frames if isinstance(frames, Frames) else _frames(frames, rate)
        count, channels = run.values.shape
        if places is None and force is None:
            raise InputError("fit: nothing says where or how hard it was pressed: give places, force, or both")
        head = ["time [s]", *(f"channel_{number + 1}" for number in range(channels))]
        columns = [(run.time_ns - run.time_ns[:1]) * 1e-9, *run.values.T]
        for name, values, widths, titles in (
            ("places", places, (2, 3), ["x [mm]", "y [mm]", "z [mm]"]),
            ("force", force, (1,), ["force_z [N]"]),
        ):
            if values is None:
                continue
            array = np.asarray(values, dtype=float)
            array = array.reshape(-1, 1) if array.ndim == 1 and widths == (1,) else array
            if array.ndim != 2 or len(array) != count or array.shape[1] not in widths:
                raise InputError(f"fit: {name} has the shape {np.shape(values)}; there are {count} frames")
            head += titles[: array.shape[1]]
            columns += list((array * (1e3 if name == "places" else 1.0)).T)
        lines = [",".join(head), *(",".join(map(repr, row)) for row in np.column_stack(columns).tolist())]
        return "\n".join([*lines, ""]), self.sensor or _made(run, places, force)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, TrainedMap):
            return NotImplemented
        mine, theirs = (self.sensor, self.calibration, self._hold_out), (other.sensor, other.calibration, other._hold_out)
        return mine == theirs

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        name = "a sensor of its arrays" if self.sensor is None else self.sensor.file
        return f"<TrainedMap of {name}: {', '.join(self.outputs) or 'not trained'}>"


def _frames(readings: ArrayLike, rate: float | None) -> Frames:
    """Readings at a steady rate."""
    if rate is None or not 0 < rate < 1e9:
        raise InputError("readings have no times: give Frames, or rate, Hz")
    try:
        values = np.asarray(readings, dtype=float)
    except (TypeError, ValueError) as error:
        raise FrameError(f"the readings are no array of numbers: {error}") from error
    if values.ndim != 2 or not len(values):
        raise FrameError(f"readings have the shape (n, channels), not {values.shape}")
    numbers = np.arange(len(values))
    return Frames(np.rint(numbers * (1e9 / rate)).astype(np.int64), numbers.astype(np.uint64), values)


def _made(run: Frames, places: ArrayLike | None, force: ArrayLike | None) -> Sensor:
    """A sensor with the channels of a run, as large as its places."""
    side = 10e-3 if places is None else float(np.ptp(np.asarray(places, dtype=float)[:, :2], axis=0).max())
    full = 1.0 if force is None else float(np.abs(np.asarray(force, dtype=float)).max())
    step = float(np.median(np.diff(run.time_ns))) * 1e-9 if len(run) > 1 else 0.1
    channels = ", ".join(f'"{number + 1}"' for number in range(run.values.shape[1]))
    text = f"""schema = 2
name = "array of {run.values.shape[1]} channels"

[array]
rows = {_CELLS}
columns = {_CELLS}
pitch = "{side / (_CELLS - 1) * 1e3:.6g} mm"
mount = "flat"

[element.trained]
full_scale = "{full:.6g} N"
groups = [{{ name = "channel", channels = [{channels}] }}]

[electronics]
frame_rate = "{1 / step:.6g} Hz"
scan = "simultaneous"
readout = {{ digital = {{ unit = "counts" }} }}
"""
    return Sensor("trained.toml", text=text)
