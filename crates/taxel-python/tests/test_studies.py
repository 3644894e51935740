"""Design studies, calibration, papers."""

from __future__ import annotations

import copy
import os
import pickle
import signal
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import taxel
from conftest import ROOT, command

SMALL = {
    # Closed forms: electrodes of another modulus are solved for each design.
    "set": {"element.in_plane_capacitor.electrodes.stiffness": "as_layer"},
    "variables": {
        "gap": {"key": "element.in_plane_capacitor.electrodes.gap", "range": ["40 um", "100 um"], "points": 5},
        "thickness": {"key": "element.in_plane_capacitor.layer.thickness", "range": ["300 um", "870 um"], "points": 4},
    },
    "links": {
        "element.in_plane_capacitor.electrodes.height": "thickness - 200 um",
        "element.in_plane_capacitor.fabrication.gap_deviation": "0.02 * gap",
    },
    "answers": {
        "resolution": {"of": "estimate", "quantity": "deviation", "load": "fz=5 N", "noise": "0.1 fF"},
        "rest": {"of": "check", "quantity": "rest_capacitance"},
    },
    "objectives": {"minimise": ["resolution"]},
    "optimize": {"evaluations": 240, "population": 20, "seed": 1},
}


def small() -> taxel.Study:
    return taxel.Study(taxel.Sensor("in-plane-50um"), **SMALL)  # type: ignore[arg-type]


@pytest.mark.long
def test_a_study_of_python_is_that_of_the_command(tmp_path: Path) -> None:
    study = small()
    result = study.run()
    assert result.table.rows == 20 and result.computed == 20
    assert set(result.table["status"]) == {"done"}
    (tmp_path / "study.toml").write_text(study.text)
    printed = command("sweep", str(tmp_path / "study.toml"), "--format", "csv").stdout
    head, *lines = [line.split(",") for line in printed.splitlines() if not line.startswith("#")]
    assert [title.split(" ")[0] for title in head] == list(result.table)
    shown = np.array([float(line[2]) for line in lines])
    scale = dict(zip(result.table, (scale for _, _, _, scale in result.table._table.columns())))["resolution"]
    assert np.allclose(shown * scale, result.table["resolution"], rtol=1e-5)
    assert result.to_pandas().shape == (20, len(head))


def test_a_sweep_has_the_columns_that_the_study_names() -> None:
    columns = {**SMALL, "answers": {"rest": SMALL["answers"]["rest"]}, "objectives": {"minimise": ["rest"]}}
    study = taxel.Study(taxel.Sensor("in-plane-50um"), **columns, sweep={"columns": ["rest", "gap", "status"]})  # type: ignore[arg-type]
    result = study.run()
    assert list(result.table) == ["rest", "gap", "status"] and result.table.rows == 20
    whole = taxel.Study(taxel.Sensor("in-plane-50um"), **columns).run()  # type: ignore[arg-type]
    assert list(whole.table) == ["gap", "thickness", "rest", "status", "reason"]
    assert all(np.array_equal(result.table[name], whole.table[name]) for name in result.table)


@pytest.mark.parametrize("name", taxel.shipped("study"))
def test_a_study_pickles_copies_compares_and_shows_itself(name: str) -> None:
    study = taxel.Study(name)
    assert pickle.loads(pickle.dumps(study)) == study == copy.deepcopy(study)
    assert study.variables.keys() >= set() and name in repr(study) or study.name
    assert "<table>" in study._repr_html_()


@pytest.mark.long
def test_the_optimum_is_the_same_again_from_a_store_and_saved(tmp_path: Path) -> None:
    study = small()
    result = study.optimize(store=tmp_path / "store")
    again = study.optimize(store=tmp_path / "store")
    assert result.evaluations == again.evaluations and result.computed > 0 and again.computed == 0
    assert result == again == pickle.loads(pickle.dumps(result)) and result == study.optimize()
    assert result != study.optimize(seed=2)
    best = result.best
    # The smallest gap always wins: it is at its bound.
    assert best.values["gap"] == pytest.approx(40e-6, rel=1e-6)
    assert any("gap" in one for one in result.active)
    assert result.pareto().rows == 1 and len(result.pareto().to_pandas()) == 1
    best.sensor.save(tmp_path / "best.toml")
    found = taxel.Sensor(tmp_path / "best.toml").information(fz="5 N", noise="0.1 fF").deviation
    assert found == pytest.approx(best.answers["resolution"], rel=1e-12)
    with pytest.raises(ValueError, match="a sweep compares nothing"):
        _ = study.run().best


@pytest.mark.long
def test_other_optimisers_ask_and_tell(tmp_path: Path) -> None:
    study = small()
    for gap in (50e-6, 80e-6):
        design = study.ask({"gap": gap, "thickness": 500e-6})
        assert design.status == "done" and design.sensor.information(fz="5 N").deviation > 0
        study.tell(design, store=tmp_path / "store")
        assert pickle.loads(pickle.dumps(design)) == design
    assert study.ask([50e-6, 500e-6], store=tmp_path / "store").answers == study.ask([50e-6, 500e-6]).answers
    with pytest.raises(ValueError, match="a point has the variables gap, thickness"):
        study.ask({"gap": 50e-6})
    with pytest.raises(ValueError, match="3 columns; the study varies 2"):
        study.ask([1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="finite numbers"):
        study.ask([np.nan, 1.0])


_worked = taxel._study._worked


def _dies(study: taxel.Study, points: list[Any], store: str) -> list[Any]:
    done = _worked(study, points, store)
    if sum(1 for _ in Path(store).rglob("*.json")) > 4:
        os.kill(os.getpid(), signal.SIGKILL)
    return done


@pytest.mark.long
def test_executors_give_the_same_designs_and_lose_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = small()
    alone = study.run()
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        assert study.run(executor=pool).table == alone.table
        assert study.run(executor=pool, store=tmp_path / "one").table == alone.table
    # A worker dies: what the others and it have finished stays.
    store = tmp_path / "two"
    monkeypatch.setattr("taxel._study._worked", _dies)
    with pytest.raises(BrokenProcessPool), ProcessPoolExecutor(2, mp_context=get_context("fork")) as pool:
        study.run(executor=pool, store=store)
    monkeypatch.undo()
    kept = study.run(store=store)
    assert kept.table == alone.table and 0 < 20 - kept.computed


def test_a_wrong_study_has_the_text_of_the_command(tmp_path: Path) -> None:
    text = small().text.replace("thickness - 200 um", "thickness - 200 kPa")
    file = tmp_path / "bad.toml"
    file.write_text(text)
    with pytest.raises(taxel.InputError) as caught:
        taxel.Study(file)
    assert command("sweep", str(file), code=2).stderr.rstrip("\n") == f"error: {caught.value}"
    assert caught.value.line is not None
    lacking = {key: value for key, value in SMALL.items() if key != "objectives"}
    with pytest.raises(taxel.InputError, match="no objective is given"):
        taxel.Study(taxel.Sensor("in-plane-50um"), **lacking).optimize()  # type: ignore[arg-type]


def test_tolerances_are_those_of_the_command() -> None:
    found = taxel.Study("p2-tolerance").tolerance(seed=1, samples=1024)
    # design_p2_tolerance: 0.5436, within four standard errors of 1024 devices.
    assert found.value("all limits", "yield") == pytest.approx(0.5436, abs=4 * (0.25 / 1024) ** 0.5)
    assert found.failed == 0 and found.tighten_first == "air_gap"
    assert pickle.loads(pickle.dumps(found)) == found
    with pytest.raises(KeyError):
        found.value("all limits", "yeld")
    with pytest.raises(taxel.InputError, match="as_drawn, rest, bench"):
        taxel.Study("p2-tolerance").tolerance(after="never")


def test_a_calibration_finds_the_constants_of_the_twin(tmp_path: Path) -> None:
    sensor = taxel.Sensor("in-plane-50um")
    data = ROOT / "crates/taxel-calibrate/data/in-plane-synthetic.csv"
    calibration = taxel.calibrate(sensor, data, beside=["in-plane-20um", "in-plane-100um"])
    for name, one in calibration.parameters.items():
        assert one.interval[0] <= one.value <= one.interval[1], name
        assert one.verdict
    calibration.save(tmp_path / "calibration.toml")
    calibration.report(tmp_path / "fit.html")
    assert "<svg" in (tmp_path / "fit.html").read_text()
    read = taxel.Calibration(tmp_path / "calibration.toml")
    assert read.parameters == calibration.parameters and read.text == calibration.text
    assert pickle.loads(pickle.dumps(calibration)) == calibration == copy.deepcopy(calibration)
    assert pickle.loads(pickle.dumps(calibration)).details == calibration.details
    with pytest.raises(ValueError, match="needs the data"):
        read.report(tmp_path / "again.html")
    assert "<table>" in calibration._repr_html_()
    frames = sensor.twin(seed=4).frames(60)
    drawn = sensor.estimator().push(frames)
    made = sensor.estimator(calibration=calibration).push(frames)
    assert not np.array_equal(drawn.value, made.value, equal_nan=True)
    # What the constants leave is part of the answers, as on the command line.
    calibrated = sensor.predict(fz="5 N", calibration=calibration)
    assert set(calibrated) > set(sensor.predict(fz="5 N"))


def test_mistakes_of_calibration_data_are_at_their_place(tmp_path: Path) -> None:
    text = taxel.calibration_data("in-plane-50um", readings=20)
    assert text == taxel.calibration_data("in-plane-50um", readings=20) != taxel.calibration_data("in-plane-50um", seed=2, readings=20)
    file = tmp_path / "bad.csv"
    file.write_text(text.replace("force_z [N]", "force_z [mm]"))
    with pytest.raises(taxel.InputError) as caught:
        taxel.calibrate("in-plane-50um", file)
    assert caught.value.file == str(file) and caught.value.line == 3
    told = command("calibrate", "in-plane-50um", str(file), code=2).stderr
    assert told.rstrip("\n") == f"error: {caught.value}"


def test_recordings_without_a_header_say_their_unit() -> None:
    folder = ROOT / "crates/taxel-recording/tests/recordings/lattice"
    data = [folder / "force_sensor.csv", folder / "force_states.csv"]
    grams = taxel.calibrate("eflesh-lattice", data, scale_unit="g")
    assert grams.text == taxel.calibrate("eflesh-lattice", data).text
    # As newtons they are 94 times the full scale.
    with pytest.raises(taxel.InputError, match="of a full scale of 35 N"):
        taxel.calibrate("eflesh-lattice", data, scale_unit="N")
    with pytest.raises(taxel.InputError, match="scale_unit: \"kg\" is none of g, N"):
        taxel.calibrate("eflesh-lattice", data, scale_unit="kg")
    with pytest.raises(taxel.InputError, match="rate: 0 is no rate"):
        taxel.calibrate("eflesh-lattice", data, rate=0.0)


def test_papers_are_records() -> None:
    records = taxel.reproduce("P1")
    assert {record["paper"] for record in records} == {"P1"}
    assert all(record["verdict"] for record in records)
    with pytest.raises(taxel.InputError, match="P1, P2, P3, P4"):
        taxel.reproduce("P5")
