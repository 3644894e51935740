"""Laws of rubber: from tests as arrays, from a library, from law files, from a hardness.

>>> import numpy as np
>>> from taxel import material
>>> material.load("rtv615").youngs_modulus
1035090.0
>>> stretch = np.linspace(1.05, 2.0, 20)
>>> fit = material.fit(stretch - 1, 100e3 * (stretch - stretch**-2))      # Pa
>>> round(fit.shear_modulus)
100000
"""

from __future__ import annotations

import builtins
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _taxel

__all__ = ["Fit", "Hardness", "Material", "Relaxation", "fit", "hardness", "list", "load", "relaxation"]


@dataclass(frozen=True)
class Material:
    """A law with where it comes from and how well it is known; Pa."""

    name: str
    #: The law as the command writes it.
    law: str
    shear_modulus: float
    #: Three times the shear modulus.
    youngs_modulus: float
    #: 95 % of the shear modulus, as ``source`` and ``basis`` say; None where they have none.
    interval: tuple[float, float] | None
    basis: str
    #: Stretches that were tested.
    stretch: tuple[float, float] | None
    modes: tuple[str, ...]
    source: str
    note: str
    #: Fraction of the sudden stress and time (s) of each term that relaxes.
    relaxation: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Hardness:
    """The modulus of elasticity of a Shore hardness, Pa; None out of the range of the relation."""

    youngs_modulus: float | None
    #: 95 % of the next material.
    interval: tuple[float, float] | None
    #: The printed formula alone.
    formula: float


@dataclass(frozen=True)
class Fit:
    """Laws of a test; all numbers are in ``answer``, as ``taxel material fit --format json`` has them."""

    #: The chosen law; None where none stands.
    law: str | None
    shear_modulus: float | None
    #: 95 % of the shear modulus over all laws that fit as well, Pa.
    interval: tuple[float, float] | None
    slack: float | None
    #: What was guessed and left out.
    notes: tuple[str, ...]
    answer: dict[str, Any]
    #: Text of the law file.
    toml: str | None

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the law file, which sensor and problem files name."""
        if self.toml is None:
            raise ValueError("no law stands for the test: there is nothing to write")
        Path(path).write_text(self.toml, encoding="utf-8")


@dataclass(frozen=True)
class Relaxation:
    """A Prony series of what was held."""

    #: Fraction of the sudden stress and time (s) of each term.
    terms: tuple[tuple[float, float], ...]
    #: What a sudden load gives; None where the ramp is not known.
    sudden: float | None
    long_time: float
    rms: float


def _pair(value: Any) -> tuple[float, float] | None:
    return None if value is None else (value[0], value[1])


def _terms(value: Any) -> tuple[tuple[float, float], ...]:
    return tuple((term["fraction"], term["time_s"]) for term in value)


def _array(values: ArrayLike) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.ascontiguousarray(values, dtype=np.float64).ravel()


def _material(found: dict[str, Any]) -> Material:
    return Material(
        name=found["name"],
        law=found["law"],
        shear_modulus=found["shear_modulus_pa"],
        youngs_modulus=found["youngs_modulus_pa"],
        interval=_pair(found["shear_modulus_interval_pa"]),
        basis=found["basis"],
        stretch=_pair(found["stretch"]),
        modes=tuple(found["modes"]),
        source=found["source"],
        note=found["note"],
        relaxation=_terms(found["relaxation"]),
    )


def load(name: str | os.PathLike[str]) -> Material:
    """A material of the library by its name, or of a law file."""
    return _material(json.loads(_taxel.material_load(os.fspath(name))))


def hardness(text: str) -> Hardness:
    """The modulus of a hardness such as ``"30 A"`` or ``"00-30"``."""
    found = json.loads(_taxel.material_hardness(text))
    return Hardness(found["youngs_modulus_pa"], _pair(found["interval_pa"]), found["formula_pa"])


def fit(
    strain: ArrayLike,
    stress: ArrayLike,
    mode: str = "uniaxial",
    *,
    law: str | None = None,
    slack: float | None = None,
    strain_range: tuple[float, float] | None = None,
    weight: str = "relative",
) -> Fit:
    """Fit laws to one loading test: engineering strain, and force per undeformed area in Pa.

    ``slack`` is the strain at which the specimen is taut; without it, it is fitted where it matters.
    """
    text, toml = _taxel.material_fit(_array(strain), _array(stress), mode, law, slack, strain_range, weight)
    answer = json.loads(text)
    chosen = None if answer["chosen"] is None else answer["candidates"][answer["chosen"]]
    return Fit(
        law=chosen and chosen["law"],
        shear_modulus=chosen and chosen["shear_modulus_pa"],
        interval=_pair(answer["interval_pa"]),
        slack=chosen and chosen["slack"],
        notes=tuple(answer["notes"]),
        answer=answer,
        toml=toml,
    )


def relaxation(time: ArrayLike, value: ArrayLike, ramp: float | None = None, *, creep: bool = False) -> Relaxation:
    """Fit a Prony series to stresses under a held stretch, or with ``creep`` to strains under a held load.

    ``time`` counts from the begin of the ramp, whose length is ``ramp``, in s.
    """
    found = json.loads(_taxel.material_relaxation(_array(time), _array(value), ramp, creep))
    return Relaxation(_terms(found["terms"]), found["sudden"], found["long_time"], found["rms"])


def list() -> builtins.list[Material]:
    """The library."""
    return [_material(found) for found in json.loads(_taxel.material_list())]
