"""Frames and what an estimator makes of them."""

from __future__ import annotations

import enum
import os
import warnings
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _taxel
from ._answers import _needed, same
from ._errors import FrameError
from ._sensor import Sensor

if TYPE_CHECKING:
    from ._calibration import Calibration


class State(enum.IntEnum):
    """State of the value of a taxel: how far it can be trusted."""

    #: Nothing is against the value.
    OK = 0
    #: A value without a check, or one that cannot be relied on yet.
    UNCHECKED = 1
    #: Electrodes touch each other: the value is a lower bound.
    CLOSED = 2
    #: Beyond the full scale, or beyond what the model knows.
    OUT_OF_RANGE = 3
    #: The search did not end: the value is its last step.
    NOT_CONVERGED = 4
    #: The readings contradict each other or the model.
    INCONSISTENT = 5
    #: A channel gives no reading, or an impossible one.
    FAULTY = 6
    #: Not used.
    MASKED = 7
    #: The reading is at the end of what can be read: the value is a bound.
    SATURATED = 8
    #: Several positions or values explain the readings equally well.
    AMBIGUOUS = 9
    #: Pressing below zero beyond what noise can do: the zero is wrong.
    BELOW_ZERO = 10


class Certainty(enum.IntEnum):
    """How much a total, the force of a contact or the value of an event says."""

    #: The number with its standard deviation.
    EXACT = 0
    #: No less than the number.
    AT_LEAST = 1
    #: Nothing is known.
    UNKNOWN = 2


#: One row for each contact of each frame. SI; positions are from the centre of the array, on the
#: developed surface. ``bound`` is the code of the :class:`State` of a taxel that gives only a
#: bound, or -1; ``certainty`` that of :class:`Certainty`.
CONTACT = np.dtype(
    [
        ("sequence", "u8"), ("time_ns", "i8"), ("contact", "u8"), ("taxels", "i8"), ("peak_taxel", "i8"), ("bound", "i2"),
        ("area", "f8"), ("centre", "f8", 2), ("centre_covariance", "f8", 3), ("velocity", "f8", 2),
        ("force", "f8", 3), ("force_deviation", "f8", 3), ("torsion", "f8"), ("peak", "f8"), ("certainty", "u1"),
    ]
)  # fmt: skip

#: One row for each event of a contact; ``value`` is in the unit that the kind has in the guide.
EVENT = np.dtype(
    [("sequence", "u8"), ("time_ns", "i8"), ("contact", "u8"), ("kind", "U16"), ("value", "f8"), ("deviation", "f8"), ("certainty", "u1")]
)


class _Equal:
    """Compares the arrays of a dataclass, NaN equal to NaN."""

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        for one in fields(self):  # type: ignore[arg-type]
            mine, theirs = getattr(self, one.name), getattr(other, one.name)
            if isinstance(mine, np.ndarray):
                if mine.dtype.names:
                    if mine.shape != theirs.shape or mine.tobytes() != theirs.tobytes():
                        return False
                elif not same(mine, theirs):
                    return False
            elif mine != theirs:
                return False
        return True


@dataclass(frozen=True, eq=False)
class Frames(_Equal):
    """Frames of ``n`` times and ``channels`` channels."""

    #: Device time of the start of each frame, ns: ``(n,)`` int64.
    time_ns: NDArray[np.int64]
    #: Running number given by the device: ``(n,)`` uint64; a jump means lost frames.
    sequence: NDArray[np.uint64]
    #: Reading of each channel, in SI or counts: ``(n, channels)``; NaN for none. Taxel by taxel,
    #: row by row.
    values: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.time_ns)

    def __getitem__(self, index: slice | ArrayLike) -> Frames:
        """Some of the frames."""
        chosen = index if isinstance(index, slice) else np.atleast_1d(np.asarray(index))
        return Frames(self.time_ns[chosen], self.sequence[chosen], self.values[chosen])

    def __repr__(self) -> str:
        return f"<Frames: {len(self)} of {self.values.shape[-1]} channels>"


@dataclass(frozen=True, eq=False)
class Touch(_Equal):
    """Touch in ``n`` frames on ``rows`` x ``columns`` taxels. SI; NaN for what is not known."""

    #: Time and number of each frame: ``(n,)``.
    time_ns: NDArray[np.int64]
    sequence: NDArray[np.uint64]
    #: Value of each taxel along x, y and z, which presses: ``(n, rows, columns, 3)``. A device of
    #: one component has z alone.
    value: NDArray[np.float64]
    #: Its standard deviation: ``(n, rows, columns, 3)``.
    deviation: NDArray[np.float64]
    #: Consistency of redundant channels, one standard deviation wide: ``(n, rows, columns)``.
    residual: NDArray[np.float64]
    #: Codes of :class:`State`: ``(n, rows, columns)`` uint8.
    state: NDArray[np.uint8]
    #: True for taxels that are part of totals and contacts: ``(n, rows, columns)``.
    counted: NDArray[np.bool_]
    #: Total force and its standard deviation, N, and total moment, N m: ``(n, 3)``.
    total_force: NDArray[np.float64]
    total_deviation: NDArray[np.float64]
    moment: NDArray[np.float64]
    #: How much the total says, codes of :class:`Certainty`: ``(n,)`` uint8; and the code of the
    #: :class:`State` that is the reason why it is not exact, or -1: ``(n,)`` int16.
    total_certainty: NDArray[np.uint8]
    total_reason: NDArray[np.int16]
    #: False for frames whose values are no forces yet, because the zero is not taken: ``(n,)``.
    zero_known: NDArray[np.bool_]
    #: Sum of the values along z: ``(n,)``.
    sum: NDArray[np.float64]
    #: Centre of pressure, m: ``(n, 2)``; NaN without contact.
    centre: NDArray[np.float64]
    #: Channels at an end of their range: ``(n,)``.
    clipped: NDArray[np.int64]
    #: One row for each contact of each frame: the dtype :data:`taxel.CONTACT`.
    contacts: NDArray[np.void]
    #: One row for each event: the dtype :data:`taxel.EVENT`.
    events: NDArray[np.void]
    #: Quantity of :attr:`value`, such as ``"force"``, and its SI unit.
    quantity: str = "force"
    unit: str = "N"
    #: Frames of this block that came late or twice: they have no row.
    skipped: int = 0

    def __len__(self) -> int:
        return len(self.time_ns)

    @property
    def force(self) -> NDArray[np.float64]:
        """Force on each taxel, N: ``(n, rows, columns, 3)``.

        Raises:
            AttributeError: a device whose taxels have another quantity: see :attr:`value`.
        """
        if self.quantity != "force":
            raise AttributeError(f"the taxels of this device have a {self.quantity}: use value, in {self.unit}")
        return self.value

    @property
    def pressed(self) -> NDArray[np.float64]:
        """Value along z of each taxel: ``(n, rows, columns)``."""
        return self.value[..., 2]

    def plot(self, index: int = -1, axes: Any = None) -> Any:
        """Images of the values along x, y and z of a frame; of a device of one component only z.

        Needs matplotlib: ``pip install matplotlib``. Returns the axes.
        """
        shown = [axis for axis in range(3) if len(self) and not np.isnan(self.value[index, ..., axis]).all()]
        if axes is None:
            _, axes = _needed("matplotlib.pyplot").subplots(1, max(len(shown), 1), squeeze=False)
            axes = axes[0]
        for axis, ax in zip(shown, np.ravel(axes)):
            image = self.value[index, ..., axis]
            size = float(np.nanmax(np.abs(image))) or 1.0
            picture = ax.imshow(image, cmap="RdBu_r", vmin=-size, vmax=size)
            ax.set_title(f"{self.quantity} {'xyz'[axis]} [{self.unit}]")
            ax.figure.colorbar(picture, ax=ax, shrink=0.7)
        return axes

    def __repr__(self) -> str:
        return (
            f"<Touch: {len(self)} frames of {self.value.shape[1]} x {self.value.shape[2]} taxels, "
            f"{len(self.contacts)} contacts, {len(self.events)} events>"
        )

    def _repr_html_(self) -> str:
        if not len(self):
            return f"<p>{self!r}</p>".replace("<Touch", "&lt;Touch")
        images = []
        for axis in range(3):
            image = self.value[-1, ..., axis]
            if np.isnan(image).all():
                continue
            size = float(np.nanmax(np.abs(image))) or 1.0
            cells = []
            for (row, column), value in np.ndenumerate(image):
                share = 0.0 if np.isnan(value) else min(abs(value) / size, 1.0)
                colour = "178,24,43" if value >= 0 else "33,102,172"
                cells.append(
                    f'<rect x="{10 * column}" y="{10 * row}" width="10" height="10" fill="rgba({colour},{share:.3f})" '
                    'stroke="#ccc" stroke-width="0.3"/>'
                )
            rows, columns = image.shape
            images.append(
                f"<figure style='display:inline-block'><svg width='{20 * columns}' viewBox='0 0 {10 * columns} {10 * rows}'>"
                f"{''.join(cells)}</svg><figcaption>{'xyz'[axis]}, to {size:.3g} {self.unit}</figcaption></figure>"
            )
        return "".join(images) or repr(self).replace("<", "&lt;")


class Twin:
    """A simulated piece of a sensor under a stimulus: as good as hardware.

    Made by :meth:`Sensor.twin`.
    """

    def __init__(self, sensor: Sensor, script: str | os.PathLike[str] | None = None, *, seed: int = 1) -> None:
        #: The sensor.
        self.sensor = sensor
        #: Name of the script, or None for the usual one.
        self.script = None if script is None else os.fspath(script)
        #: Seed of the noise.
        self.seed = seed
        self._given = 0
        self._core = _taxel.Twin(sensor._core, self.script, None, seed)

    def frames(self, count: int) -> Frames:
        """The next frames: ``count`` of them, which go on where the last ones ended."""
        found = self._core.frames(count)
        self._given += count
        return Frames(found["time_ns"], found["sequence"], found["values"])

    def truth(self, frames: Frames) -> NDArray[np.float64]:
        """Force that the script puts on each taxel in these frames, N: ``(n, rows, columns, 3)``."""
        return self._core.truth(frames.time_ns).reshape(len(frames), *self.sensor.shape, 3)

    def __reduce__(self) -> tuple[Any, ...]:
        return _twin_of, (self.sensor, self.script, self.seed, self._given)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Twin):
            return NotImplemented
        return bool(self.__reduce__()[1] == other.__reduce__()[1])

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<Twin of {self.sensor.file}, script {self.script or 'usual'}, seed {self.seed}, frame {self._given}>"


def _twin_of(sensor: Sensor, script: str | None, seed: int, given: int) -> Twin:
    twin = Twin(sensor, script, seed=seed)
    if given:
        # The same seed gives the same frames.
        twin.frames(given)
    return twin


#: Most bytes of frames that an estimator keeps for its copies.
_MOST_KEPT = 64 << 20
#: Bytes that one call takes beside its frames.
_BESIDE = 512


class Estimator:
    """Frames to touch; remembers between calls, so blocks of any size give the same answers.

    Made by :meth:`Sensor.estimator`. A copy, also one that was pickled, has been pushed the same
    frames: they are kept up to 64 MiB. An estimator that has seen more is not copied.
    """

    def __init__(self, sensor: Sensor, *, calibration: Calibration | None = None) -> None:
        #: The sensor.
        self.sensor = sensor
        self._calibration = calibration
        # What was done since, with its arrays; None once that is too much.
        self._done: list[tuple[Any, ...]] | None = []
        self._size = 0
        self._core = _taxel.Estimator(sensor._core, None if calibration is None else calibration._named)
        self._meaning = self._core.meaning()

    @property
    def channels(self) -> tuple[str, ...]:
        """Name of each channel in the order of a frame."""
        return tuple(self._meaning["channels"])

    def push(self, frames: Frames | ArrayLike, time_ns: ArrayLike | None = None, sequence: ArrayLike | None = None) -> Touch:
        """Touch of each frame.

        Args:
            frames: Frames of a twin or a recording; or readings ``(n, channels)`` with their times.
            time_ns: Device times of the readings, ns: ``(n,)``.
            sequence: Their running numbers; default counted from 0.

        Raises:
            FrameError: frames of another device, or times that do not belong to them. The
                estimator stays as it was.
        """
        if isinstance(frames, Frames):
            values, times, numbers = frames.values, frames.time_ns, frames.sequence
        else:
            try:
                values = np.atleast_2d(np.asarray(frames, dtype=float))
            except (TypeError, ValueError) as error:
                raise FrameError(f"the frames are no array of numbers: {error}") from error
            if time_ns is None:
                raise FrameError("readings have no times: give time_ns, ns, or Frames")
            times = np.atleast_1d(np.asarray(time_ns))
            first = sum(self._core.counts())
            numbers = np.arange(first, first + len(times), dtype=np.uint64) if sequence is None else np.atleast_1d(np.asarray(sequence))
        if values.ndim != 2 or times.ndim != 1 or numbers.ndim != 1:
            raise FrameError(f"frames have the shape (n, channels), not {values.shape}; times and numbers (n,)")
        if times.dtype.kind not in "iu" or numbers.dtype.kind not in "iu":
            raise FrameError(f"times and numbers are whole numbers, not {times.dtype} and {numbers.dtype}")
        if not self.zero_known and not self._core.capturing():
            warnings.warn(
                "this estimator has no zero: the rest values are those of the drawing, which a made device does not have; "
                "call tare() before the first frames, with nothing on the sensor",
                stacklevel=2,
            )
        found = self._core.push(numbers, times, values)
        if self._done is not None:
            self._size += numbers.nbytes + times.nbytes + values.nbytes + _BESIDE
            self._did("push", numbers.copy(), times.copy(), values.copy())
        contacts, events = found.pop("contacts"), found.pop("events")
        return Touch(
            **found,
            contacts=np.array([(*head, *middle, *tail) for head, middle, tail in contacts], CONTACT),
            events=np.array(events, EVENT),
            quantity=self._meaning["quantity"],
            unit=si_of(self._meaning),
        )

    def tare(self, frames: int = 60) -> None:
        """Takes the next ``frames`` frames as rest; contacts have no number meanwhile."""
        self._core.begin_rest_capture(frames)
        self._did("begin_rest_capture", frames)

    @property
    def zero_known(self) -> bool:
        """False while the device needs a tare and has none: its values are no forces yet."""
        return self._core.zero_known()

    @property
    def tared(self) -> bool:
        """True once a rest capture succeeded.

        Raises:
            FrameError: it was refused; the text says why.
        """
        captured = self._core.captured()
        if captured:
            raise FrameError(captured)
        return captured is not None

    def clear_tare(self) -> None:
        """Returns to the rest values of the calibration."""
        self._core.clear_rest()
        self._did("clear_rest")

    @property
    def counts(self) -> dict[str, int]:
        """Frames so far: accepted, lost, late, duplicate, repeated."""
        return dict(zip(("accepted", "lost", "late", "duplicate", "repeated"), self._core.counts()))

    def _did(self, what: str, *arguments: Any) -> None:
        if self._done is not None:
            self._done.append((what, *arguments))
        if self._size > _MOST_KEPT:
            self._done = None

    def __reduce__(self) -> tuple[Any, ...]:
        if self._done is None:
            raise TypeError(
                f"an Estimator that has seen more than {_MOST_KEPT >> 20} MiB of frames is not copied: "
                "send the sensor, the calibration and the frames"
            )
        return _estimator_of, (self.sensor, self._calibration, self._done)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Estimator):
            return NotImplemented
        if self is other:
            return True
        if self._done is None or other._done is None:
            return False
        return (
            self.sensor == other.sensor
            and self._calibration == other._calibration
            and len(self._done) == len(other._done)
            and all(_same_call(mine, theirs) for mine, theirs in zip(self._done, other._done))
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<Estimator of {self.sensor.file}, {self.counts['accepted']} frames>"


def _same_call(one: tuple[Any, ...], other: tuple[Any, ...]) -> bool:
    return len(one) == len(other) and all(
        same(mine, theirs) if isinstance(mine, np.ndarray) else mine == theirs for mine, theirs in zip(one, other)
    )


def _estimator_of(sensor: Sensor, calibration: Calibration | None, done: list[tuple[Any, ...]]) -> Estimator:
    estimator = Estimator(sensor, calibration=calibration)
    for what, *arguments in done:
        # The same frames lead to the same state.
        getattr(estimator._core, what)(*arguments)
    estimator._done = list(done)
    estimator._size = sum(
        _BESIDE + sum(array.nbytes for array in call[1:]) for call in done if call[0] == "push"
    )
    return estimator


def si_of(meaning: dict[str, Any]) -> str:
    """SI unit of the values of taxels."""
    units = {"force": "N", "pressure": "Pa", "stress": "Pa", "capacitance": "F", "resistance": "ohm", "charge": "C", "voltage": "V", "flux_density": "T"}
    return units.get(meaning["quantity"], str(meaning["symbol"]))


@dataclass(frozen=True, eq=False)
class Recording(_Equal):
    """The frames of a recording with what it says of them. Made by :func:`taxel.read`."""

    #: The frames.
    frames: Frames
    #: Name of the source.
    name: str
    #: Rows and columns of taxels.
    shape: tuple[int, int]
    #: Channels of one taxel.
    channels_per_taxel: int
    #: Quantity of the values, and the unit that people read it in.
    quantity: str
    unit: str
    #: Spacing of rows and of columns, m; None where it is not stated.
    pitch: tuple[float, float] | None
    #: Time between frames, s; None where it is not stated.
    period: float | None
    #: Names of the sensors in the recording.
    parts: tuple[str, ...] = field(default=())
    #: What ended the reading of a damaged recording; empty for a whole one.
    damage: str = ""

    def __len__(self) -> int:
        return len(self.frames)

    def __repr__(self) -> str:
        rows, columns = self.shape
        return f"<Recording {self.name}: {len(self)} frames of {rows} x {columns} taxels, {self.quantity} [{self.unit}]>"


def read(
    path: str | os.PathLike[str],
    *,
    part: str | None = None,
    bare: bool = False,
    columns: str | None = None,
) -> Recording:
    """Reads a recording; its format is recognised by its content.

    Args:
        path: MCAP of ``taxel live --record``, CSV, Tekscan, XSENSOR, or a recording of another
            program: bags of ROS, XDF, NPY, NPZ, HDF5.
        part: Name or number from 1 of the sensor, topic, stream or data set in a recording of
            several; default the first sensor, or the only series.
        bare: True if rows of numbers without a header are the channels of a device.
        columns: What columns or channels are, such as ``"time=2[ms],value=3-18[kPa]"``; default
            as they are recognised.

    A recording that is damaged is read up to the damage: a warning says so, and
    :attr:`Recording.damage`.

    Raises:
        InputError: it cannot be read, or holds no frame.
    """
    import warnings

    found = _taxel.read_recording(os.fspath(path), part, bare, columns)
    about = found["about"]
    if found["damage"]:
        warnings.warn(f"read up to the damage: {found['damage']}", stacklevel=2)
    pitch = about["pitch"]
    return Recording(
        frames=Frames(found["time_ns"], found["sequence"], found["values"]),
        name=about["name"],
        shape=about["shape"],
        channels_per_taxel=about["channels_per_taxel"],
        quantity=about["quantity"],
        unit=about["unit"],
        pitch=None if pitch is None else (pitch[0], pitch[1]),
        period=about["period"],
        parts=tuple(found["parts"]),
        damage=found["damage"],
    )
