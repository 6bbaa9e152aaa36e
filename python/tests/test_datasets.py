"""Datasets from arrays and tables, and what is refused of them."""

import re
import tempfile

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


def test_rows_of_truth_keep_their_covariance(robot, tmp_path):
    odometry, truth, nominal = columns_of(robot)
    rows = len(truth)
    # A long ellipse, with rows of which nothing is known, positions alone and headings alone.
    elements = {"cov_xx": 4e-6, "cov_xy": 1e-6, "cov_xt": 0.0, "cov_yy": 1e-6, "cov_yt": 0.0, "cov_tt": 9e-6}
    for name, value in elements.items():
        truth[name] = np.where(np.arange(rows) % 5 == 1, np.nan, value)
    truth.loc[truth.index % 5 == 2, "theta_rad"] = np.nan
    truth.loc[truth.index % 5 == 3, ["x_m", "y_m"]] = np.nan
    made = yair.Dataset.from_arrays(
        odometry["t_s"],
        odometry["left_ticks"],
        odometry["right_ticks"],
        run=odometry["run"],
        truth=truth,
        **given(nominal),
        name="robot",
    )
    # As somebody writes the folder by hand: what the file says is what the arrays say.
    made.write(tmp_path / "made")
    truth.to_csv(tmp_path / "made" / "truth.csv", index=False)
    by_hand = yair.Dataset.read(tmp_path / "made")
    frames = yair.Dataset.from_frames(odometry, truth, **given(nominal), name="robot")
    assert made.calibrate().json == by_hand.calibrate().json == frames.calibrate().json
    plain = truth.drop(columns=list(elements)).dropna(subset=["x_m"])
    without = yair.Dataset.from_frames(odometry, plain, **given(nominal), name="robot")
    assert made.calibrate().json != without.calibrate().json
    for run in made.runs:
        seen, read = made.truth(run), by_hand.truth(run)
        assert set(seen) == set(read) == {"t_s", "x_m", "y_m", "theta_rad", "sigma_theta_rad", *elements}
        assert all(np.array_equal(seen[key], read[key], equal_nan=True) for key in seen)
        assert np.nanmax(seen["cov_xy"]) == 1e-6 and np.isnan(seen["cov_tt"]).any()


@pytest.mark.parametrize(
    ("truth", "message"),
    [
        ({"cov_xx": 1.0}, r"truth: no column cov_xy, .*the six columns of a covariance come together"),
        (
            dict.fromkeys(["cov_xx", "cov_yy", "cov_tt", "cov_xt", "cov_yt"], 1.0) | {"cov_xy": 2.0},
            r"covariance of row 0",
        ),
    ],
)
def test_a_covariance_that_is_none_is_refused(truth, message):
    seen = dict(zip(("t_s", "x_m", "y_m", "theta_rad"), circle()["truth"], strict=True))
    seen |= {name: np.full(200, value) for name, value in truth.items()}
    with pytest.raises(yair.Error, match=message):
        yair.Dataset.from_arrays(**circle(truth=seen))


def tables():
    """Every table of the format but truth, of one run on a circle."""
    t = circle()["t"]
    return {
        "displacement": pd.DataFrame({"t0_s": [0.0], "t1_s": [1.0], "dx_m": [0.1], "dy_m": [0.0], "dtheta_rad": [0.1]}),
        "points": pd.DataFrame({"t_s": [0.0, 5.0], "point": ["left", "left"], "x_m": [0.0, 0.5], "y_m": [0.1, 0.5]}),
        "wheel_reference": pd.DataFrame({"t_s": t[1:3], "left_mps": [0.03, 0.03], "right_mps": [0.05, 0.05]}),
        "revisit": pd.DataFrame({"t0_s": [0.0], "t1_s": [19.0], "sigma_xy_m": [0.002], "sigma_theta_rad": [np.nan]}),
        "distance": pd.DataFrame({"t0_s": [0.0], "t1_s": [4.0], "distance_m": [0.7], "sigma_m": [0.002]}),
        "wall": pd.DataFrame(
            {"t_s": [1.0, 2.0], "wall": ["north"] * 2, "distance_m": [1.0, 1.1], "sigma_m": [0.01] * 2}
        ),
        "gyro": pd.DataFrame({"t_s": t[::2], "omega_radps": np.full(100, 0.046)}),
    }


def test_every_table_of_the_format_passes(tmp_path):
    of = circle()
    odometry = pd.DataFrame({"t_s": of["t"], "left_ticks": of["left"], "right_ticks": of["right"]})
    odometry["gyro_radps"] = np.where(of["t"] > 1.0, 0.1, np.nan)
    odometry["cmd_v_mps"] = np.float32(0.1)
    odometry["battery_v"] = 12.0
    robot = {"wheel_diameter_m": 0.15, "wheel_separation_m": 0.3, "ticks_per_rev": 4096}
    runs = pd.DataFrame({"id": ["000"], "protocol": ["circle_ccw"], "radius_m": [0.9], "payload_kg": [2.5]})
    with pytest.warns(yair.YairWarning, match="battery_v") as caught:
        made = yair.Dataset.from_frames(
            odometry,
            **tables(),
            marks={"left": (0.0, 0.2)},
            runs=runs,
            **robot,
            robot_id="cart-7",
            recorded="2026-11-23T09:00:00+01:00",
            manifest={"gyro": {"scale_sigma": 0.01}, "truth": {"sigma_xy_m": 0.001}},
        )
    assert caught[0].filename == __file__
    assert set(made.odometry()) == {"t_s", "left_ticks", "right_ticks", "cmd_v_mps", "gyro_radps"}
    # The shortest digits of a single-precision number are another number.
    assert made.odometry()["cmd_v_mps"][0] == float(np.float32(0.1)) and np.isnan(made.odometry()["gyro_radps"][0])
    folder = made.write(tmp_path / "made")
    manifest = (folder / "dataset.toml").read_text()
    for line in (
        'id = "cart-7"',
        "2026-11-23T08:00:00Z",
        "payload_kg = 2.5",
        'protocol = "circle_ccw"',
        "scale_sigma = 0.01",
    ):
        assert line in manifest, manifest
    for name, table in tables().items():
        written = pd.read_csv(folder / f"{name}.csv", dtype={"run": str})
        assert len(written) == len(table) and set(table) | {"run"} <= set(written), name
        pd.testing.assert_frame_equal(written[list(table)], table, check_exact=True, check_dtype=False)


def test_tables_that_are_wrong_name_table_and_line():
    of = circle()
    odometry = pd.DataFrame({"t_s": of["t"], "left_ticks": of["left"], "right_ticks": of["right"]})
    robot = {"wheel_diameter_m": 0.15, "wheel_separation_m": 0.3, "ticks_per_rev": 4096}
    spoiled = tables()["gyro"].assign(omega_radps=[0.0] * 3 + [np.inf] + [0.0] * 96)
    tape = tables()["distance"]
    for tables_given, message in [
        ({"gyro": spoiled, "distance": tape}, r"^gyro\.csv:5"),
        ({"distance": tape.rename(columns={"sigma_m": "sigma"})}, r"^distance\.csv.*sigma_m"),
        ({"distance": tape.assign(run="a")}, "distance: it has a column run, and odometry has none"),
        ({}, r"no truth|none of|truth"),
        ({"distance": tape, "runs": pd.DataFrame({"id": ["b"]})}, 'runs: it has a run "b"'),
        ({"distance": tape, "manifest": {"gyro": {"scale": 1.0}}}, r"dataset\.toml.*scale"),
    ]:
        with pytest.raises(yair.Error, match=message) as raised:
            yair.Dataset.from_frames(odometry, **tables_given, **robot)
        assert tempfile.gettempdir() not in str(raised.value)
