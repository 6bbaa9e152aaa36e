"""How calls behave: errors, warnings, progress, Ctrl-C, other threads; and how results show themselves."""

import os
import signal
import threading

import pandas as pd
import pytest
import yair


def test_errors_are_the_commands(command, tmp_path, robot):
    with pytest.raises(yair.Error) as raised:
        yair.calibrate(tmp_path / "nothing")
    _, _, errors = command("calibrate", tmp_path / "nothing")
    assert f"error: {raised.value}\n" == errors and raised.value.exit_code == 1
    with pytest.raises(yair.Error, match="nonsense") as raised:
        yair.calibrate(robot, method="nonsense")
    assert raised.value.exit_code == 2 and "Usage" not in str(raised.value)
    with pytest.raises(yair.Error, match="drifts") as raised:
        yair.evaluate(robot, max_drift=0.0)
    assert raised.value.exit_code == 3 and raised.value.document["calibrations"]


def test_a_session_given_twice_is_refused(robot, scenarios):
    simulated = yair.simulate(scenarios / "motion-capture.toml")
    for twice in (yair.Dataset.read(robot), simulated):
        with pytest.raises(yair.Error, match="given twice"):
            yair.calibrate(twice, twice)
    with pytest.raises(TypeError, match="no dataset"):
        yair.check()


def test_warnings_name_the_line_of_the_user(robot):
    found = yair.calibrate(robot)
    with pytest.warns(yair.YairWarning, match="was trained on") as caught:
        yair.evaluate(robot, calibration=found)
    assert caught[0].filename == __file__


def test_problems_of_a_log_are_a_result_and_no_exception(robot):
    data = yair.Dataset.read(robot)
    odometry = data.to_pandas()
    # Left and right exchanged.
    names = {"left_ticks": "right_ticks", "right_ticks": "left_ticks"}
    truth = pd.concat([pd.DataFrame({"run": run, **data.truth(run)}) for run in data.runs])
    nominal = data.robot
    spoiled = yair.Dataset.from_frames(
        odometry.rename(columns=names),
        truth,
        wheel_diameter_m=nominal["left_wheel_diameter_m"],
        wheel_separation_m=nominal["wheel_separation_m"],
        ticks_per_rev=nominal["ticks_per_rev"],
    )
    found = spoiled.check()
    assert not found.ok and set(found.to_pandas()["severity"]) >= {"error"}
    with pytest.raises(yair.Error):
        spoiled.calibrate()


class Interrupter:
    """Presses Ctrl-C once, at the first progress."""

    def __init__(self):
        self.told = []

    def __call__(self, what, done, total):
        self.told.append((what, done, total))
        if len(self.told) == 1:
            os.kill(os.getpid(), signal.SIGINT)


@pytest.fixture
def answers_ctrl_c():
    """Python's own handler; a process in the background of a script begins without."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("answers_ctrl_c")
def test_ctrl_c_stops_a_sweep_that_goes_on_to_the_same_bits(scenarios, tmp_path):
    scenario, out = scenarios / "paper.toml", tmp_path / "sweep"
    press = Interrupter()
    with pytest.raises(KeyboardInterrupt):
        yair.sweep(scenario, trials=20_000, jobs=1, out=out, progress=press)
    what, done, total = press.told[0]
    assert what == "trials" and done < total == 240_000
    with pytest.raises(yair.Error, match="--resume"):
        yair.sweep(scenario, trials=20_000, out=out)
    resumed = yair.sweep(scenario, trials=20_000, out=out, resume=True)
    assert resumed.json == yair.sweep(scenario, trials=20_000).json


@pytest.mark.usefixtures("answers_ctrl_c")
def test_ctrl_c_leaves_a_diagnosis_at_once(robot):
    pressed = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
    pressed.start()
    with pytest.raises(KeyboardInterrupt):
        while True:
            yair.diagnose(robot)
    pressed.join()


def test_other_threads_run_meanwhile(scenarios):
    counted, over = [0], threading.Event()

    def count():
        while not over.is_set():
            counted[0] += 1

    thread = threading.Thread(target=count)
    before = []
    thread.start()
    try:
        yair.sweep(scenarios / "paper.toml", trials=4000, jobs=1, progress=lambda *_: before.append(counted[0]))
    finally:
        over.set()
        thread.join()
    # With the lock held it would stand still between two looks.
    assert len(before) >= 2 and before[-1] > before[0]


def test_results_show_themselves(robot, scenarios):
    found = yair.calibrate(robot)
    page = found._repr_html_()
    assert page.startswith("<iframe") and "srcdoc=" in page and "&lt;html" in page and page.count("<") == 2
    assert found.report.is_file() and list(found.to_pandas()["parameter"])[:2]
    assert yair.evaluate(robot).to_pandas()["length_m"].min() > 0.0
    swept = yair.sweep(scenarios / "paper.toml", trials=10)
    assert len(swept.to_pandas()) == sum(len(point.estimators) for point in swept.points)
    assert "<table" in swept._repr_html_()
    poses = yair.correct(robot, calibration=found).to_pandas()
    assert len(poses) == len(yair.Dataset.read(robot).to_pandas()) and {"dataset", "run", "t_s"} <= set(poses)
    with pytest.raises(AttributeError, match="there are .*methods"):
        _ = found.nonsense
    with pytest.raises(ValueError, match="no calibration"):
        yair.evaluate(robot, calibration=swept)
