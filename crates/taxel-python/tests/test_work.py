"""Threads, signals, fork, finite elements, the live client, the command."""

from __future__ import annotations

import copy
import doctest
import os
import pickle
import re
import shutil
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
from taxel import fem, material

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


def block(shape: str = "quad8") -> fem.Mesh:
    """Four by four cells of a square of one unit."""
    steps = 8 if shape == "quad8" else 4
    places = np.linspace(0, 1, steps + 1)
    points = np.array([[x, y] for y in places for x in places])
    row = steps + 1
    if shape == "quad":
        cells = [[c + row * r, c + row * r + 1, c + row * r + row + 1, c + row * r + row] for r in range(4) for c in range(4)]
    else:
        at = lambda c, r: c + row * r  # noqa: E731
        cells = [
            [at(c, r), at(c + 2, r), at(c + 2, r + 2), at(c, r + 2), at(c + 1, r), at(c + 2, r + 1), at(c + 1, r + 2), at(c, r + 1)]
            for r in range(0, 8, 2) for c in range(0, 8, 2)
        ]  # fmt: skip
    sides = {"bottom": points[:, 1] == 0, "top": points[:, 1] == 1, "left": points[:, 0] == 0, "right": points[:, 0] == 1}
    return fem.Mesh(points, [(shape, np.array(cells))], surfaces=sides)


@pytest.mark.parametrize("shape", ["quad", "quad8"])
def test_a_body_of_any_mesh_is_stretched_as_its_law_says(shape: str) -> None:
    mesh = block(shape)
    body = fem.Problem(mesh, fem.MooneyRivlin(c10=75.5, c01=5.7))
    body.support("bottom", "y").support("left", "x").drive("top", "y", "travel")
    body.solve(travel=0.2)
    # Plane strain, incompressible: stretches 1.2, 1/1.2, 1; stress 2 (c10 + c01) (l^2 - 1/l^2).
    expected = 2 * (75.5 + 5.7) * (1.2**2 - 1 / 1.2**2)
    points = mesh.complete.points
    moved = body.displacement
    assert moved.shape == points.shape and np.array_equal(points[: len(mesh.points)], mesh.points)
    # The middles of the given points are in no cell: the elements have their own.
    used = np.unique(mesh.complete.cells[0][1])
    assert np.allclose(moved[used, 1], 0.2 * points[used, 1], atol=1e-9)
    assert np.allclose(moved[used, 0], (1 / 1.2 - 1) * points[used, 0], atol=1e-7)
    stress = body.stress
    assert stress.shape == (len(points), 6) and np.allclose(stress[used, 1], expected, rtol=1e-5)
    assert np.allclose(stress[used, 0], 0, atol=1e-4 * expected)
    # Force over the deformed width, per depth.
    assert body.reaction("top")[1] == pytest.approx(expected / 1.2, rel=1e-5)
    assert body.parameters == {"travel": 0.2} and "<svg" in body._repr_svg_()
    again = pickle.loads(pickle.dumps(body))
    assert again == body == copy.deepcopy(body) and np.array_equal(again.displacement, moved)
    body.solve(travel=0.0)
    assert again != body and np.abs(body.displacement).max() < 1e-9


def test_pressure_and_elastic_parts_in_space() -> None:
    places = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    cell = [[0, 1, 3, 2, 4, 5, 7, 6]]
    sides = {name: places[:, axis] == end for name, axis, end in (("x", 0, 0), ("y", 1, 0), ("bottom", 2, 0), ("top", 2, 1))}
    body = fem.Problem(fem.Mesh(places, [("hexahedron", cell)], surfaces=sides), fem.LinearElastic(1e3, 0.3))
    body.support("x", "x").support("y", "y").support("bottom", "z").pressure("top", "p").solve(p=1.0)
    # Small strain: p/E along z and -nu p/E across, to the order of the strain.
    assert body.displacement[:8, 2].min() == pytest.approx(-1e-3, rel=3e-3)
    assert body.displacement[:8, 0].max() == pytest.approx(0.3e-3, rel=1e-2)
    assert body.von_mises == pytest.approx(np.ones(len(body.von_mises)), rel=3e-3)
    assert body.reaction("bottom")[2] == pytest.approx(1.0, rel=1e-3)


def test_fields_between_conductors_follow_a_body() -> None:
    mesh = block()
    field = fem.Laplace(mesh, {"solid": 2.4})
    found = field.capacitance(["top"], zero=["bottom"])
    assert found.matrix[0, 0] == pytest.approx(2.4 * 8.8541878188e-12, rel=1e-9) and found.by_flux == pytest.approx(found.matrix)
    used = np.unique(mesh.complete.cells[0][1])
    assert np.allclose(found.potentials[0][used], mesh.complete.points[used, 1], atol=1e-9)
    body = fem.Problem(mesh, fem.MooneyRivlin(1.0))
    body.support("bottom", "y").support("left", "x").drive("top", "y", "travel")
    body.solve(travel=-0.2)
    moved = fem.Laplace(mesh, {"solid": 2.4}, displacement=body.displacement)
    # Wider by 1/0.8 and thinner by 0.8.
    assert moved.capacitance(["top"], zero=["bottom"]).matrix[0, 0] == pytest.approx(found.matrix[0, 0] / 0.64, rel=1e-6)
    across = fem.Laplace(mesh, {"solid": 5.0}).resistance("left", "right")
    assert across.value == pytest.approx(1 / 5.0, rel=1e-9) and across.by_flux == pytest.approx(across.value)
    for value in (field, moved, found, across, mesh):
        assert pickle.loads(pickle.dumps(value)) == value == copy.deepcopy(value)
    assert field != moved


def _posed(mesh: fem.Mesh, *supports: tuple[str, str], solids: object = fem.MooneyRivlin(1.0), **more: str) -> fem.Problem:
    body = fem.Problem(mesh, solids, **more)  # type: ignore[arg-type]
    for surface, component in supports:
        body.support(surface, component)
    return body


@pytest.mark.parametrize(
    ("make", "error", "said"),
    [
        (lambda: fem.Mesh([[0.0]], []), ValueError, "(n, 2) or (n, 3)"),
        (lambda: fem.Mesh([[0.0, 0.0]], [("quad", [[0, 1, 2, 3]])]).complete, ValueError, "there is no point 1"),
        (lambda: fem.Mesh(np.eye(3), [("pyramid", [[0, 1, 2]])]).complete, ValueError, 'no shape is called "pyramid"'),
        (lambda: fem.Mesh(np.eye(3), [("quad", [[0, 1, 2]])]).complete, ValueError, "its shape takes"),
        (lambda: fem.Mesh(np.eye(3), [("triangle", [[0.0, 1.0, 2.0]])]), ValueError, "whole numbers"),
        (lambda: fem.Mesh([[np.nan, 0.0]], []).complete, ValueError, "no coordinate"),
        (lambda: fem.Mesh(np.eye(3), [], surfaces={"a": [True]}), ValueError, "a mask has the shape (3,)"),
        (lambda: _posed(block(), ("side", "x")).solve(), ValueError, 'no surface named "side"'),
        (lambda: _posed(block(), ("top", "u")), ValueError, "'u' is not one of x, y, z"),
        (lambda: _posed(block(), ("top", "x")).solve(), ValueError, "nothing holds the body"),
        (lambda: _posed(block(), solids={"soft": fem.Yeoh(1.0, 0.0, 0.0)}), ValueError, "the regions are solid"),
        (lambda: _posed(block(), ("top", "x"), kinematics="plane").solve(), ValueError, "plane_strain, axisymmetric, solid"),
        (lambda: _posed(block(), ("top", "x"), ("top", "y")).solve(travel=1.0), ValueError, "no parameter is called travel"),
        (lambda: fem.Laplace(block(), {"solid": 1.0}).capacitance(["north"]), taxel.SolveError, "north"),
        (lambda: fem.Laplace(block(), {"air": 1.0}).capacitance(["top"], zero=["bottom"]), taxel.SolveError, "air"),
        (lambda: fem.Laplace(block(), {"solid": 1.0}, displacement=np.zeros((2, 3))).resistance("top", "left"), ValueError, "shape"),
    ],
)
def test_meshes_and_bodies_that_cannot_be_are_refused(make: object, error: type, said: str) -> None:
    with pytest.raises(error) as caught:
        make()  # type: ignore[operator]
    assert said in str(caught.value), caught.value


STRETCH = np.linspace(1.05, 2.0, 20)
TIME = np.geomspace(0.01, 20.0, 60)
PULLED = material.fit(STRETCH - 1, 100e3 * (STRETCH - STRETCH**-2))


def test_materials_are_those_of_the_command(tmp_path: Path) -> None:
    assert len(material.list()) == 20
    assert PULLED.shear_modulus == pytest.approx(100e3, rel=1e-9)  # linear least squares of exact data
    PULLED.write(tmp_path / "law.toml")
    again = material.load(tmp_path / "law.toml")
    assert (again.shear_modulus, again.modes) == (PULLED.shear_modulus, ("uniaxial",))
    held = material.relaxation(TIME, 2.0 + np.exp(-TIME), 0.0)
    # The search ends at the root of the rounding.
    assert held.terms[0] == pytest.approx((1 / 3, 1.0), rel=1e-5)
    with pytest.raises(taxel.InputError, match="near names: rtv615"):
        material.load("rtv 61")
    with pytest.raises(ValueError, match="ogden3"):
        material.fit([0.1], [1.0], law="hooke")


def test_every_public_class_pickles_or_says_why_not() -> None:
    sensor = taxel.Sensor("in-plane-50um")
    twin = sensor.twin(seed=1)
    frames = twin.frames(20)
    estimator = sensor.estimator()
    touch = estimator.push(frames)
    study = taxel.Study("p1-resolution")
    design = study.ask([50e-6, 500e-6])
    table = taxel.Study("p2-tolerance").tolerance(seed=1, samples=16)
    data = ROOT / "crates/taxel-calibrate/data/in-plane-synthetic.csv"
    calibration = taxel.calibrate(sensor, data, beside=["in-plane-20um", "in-plane-100um"])
    mesh = block()
    values = [
        sensor, twin, frames, estimator, touch, study, design, table, calibration, mesh, table.table,
        sensor.information(fz="5 N"), next(iter(calibration.parameters.values())), taxel.State.OK,
        taxel.Certainty.EXACT,
        taxel.InputError("m", "f", 3, "k"), taxel.SolveError("m"), taxel.FrameError("m"), taxel.TaxelError("m"),
        fem.MooneyRivlin(1.0), fem.Yeoh(1.0, 0.0, 0.0), fem.Gent(1.0, 50.0), fem.LinearElastic(1.0, 0.3), CELL, fem.Laplace(mesh, {"solid": 1.0}),
        fem.Laplace(mesh, {"solid": 1.0}).capacitance(["top"], zero=["bottom"]),
        fem.Laplace(mesh, {"solid": 1.0}).resistance("top", "bottom"), fem.VoidStudy(CELL, SOLID), _posed(mesh),
        fem.Closure(*range(6)), taxel.TrainedMap("eflesh-lattice"),
        material.load("rtv615"), material.hardness("30 A"), PULLED, material.relaxation(TIME, 2.0 + np.exp(-TIME), 0.0),
    ]  # fmt: skip
    tried = {type(value) for value in values}
    for value in values:
        again = pickle.loads(pickle.dumps(value))
        if isinstance(value, Exception):
            assert (str(again), type(again), again.__dict__) == (str(value), type(value), value.__dict__)
        else:
            assert again == value, value
    # Elsewhere: a result of a study, a recording, a block of the live service.
    elsewhere = {taxel.Result, taxel.Recording, taxel.Block}
    classes = {getattr(module, name) for module in (taxel, fem, material) for name in module.__all__}
    classes = {one for one in classes if isinstance(one, type)}
    assert classes - tried - elsewhere == {taxel.Live}
    with pytest.raises(TypeError, match="connection"):
        pickle.dumps(taxel.Live.__new__(taxel.Live))


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


@pytest.mark.parametrize("work", ["fem", "sweep", "void", "body"])
@pytest.mark.long
def test_ctrl_c_ends_long_work_within_a_second(work: str) -> None:
    script = {
        "fem": "sensor.predict(fz='250 N', mechanics='fem')",
        "sweep": "[study.run() for _ in range(10**6)]",
        "body": "[body.solve(travel=-0.3 * (step % 2)) for step in range(10**6)]",
        "void": "[fem.VoidStudy(cell, fem.MooneyRivlin(75.5, 5.7)).close(0.05) for _ in range(10**6)]",
    }[work]
    program = f"""
import signal, taxel, time, sys
from taxel import fem, material
# A shell that starts its jobs in the background leaves it ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
sensor = taxel.Sensor("in-plane-50um")
study = taxel.Study("p1-resolution")
cell = fem.VoidCell(400, 20, 140, 340, 600)
places = [[x / 20, y / 20] for y in range(21) for x in range(21)]
cells = [[21 * r + c, 21 * r + c + 1, 21 * r + c + 22, 21 * r + c + 21] for r in range(20) for c in range(20)]
sides = {{"bottom": [point[1] == 0 for point in places], "top": [point[1] == 1 for point in places]}}
body = fem.Problem(fem.Mesh(places, [("quad", cells)], surfaces=sides), fem.MooneyRivlin(75.5, 5.7))
body.clamp("bottom").drive("top", "y", "travel")
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


def test_the_module_runs_the_program_of_the_path(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert "taxel" in command("--version").stdout
    assert "no such" in command("check", "no such", code=2).stderr
    assert taxel.__version__ in command("--version").stdout
    monkeypatch.setenv("PATH", str(tmp_path))
    assert "cargo install --path crates/taxel-cli" in command("--version", code=1).stderr


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
    shutil.copytree(ROOT / "crates/taxel-calibrate/tests/data", tmp_path / "crates/taxel-calibrate/tests/data")
    monkeypatch.chdir(tmp_path)
    scope: dict[str, object] = {"__name__": "guide"}
    for number, block in enumerate(blocks):
        exec(compile(block, f"python.md, block {number + 1}", "exec"), scope)
