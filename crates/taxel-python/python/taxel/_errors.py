"""Exceptions of the package; their text is that of the command."""

from __future__ import annotations

from typing import Any


class InputError(ValueError):
    """A mistake in a file, a key, a value or a load.

    ``str()`` is the text of the command: what was given, what is allowed, what to do.
    """

    #: Name of the file as it was given, or what stands for it.
    file: str
    #: Line from 1; None where the mistake has no line.
    line: int | None
    #: Path of the key or name of the column; may be empty.
    key: str

    def __init__(self, message: str, file: str = "", line: int | None = None, key: str = "") -> None:
        super().__init__(message)
        self.file, self.line, self.key = file, line, key

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.file, self.line, self.key)


class SolveError(RuntimeError):
    """A solver or a search stopped; ``str()`` says where and why."""


class FrameError(ValueError):
    """Frames that are not of the device: their number of channels, their quantity, their times."""
