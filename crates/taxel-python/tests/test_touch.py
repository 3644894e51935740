"""Twins, frames, estimators, recordings."""

from __future__ import annotations

import copy
import pickle
import re
from pathlib import Path

import numpy as np
import pytest
import taxel
from conftest import ROOT, command

TWINS = ["three-axis-8x8", "in-plane-50um", "piezo-1.5mm", "liquid-metal-2x4", "force-4x4"]
# A thousand frames a second take their time in the build of the tests.
FRAMES_OF = [
    pytest.param(name, marks=pytest.mark.long) if name.startswith("piezo") else name for name in TWINS
]


def test_the_examples_of_the_overview_run() -> None:
    twin = taxel.Sensor("three-axis-8x8").twin("finger", seed=1)
    frames = twin.frames(240)
    assert frames.time_ns.shape == (240,) and frames.time_ns.dtype == np.int64
    assert frames.sequence.shape == (240,) and frames.values.shape == (240, 256)
    estimator = twin.sensor.estimator()
    assert not estimator.zero_known
    estimator.tare(50)
    touch = estimator.push(frames)
    assert estimator.tared and estimator.zero_known
    assert not touch.zero_known[:50].any() and touch.zero_known[50:].all()
    assert (touch.total_certainty[50:] == taxel.Certainty.EXACT).all()
    assert touch.force.shape == touch.deviation.shape == (240, 8, 8, 3)
    assert touch.state.shape == (240, 8, 8)
    assert taxel.State(int(touch.state[0, 0, 0])) in list(taxel.State)
    assert touch.contacts.dtype == taxel.CONTACT and len(touch.contacts) > 0
    assert touch.events.dtype == taxel.EVENT and len(touch.events) > 0
    truth = twin.truth(frames)
    assert truth.shape == (240, 8, 8, 3)
    # The fingers of the script press: the total follows them.
    pressing = truth[50:, ..., 2].sum(axis=(1, 2))
    assert np.corrcoef(pressing, touch.total_force[50:, 2])[0, 1] > 0.99


@pytest.mark.parametrize("name", FRAMES_OF)
def test_blocks_of_any_size_give_the_same_touches(name: str) -> None:
    sensor = taxel.Sensor(name)
    frames = sensor.twin(seed=3).frames(210)
    whole = sensor.estimator().push(frames)
    assert len(whole) + whole.skipped == 210
    for size in (1, 7, 64):
        estimator = sensor.estimator()
        blocks = [estimator.push(frames[start : start + size]) for start in range(0, 210, size)]
        for field in ("time_ns", "sequence", "value", "deviation", "residual", "state", "total_force", "centre", "counted"):
            joined = np.concatenate([getattr(block, field) for block in blocks])
            assert taxel._answers.same(joined, getattr(whole, field)), (size, field)
        for field in ("contacts", "events"):
            joined = np.concatenate([getattr(block, field) for block in blocks])
            assert joined.tobytes() == getattr(whole, field).tobytes(), (size, field)


@pytest.mark.parametrize("name", FRAMES_OF)
def test_touches_are_those_of_the_command(name: str, tmp_path: Path) -> None:
    frames = 130
    saved, table = tmp_path / "run.csv", tmp_path / "touch.csv"
    command(
        "live", name, "--source", "sim:", "--headless", "--speed", "max", "--frames", str(frames), "--seed", "5",
        "--no-tare", "--save", str(saved),
    )  # fmt: skip
    command("estimate", name, str(saved), "--no-tare", "-o", str(table))
    sensor = taxel.Sensor(name)
    recording = taxel.read(saved)
    ours = sensor.estimator().push(recording.frames)
    head, *lines = [line.split(",") for line in table.read_text().splitlines() if not line.startswith("#")]

    def column(title: str) -> np.ndarray:
        at = head.index(title)
        return np.array([float(line[at] or "nan") for line in lines])

    assert np.array_equal(column("sequence").astype(np.uint64), ours.sequence)
    contacts = [np.count_nonzero(ours.contacts["sequence"] == number) for number in ours.sequence]
    assert np.array_equal(column("contacts"), contacts)
    for axis, letter in enumerate("xyz"):
        assert np.array_equal(column(f"force_{letter} [N]"), ours.total_force[:, axis], equal_nan=True), letter


@pytest.mark.parametrize("name", FRAMES_OF)
def test_a_twin_is_reproducible_and_pickles_where_it_stands(name: str) -> None:
    twin = taxel.Sensor(name).twin(seed=11)
    other = taxel.Sensor(name).twin(seed=11)
    assert twin.frames(20) == other.frames(20)
    again = pickle.loads(pickle.dumps(twin))
    assert again == twin == copy.deepcopy(twin)
    assert again.frames(15) == twin.frames(15)
    assert taxel.Sensor(name).twin(seed=12).frames(20) != taxel.Sensor(name).twin(seed=11).frames(20)


def test_frames_and_touches_pickle_copy_and_compare() -> None:
    sensor = taxel.Sensor("liquid-metal-2x4")
    frames = sensor.twin(seed=1).frames(50)
    touch = sensor.estimator().push(frames)
    for value in (frames, touch):
        assert pickle.loads(pickle.dumps(value)) == value == copy.deepcopy(value)
    assert frames != frames[:-1]
    pressed = taxel.Sensor("force-4x4")
    shown = pressed.estimator().push(pressed.twin(seed=1).frames(50))
    assert "<svg" in shown._repr_html_() and len(shown.plot()) >= 1
    # P4 gives pressures.
    assert (touch.quantity, touch.unit) == ("pressure", "Pa")
    with pytest.raises(AttributeError, match="use value"):
        _ = touch.force


@pytest.mark.parametrize("name", FRAMES_OF)
def test_an_estimator_goes_on_as_its_copies_do(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    sensor = taxel.Sensor(name)
    frames = sensor.twin(seed=6).frames(90)
    estimator = sensor.estimator()
    assert pickle.loads(pickle.dumps(estimator)) == estimator
    estimator.tare(20)
    estimator.push(frames[:50])
    copies = [pickle.loads(pickle.dumps(estimator)), copy.deepcopy(estimator), copy.copy(estimator)]
    rest = estimator.push(frames[50:])
    for again in copies:
        assert again.counts["accepted"] == 50 and again != estimator
        assert again.push(frames[50:]) == rest
        assert again == estimator and again.tared == estimator.tared
    # More than is kept: it says what to send instead.
    monkeypatch.setattr(taxel._touch, "_MOST_KEPT", 1000)
    estimator.push(frames.values, time_ns=frames.time_ns + 10**9)
    with pytest.raises(TypeError, match="send the sensor, the calibration and the frames"):
        pickle.dumps(estimator)


def test_a_tare_is_taken_from_the_next_frames() -> None:
    sensor = taxel.Sensor("three-axis-8x8")
    twin = sensor.twin(seed=2)
    estimator = sensor.estimator()
    assert not estimator.tared
    estimator.tare(30)
    before = estimator.push(twin.frames(30))
    assert estimator.tared and (before.contacts["contact"] == 0).all()
    after = estimator.push(twin.frames(5))
    estimator.clear_tare()
    assert len(after) == 5 and estimator.counts["accepted"] == 35
    with pytest.raises(ValueError, match="from 1 to"):
        estimator.tare(0)


@pytest.mark.parametrize(
    ("frames", "times", "said"),
    [
        (np.zeros((3, 255)), np.arange(3), "255 channels; the device has 256"),
        (np.zeros((3, 256)), np.arange(2), "2 times for 3 frames"),
        (np.zeros((3, 256)), np.arange(3.0), "whole numbers"),
        (np.zeros((3, 256)), -np.arange(3), "times begin at 0"),
        (np.zeros((0, 0)), np.arange(0), "0 channels"),
        ("frames", np.arange(3), "no array of numbers"),
        (np.zeros((1, 2, 3)), np.arange(1), "have the shape"),
        (np.zeros((3, 256)), None, "have no times"),
    ],
)
def test_frames_of_another_device_are_refused(frames: object, times: object, said: str) -> None:
    estimator = taxel.Sensor("three-axis-8x8").estimator()
    with pytest.raises(taxel.FrameError) as caught:
        estimator.push(frames, times)  # type: ignore[arg-type]
    assert said in str(caught.value)
    # It is as it was.
    readings = 1000.0 + np.arange(512.0).reshape(2, 256)
    assert len(estimator.push(readings, np.arange(2) * 16_666_667)) == 2


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300, -1.0])
def test_readings_that_cannot_be_are_states_not_errors(value: float) -> None:
    for name in TWINS:
        sensor = taxel.Sensor(name)
        frames = sensor.twin(seed=1).frames(10)
        frames.values[5:, :] = value
        touch = sensor.estimator().push(frames)
        assert not (touch.state[-1] == taxel.State.OK).all() or value == -1.0


def test_states_are_those_of_the_library() -> None:
    assert [state.name.lower() for state in taxel.State] == taxel._taxel.STATES


def test_no_frames_are_no_touches() -> None:
    sensor = taxel.Sensor("in-plane-50um")
    touch = sensor.estimator().push(sensor.twin().frames(0))
    assert len(touch) == 0 and len(touch.contacts) == 0 and touch._repr_html_()
    with pytest.raises(ValueError, match="frames: must be from 0"):
        sensor.twin().frames(-1)


def test_a_recording_of_a_vendor_is_read() -> None:
    recording = taxel.read(ROOT / "crates/taxel-recording/tests/recordings/fingertip.csv")
    assert len(recording) == 60 and recording.frames.values.shape[1] == recording.shape[0] * recording.shape[1]
    assert pickle.loads(pickle.dumps(recording)) == recording
    with pytest.raises(taxel.InputError, match="none.csv"):
        taxel.read("none.csv")


def test_a_recording_of_a_run_is_read_and_estimated(tmp_path: Path) -> None:
    run = tmp_path / "run.mcap"
    command(
        "live", "in-plane-50um", "--source", "sim:", "--headless", "--speed", "max", "--frames", "60", "--no-tare",
        "--record", str(run),
    )  # fmt: skip
    recording = taxel.read(run)
    assert len(recording) == 60
    twin = taxel.Sensor("in-plane-50um").twin(seed=1).frames(60)
    assert np.array_equal(recording.frames.values, twin.values)
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes(run.read_bytes()[:-4000])
    try:
        with pytest.warns(UserWarning, match="damage"):
            assert taxel.read(damaged).damage
    except taxel.InputError:
        # Cut before its first frames: nothing is there to read.
        pass


def test_a_trained_map_is_that_of_the_command(tmp_path: Path) -> None:
    folder = ROOT / "crates/taxel-recording/tests/recordings/lattice"
    trained = taxel.TrainedMap("eflesh-lattice")
    with pytest.raises(taxel.InputError, match="not trained"):
        trained.predict(np.zeros((1, 15)), rate=28.0)
    assert trained.fit(folder) is trained and trained.outputs == ("x", "y", "force_z")
    assert trained.calibration is not None
    assert trained.calibration.text == taxel.calibrate("eflesh-lattice", folder).text
    trained.save(tmp_path / "lattice.toml")
    loaded = taxel.TrainedMap.load("eflesh-lattice", tmp_path / "lattice.toml")
    assert pickle.loads(pickle.dumps(trained)) == trained
    frames = taxel.read(folder / "force_sensor.csv", bare=True).frames
    found, deviation = loaded.predict(frames, return_std=True)
    assert found.shape == deviation.shape == (1095, 3)
    assert taxel._answers.same(found, trained.predict(frames))
    # At the times of the readings of the scale, g.
    states = np.loadtxt(folder / "force_states.csv", delimiter=",")
    states = states[states[:, 4] >= 0]
    read, spread = (np.interp(states[:, 0], frames.time_ns * 1e-9, of[:, 2]) for of in (found, deviation))
    error = read - states[:, 4] * 9.80665e-3
    # What the training says of its own readings, replayed live.
    said = [re.search(r"replayed live, have ([\d.]+) N rms", remark) for remark in trained.calibration.remarks]
    (said_rms,) = (float(one[1]) for one in said if one)
    # The first 15 rows, then every second one of 1095.
    assert len(error) == 15 + 540
    # Training counts what live says: nothing before the end of its rest capture of 50 frames, which the frames here go
    # without; and printed digits.
    live = error[states[:, 0] >= frames.time_ns[50] * 1e-9]
    assert np.sqrt(np.mean(live**2)) == pytest.approx(said_rms, abs=5e-4)
    # A reading of the scale is up to 0.2 s old, in which 32 N within 18 s change by up to 0.56 N.
    assert said_rms < 0.56
    assert np.mean(np.abs(error) < 3 * spread) > 0.95
    # The command estimates the same.
    command("estimate", "eflesh-lattice", str(folder / "force_sensor.csv"), "--calibration", str(tmp_path / "lattice.toml"),
            "--no-tare", "-o", str(tmp_path / "touch.csv"))  # fmt: skip
    import csv

    with open(tmp_path / "touch.csv", newline="") as file:
        theirs = [float(row["force_z [N]"]) for row in csv.DictReader(line for line in file if not line.startswith("#"))]
    assert np.array_equal(found[:, 2], theirs)
    with pytest.raises(taxel.InputError, match="taxel.calibrate"):
        taxel.TrainedMap("in-plane-50um")


def test_arrays_train_a_map() -> None:
    # Four channels that read a press on a plane, with a rest before it.
    random = np.random.default_rng(3)
    count, corners = 900, np.array([[-5e-3, -5e-3], [5e-3, -5e-3], [-5e-3, 5e-3], [5e-3, 5e-3]])
    time = np.arange(count) / 50.0
    force = 3.0 * np.clip(np.sin(time * 1.3), 0.0, None) ** 2
    force[:60] = 0.0
    distance = np.linalg.norm(np.zeros(2) - corners, axis=1)
    values = 100.0 + np.outer(force, 20.0 + 1e3 * distance) * [1.0, 0.8, 1.2, 0.9] + random.normal(0, 0.05, (count, 4))
    trained = taxel.TrainedMap().fit(values[:700], force=force[:700], rate=50.0)
    assert trained.outputs == ("force_z",) and trained.sensor is not None
    found, deviation = trained.predict(values, rate=50.0, rest=30, return_std=True)
    error = (found[700:, 0] - force[700:]) / deviation[700:, 0]
    assert np.abs(found[700:, 0] - force[700:]).max() < 0.1 and np.mean(np.abs(error) < 3) > 0.95
    for wrong in ({"force": force[:10]}, {}, {"places": np.zeros((700, 4))}):
        with pytest.raises(taxel.InputError, match="fit: "):
            taxel.TrainedMap().fit(values[:700], rate=50.0, **wrong)
    with pytest.raises(taxel.InputError, match="rate"):
        taxel.TrainedMap().fit(values[:700], force=force[:700])
