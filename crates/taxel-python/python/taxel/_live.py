"""The live service from Python: touches in blocks."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .taxel_live import TaxelError, TaxelLive

__all__ = ["Block", "Live", "TaxelError", "connect"]


@dataclass(frozen=True)
class Block:
    """Touches of a while: ``n`` frames. SI; NaN for what is not known."""

    #: Time and number of each frame: ``(n,)``.
    time_ns: NDArray[np.int64]
    sequence: NDArray[np.uint64]
    #: Total force and its standard deviation, N, and moment, N m: ``(n, 3)``.
    total_force: NDArray[np.float64]
    total_deviation: NDArray[np.float64]
    moment: NDArray[np.float64]
    #: How much the total says: codes of :class:`taxel.Certainty`: ``(n,)`` uint8; and whether the values are forces yet.
    total_certainty: NDArray[np.uint8]
    zero_known: NDArray[np.bool_]
    #: Value of each taxel and its standard deviation: ``(n, rows, columns, components)``.
    value: NDArray[np.float32]
    deviation: NDArray[np.float32]
    #: Codes of :class:`taxel.State`: ``(n, rows, columns)``.
    state: NDArray[np.uint8]
    #: Contacts of each frame.
    contacts: tuple[tuple[Any, ...], ...]
    #: Frames that the service threw away since the last block, because this client was too slow.
    dropped: int

    def __len__(self) -> int:
        return len(self.time_ns)


class Live:
    """A connection to ``taxel live``. Made by :func:`taxel.connect`."""

    def __init__(self, address: str, timeout: float = 5.0) -> None:
        #: The client of single frames, with ``status``, ``events`` and ``health``.
        self.client: Any = TaxelLive(address, timeout)  # type: ignore[no-untyped-call]
        self._dropped = 0

    def __reduce__(self) -> tuple[Any, ...]:
        raise TypeError("a Live is a connection and is not pickled: send its address")

    @property
    def hello(self) -> dict[str, Any]:
        """What the numbers mean, as the live protocol describes it."""
        return self.client.hello  # type: ignore[no-any-return]

    def blocks(self, seconds: float) -> Iterator[Block]:
        """Blocks of the touches of ``seconds``, until the service ends.

        Raises:
            ValueError: not a time above zero.
        """
        if not (math.isfinite(seconds) and seconds > 0):
            raise ValueError(f"blocks of {seconds} s: give a time above zero")
        frames: list[Any] = []
        end = time.monotonic() + seconds
        while (frame := self.client.next_frame()) is not None:
            frames.append(frame)
            if time.monotonic() >= end:
                yield self._block(frames)
                frames, end = [], time.monotonic() + seconds
        if frames:
            yield self._block(frames)

    def tare(self, *, force: bool = False) -> None:
        """Takes the next frames as rest; refused while a contact is shown, except with ``force``."""
        self.client.tare(force)

    def clear_tare(self) -> None:
        """Returns to the rest values of the calibration."""
        self.client.clear_tare()

    def mark(self, text: str) -> None:
        """Notes ``text`` at the newest frame."""
        self.client.mark(text)

    def close(self) -> None:
        """Ends the connection."""
        self.client.close()

    def __enter__(self) -> Live:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _block(self, frames: list[Any]) -> Block:
        rows, columns = self.hello["rows"], self.hello["columns"]
        dropped = int((self.client.status or {}).get("dropped", 0))
        new, self._dropped = dropped - self._dropped, dropped

        def image(name: str) -> NDArray[Any]:
            images = np.array([getattr(frame, name) for frame in frames])
            return images.reshape(len(frames), rows, columns, *images.shape[2:])

        return Block(
            time_ns=np.array([frame.time_ns for frame in frames], np.int64),
            sequence=np.array([frame.sequence for frame in frames], np.uint64),
            total_force=np.array([frame.force for frame in frames]),
            total_deviation=np.array([frame.force_deviation for frame in frames]),
            moment=np.array([frame.moment for frame in frames]),
            total_certainty=np.array([frame.total_certainty for frame in frames], np.uint8),
            zero_known=np.array([frame.zero_known for frame in frames], np.bool_),
            value=image("values"),
            deviation=image("deviations"),
            state=image("states"),
            contacts=tuple(tuple(frame.contacts) for frame in frames),
            dropped=new,
        )


def connect(address: str, *, timeout: float = 5.0) -> Live:
    """Connects to ``taxel live``.

    Args:
        address: What ``taxel live`` prints: ``http://HOST:PORT/?token=TOKEN``.
        timeout: Time to wait for an answer, s.

    Raises:
        TaxelError: nobody answers, or what answers is not ``taxel live``.
    """
    return Live(address, timeout)
