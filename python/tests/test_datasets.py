"""Datasets from arrays and tables, and what is refused of them."""

import re

import numpy as np
import pandas as pd
import pytest
import yair


def columns_of(robot):
    """A dataset as the arrays that somebody has in a notebook."""
    data = yair.Dataset.read(robot)
    odometry = data.to_pandas()
    truth = pd.concat([pd.DataFrame({"run": run, **data.truth(run)}) for run in data.runs], ignore_index=True)
    return odometry, truth, data.robot


def given(robot):
    """The nominal robot as `from_arrays` takes it."""
    both = (robot["left_wheel_diameter_m"], robot["right_wheel_diameter_m"])
    return {
        "wheel_diameter_m": both,
        "wheel_separation_m": robot["wheel_separation_m"],
        "ticks_per_rev": robot["ticks_per_rev"],
    }


def test_arrays_are_the_dataset_that_they_come_from(robot):
    odometry, truth, nominal = columns_of(robot)
    data = yair.Dataset.from_arrays(
        odometry["t_s"],
        odometry["left_ticks"],
        odometry["right_ticks"],
        run=odometry["run"],
        truth=truth,
        **given(nominal),
        name="robot",
    )
    frames = yair.Dataset.from_frames(odometry, truth, **given(nominal), name="robot")
    for made in (data, frames):
        pd.testing.assert_frame_equal(made.to_pandas(), odometry, check_exact=True)
        for run in made.runs:
            theirs = truth[truth["run"] == run]
            assert all(
                np.array_equal(made.truth(run)[key], theirs[key], equal_nan=True) for key in theirs if key != "run"
            )


def test_memory_and_folder_calibrate_to_the_same_bits(robot, tmp_path):
    odometry, truth, nominal = columns_of(robot)
    data = yair.Dataset.from_frames(odometry, truth, **given(nominal), sigma_xy_m=0.001, name="robot")
    from_memory = data.calibrate()
    data.write(tmp_path / "robot")
    assert yair.Dataset.read(tmp_path / "robot").calibrate().json == from_memory.json
    with pytest.raises(yair.Error, match="already"):
        data.write(tmp_path / "robot")


def circle(**changes):
    """A robot that drives a circle, as `from_arrays` takes it."""
    t = np.arange(0.0, 20.0, 0.1)
    left, right = np.round(300 * t), np.round(420 * t)
    # Wheels of 0.15 m, 0.3 m apart, 4096 counts a turn.
    per_count = np.pi * 0.15 / 4096
    theta = (right - left) * per_count / 0.3
    radius = 0.3 * 360 / 120
    truth = (t, radius * np.sin(theta), radius * (1 - np.cos(theta)), theta)
    arguments = {"t": t, "left": left, "right": right, "truth": truth}
    arguments |= {"wheel_diameter_m": 0.15, "wheel_separation_m": 0.3, "ticks_per_rev": 4096}
    return arguments | changes


def test_circle_is_taken():
    data = yair.Dataset.from_arrays(**circle())
    assert data.runs == ["000"] and data.odometry()["left_ticks"].dtype == np.int64
    assert repr(data) == "Dataset('arrays': 1 runs, 200 odometry rows)"
    np.testing.assert_array_equal(data.truth("000")["x_m"], circle()["truth"][1])


def truth_with(row, column, value):
    truth = [column.copy() for column in circle()["truth"]]
    truth[column][row] = value
    return truth


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"left": np.arange(199.0)}, r"left: it has 199 rows, t has 200"),
        ({"left": np.arange(200) + 0.5}, r"left: row 0 is 0.5; expected a cumulative count; .*wheels=\"rad\""),
        ({"right": ["a"] * 200}, r"right: .*expected numbers"),
        ({"left": np.ones((200, 2))}, r"left: it has 2 dimensions; expected one column"),
        ({"t": np.zeros(200)}, r'run "000": odometry at 0 s after 0 s; expected increasing time$'),
        ({"truth": truth_with(7, 1, np.inf)}, r'run "000": truth = inf; expected a finite number$'),
        ({"truth": circle()["truth"][:2]}, r"truth: it has 2 columns; expected t_s, x_m, y_m, theta_rad"),
        ({"truth": {"t_s": [0], "x": [0], "y_m": [0]}}, r"truth: unknown columns x; expected t_s, x_m"),
        ({"truth": {"t_s": [0], "x_m": [0]}}, r"truth: no column y_m"),
        ({"run": ["a"] * 200}, r"truth: runs were given, and so it needs a column run"),
        ({"wheels": "counts"}, r'wheels: "counts" is none of ticks, rad, mps, twist'),
        ({"wheel_separation_m": -0.3}, r"wheel_separation_m = -0.3; expected a positive"),
        ({"ticks_per_rev": None}, r"ticks_per_rev"),
    ],
)
def test_what_is_wrong_is_said(changes, message):
    with pytest.raises(yair.Error, match=message):
        yair.Dataset.from_arrays(**circle(**changes))


def test_errors_have_file_and_line(robot, tmp_path):
    data = yair.Dataset.read(robot)
    data.write(tmp_path / "spoiled")
    table = tmp_path / "spoiled" / "odometry.csv"
    lines = table.read_text().splitlines(keepends=True)
    lines[4] = re.sub(r",[^,]*$", ",nan\n", lines[4])
    table.write_text("".join(lines))
    for read in (yair.Dataset.read, yair.calibrate, yair.check):
        with pytest.raises(yair.Error, match=r"odometry\.csv:5|odometry\.csv.*line 5"):
            read(tmp_path / "spoiled")


def test_csv_of_any_columns_is_imported(tmp_path):
    arguments = circle()
    table = pd.DataFrame({"stamp": arguments["t"], "enc_l": arguments["left"], "enc_r": arguments["right"]})
    for name, column in zip(("x", "y", "theta"), arguments["truth"][1:], strict=True):
        table[name] = column
    table.to_csv(tmp_path / "log.csv", index=False)
    names = {"t": "stamp", "left": "enc_l", "right": "enc_r"}
    data = yair.Dataset.import_csv(
        tmp_path / "log.csv", out=tmp_path / "mine", wheel=0.15, base=0.3, ticks_per_rev=4096, map=names
    )
    np.testing.assert_array_equal(data.odometry()["left_ticks"], arguments["left"])
    assert data.robot["wheel_separation_m"] == 0.3
    with pytest.raises(yair.Error, match="--base"):
        yair.Dataset.import_csv(tmp_path / "log.csv", out=tmp_path / "other", wheel=0.15)
