"""From the drawing of a soft tactile sensor to live touch.

>>> import numpy as np, taxel
>>> sensor = taxel.Sensor("in-plane-50um")                     # a file or a shipped name
>>> answers = sensor.predict(fz=np.linspace(0, 10, 101))       # N; also "10 N"
>>> answers["capacitance"].shape, answers.units["capacitance"]
((101,), 'F')

Values are ``float64`` in SI; a text with its unit stands wherever a number is taken. Names are
those of the command. The guide is docs/book/python.md.
"""

from __future__ import annotations

import json
from typing import Any

from . import _taxel, fem, material
from ._answers import Answers
from ._calibration import Calibration, Parameter, calibrate, calibration_data
from ._errors import FrameError, InputError, SolveError
from ._live import Block, Live, TaxelError, connect
from ._sensor import Information, Sensor
from ._study import Design, Result, Study, Tolerance
from ._touch import CONTACT, EVENT, Certainty, Estimator, Frames, Recording, State, Touch, Twin, read
from ._trained import TrainedMap

#: Version of the package and of the command.
__version__: str = _taxel.VERSION

__all__ = [
    "CONTACT",
    "EVENT",
    "Answers",
    "Block",
    "Calibration",
    "Certainty",
    "Design",
    "Estimator",
    "FrameError",
    "Frames",
    "Information",
    "InputError",
    "Live",
    "Parameter",
    "Recording",
    "Result",
    "Sensor",
    "SolveError",
    "State",
    "Study",
    "TaxelError",
    "Tolerance",
    "Touch",
    "TrainedMap",
    "Twin",
    "calibrate",
    "calibration_data",
    "connect",
    "fem",
    "material",
    "read",
    "reproduce",
    "shipped",
    "threads",
]


def shipped(kind: str = "sensor") -> list[str]:
    """Names of what is shipped: ``"sensor"``, ``"stimulus"`` or ``"study"``.

    >>> "in-plane-50um" in shipped()
    True
    """
    return _taxel.shipped(kind)


def threads(number: int | None = None) -> int:
    """Number of threads that work uses; sets it where one is given, 0 for one for each core."""
    return _taxel.threads(number)


def reproduce(*papers: str) -> list[dict[str, Any]]:
    """The printed numbers of papers beside the computed ones, one record each.

    Args:
        *papers: ``"P1"`` to ``"P4"``; none for all.

    Raises:
        InputError: a paper that is not one of them.
    """
    found = json.loads(_taxel.reproduce(list(papers)))
    ledgers = [(name, found[name.lower()]) for name in ("P1", "P2", "P3", "P4") if name.lower() in found]
    return [{"paper": name, **entry} for name, ledger in ledgers for entry in ledger["entries"]]
