"""What the tests of the package share."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[3]


def command(*arguments: str, code: int = 0, folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    """The program of the PATH: `.ci/python` builds the one of this checkout."""
    done = subprocess.run(
        [sys.executable, "-m", "taxel", *arguments], capture_output=True, text=True, cwd=folder, check=False
    )
    assert done.returncode == code, done.stderr
    return done


def answered(*arguments: str) -> dict[str, Any]:
    """The JSON that the command prints."""
    return json.loads(command(*arguments, "--format", "json").stdout)  # type: ignore[no-any-return]


@pytest.fixture(autouse=True)
def _kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MPLBACKEND", "Agg")
    os.environ.setdefault("TAXEL_CACHE", "")
