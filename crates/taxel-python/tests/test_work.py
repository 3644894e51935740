"""Threads, signals, fork, finite elements, the live client, the command."""

from __future__ import annotations

import copy
import doctest
import os
import pickle
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import taxel
from conftest import ROOT, command
from taxel import fem

CELL = fem.VoidCell(width=400, height=20, cover=140, base=340, pitch=600)
SOLID = fem.MooneyRivlin(c10=75.5, c01=5.7)


def test_a_void_closes_as_in_si() -> None:
    study = fem.VoidStudy(CELL, SOLID)
    found = study.press(6.0)
    assert 0 < found.area_ratio < 1
    metres = fem.VoidCell(width=400e-6, height=20e-6, cover=140e-6, base=340e-6, pitch=600e-6)
    same = fem.VoidStudy(metres, fem.MooneyRivlin(c10=75.5e3, c01=5.7e3)).press(6e3)
    # Round-off of another scale, and the tolerance of the balance.
    assert same.area_ratio == pytest.approx(found.area_ratio, rel=1e-5)
    mesh = study.mesh
    assert [shape for shape, _ in mesh.cells] == ["quad9"] and mesh.cells[0][1].shape[1] == 9
    assert study.displacement.shape == mesh.points.shape and mesh.points[:, 0].max() == pytest.approx(300)
    # The top goes down, the bottom is bonded.
    top = mesh.points[:, 1] == mesh.points[:, 1].max()
    assert (study.displacement[top, 1] < 0).all()
    assert (study.displacement[mesh.points[:, 1] == 0] == 0).all()
    mesh.plot(study.displacement)
    assert "<svg" in mesh._repr_svg_() and "<svg" in study._repr_svg_()
    again = pickle.loads(pickle.dumps(study))
    assert again == study == copy.deepcopy(study) and np.array_equal(again.displacement, study.displacement)
    assert pickle.loads(pickle.dumps(mesh)) == mesh
    assert study.close(0.5).area_ratio == pytest.approx(0.5, rel=1e-6)


@pytest.mark.parametrize(
    ("cell", "solid", "error", "said"),
    [
        (fem.VoidCell(400, 20, 140, 340, 300), SOLID, taxel.SolveError, "a void of width 400 does not fit in a pitch of 300"),
        (fem.VoidCell(400, float("nan"), 140, 340, 600), SOLID, taxel.SolveError, "height of the void is NaN, allowed is a number above 0."),
        (CELL, fem.MooneyRivlin(-1.0), ValueError, "c10 + c01 [Pa] = -1.0 must be greater than 0"),
        (CELL, fem.MooneyRivlin(float("inf")), ValueError, "c10 [Pa] = inf must be a finite number"),
    ],
)
def test_what_makes_no_cell_is_refused(cell: fem.VoidCell, solid: fem.MooneyRivlin, error: type, said: str) -> None:
    with pytest.raises(error) as caught:
        fem.VoidStudy(cell, solid)
    assert said in str(caught.value)


def test_another_thread_runs_meanwhile() -> None:
    counted = [0]
    done = threading.Event()

    def count() -> None:
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    start = time.monotonic()
    fem.VoidStudy(CELL, SOLID).close(0.3)
    seconds = time.monotonic() - start
    done.set()
    thread.join()
    # A held interpreter would leave a tick or two at the ends.
    assert counted[0] > 5 + 20 * seconds, (counted, seconds)


@pytest.mark.parametrize("work", ["fem", "sweep", "void"])
@pytest.mark.long
def test_ctrl_c_ends_long_work_within_a_second(work: str) -> None:
    script = {
        "fem": "sensor.predict(fz='250 N', mechanics='fem')",
        "sweep": "[study.run() for _ in range(10**6)]",
        "void": "[fem.VoidStudy(cell, fem.MooneyRivlin(75.5, 5.7)).close(0.05) for _ in range(10**6)]",
    }[work]
    program = f"""
import taxel, time, sys
from taxel import fem
sensor = taxel.Sensor("in-plane-50um")
study = taxel.Study("p1-resolution")
cell = fem.VoidCell(400, 20, 140, 340, 600)
print("ready", flush=True)
try:
    [{script} for _ in range(100)]
except KeyboardInterrupt:
    print("interrupted", flush=True)
    assert sensor.predict(fz="1 N").rows == 1
    print("usable", flush=True)
"""
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None and child.stdout.readline() == "ready\n"
        time.sleep(0.5)
        start = time.monotonic()
        child.send_signal(signal.SIGINT)
        assert child.stdout.readline() == "interrupted\n"
        seconds = time.monotonic() - start
        assert child.stdout.readline() == "usable\n"
        assert child.wait(20) == 0
    # One second on a machine of its own; tests share theirs.
    assert seconds < 3, seconds


def test_work_goes_on_after_fork() -> None:
    sensor = taxel.Sensor("three-axis-8x8")
    loads = np.linspace(0, 0.01, 20_000)
    here = sensor.predict(fz=loads)["capacitance_11"]
    child = os.fork()
    if child == 0:
        code = 1
        try:
            there = sensor.predict(fz=loads)["capacitance_11"]
            code = 0 if np.array_equal(here, there) else 2
        finally:
            os._exit(code)
    end = time.monotonic() + 60
    while time.monotonic() < end:
        found, status = os.waitpid(child, os.WNOHANG)
        if found:
            assert os.waitstatus_to_exitcode(status) == 0
            return
        time.sleep(0.01)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    pytest.fail("the child hangs")


def test_threads_change_no_answer() -> None:
    sensor = taxel.Sensor("three-axis-8x8")
    loads = np.linspace(0, 0.01, 10_000)
    try:
        found = [sensor.predict(fz=loads) for number in (1, 3) if taxel.threads(number) == number]
    finally:
        taxel.threads(0)
    assert len(found) == 2 and found[0] == found[1]
    with pytest.raises(ValueError, match="from 0 to 1024"):
        taxel.threads(-1)


def test_the_live_client_gives_blocks() -> None:
    service = subprocess.Popen(
        [sys.executable, "-m", "taxel", "live", "three-axis-8x8", "--port", "0", "--no-tare"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        assert service.stdout is not None
        address = re.search(r"http://\S+", service.stdout.readline())
        assert address is not None
        with taxel.connect(address.group()) as live:
            for number, block in enumerate(live.blocks(0.1)):
                assert len(block) > 0 and block.dropped == 0
                assert block.value.shape == (len(block), 8, 8, 3) and block.state.shape == (len(block), 8, 8)
                assert block.total_force[-1].shape == (3,)
                if number == 2:
                    break
            with pytest.raises(ValueError, match="above zero"):
                next(live.blocks(0))
    finally:
        service.kill()
        service.wait()
        assert service.stdout is not None
        service.stdout.close()
    with pytest.raises(taxel.TaxelError, match="is not an address"):
        taxel.connect("http://localhost")


def test_the_command_comes_with_the_package() -> None:
    assert "taxel" in command("--version").stdout
    assert "no such" in command("check", "no such", code=2).stderr
    assert taxel.__version__ in command("--version").stdout


def test_the_examples_of_the_docstrings_run() -> None:
    import importlib

    tried = 0
    for name in ("taxel", "taxel.fem", "taxel._answers", "taxel._sensor", "taxel._study"):
        module = importlib.import_module(name)
        result = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE)
        assert result.failed == 0, name
        tried += result.attempted
    assert tried > 10


def test_help_of_each_public_name_says_something() -> None:
    for module in (taxel, fem):
        for name in module.__all__:
            public = getattr(module, name)
            if callable(public) or hasattr(public, "__doc__"):
                assert (public.__doc__ or "").strip(), name


@pytest.mark.long
def test_the_guide_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    guide = (ROOT / "docs/book/python.md").read_text()
    blocks = re.findall(r"^```python\n(.*?)^```", guide, re.MULTILINE | re.DOTALL)
    assert len(blocks) >= 6
    data = tmp_path / "crates/taxel-calibrate/data"
    data.mkdir(parents=True)
    source = ROOT / "crates/taxel-calibrate/data/in-plane-synthetic.csv"
    (data / source.name).write_bytes(source.read_bytes())
    monkeypatch.chdir(tmp_path)
    scope: dict[str, object] = {"__name__": "guide"}
    for number, block in enumerate(blocks):
        exec(compile(block, f"python.md, block {number + 1}", "exec"), scope)
