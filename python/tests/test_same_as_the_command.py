"""The package and the command give the same documents, byte by byte."""

import json
import shutil
import subprocess
import sys

import pytest
import yair


def document(command, *arguments, code=0):
    """What the command prints with --json."""
    returned, output, errors = command(*arguments, "--json")
    assert returned == code, errors
    return output.removesuffix("\n")


@pytest.mark.parametrize("method", ["joint", "all"])
def test_calibrate(command, robot, tmp_path, method):
    expected = document(command, "calibrate", robot, "--method", method, "--out", tmp_path / "command.toml")
    found = yair.Dataset.read(robot).calibrate(method=method, out=tmp_path / "package")
    assert found.json == expected
    assert found.file.read_bytes() == (tmp_path / "command.toml").read_bytes()
    value = json.loads(expected)["methods"][0]["parameters"]["wheel_separation_m"]["value"]
    assert found.methods[0].parameters["wheel_separation_m"].value == value


def test_evaluate(command, robot, tmp_path):
    found = yair.calibrate(robot, out=tmp_path)
    expected = document(command, "evaluate", robot, "--calibration", found.file, "--align", "se2")
    assert yair.evaluate(robot, calibration=found, align="se2").json == expected


def test_diagnose(command, robot, tmp_path):
    folder = tmp_path / "diagnosis"
    expected = document(command, "diagnose", robot, "--out", folder)
    page = (folder / "report.html").read_bytes()
    shutil.rmtree(folder)
    found = yair.diagnose(robot, out=folder)
    assert found.json == expected
    assert len(found.findings) == 1 and found.verdict == "named"
    # The pages differ in the line that says how they were made.
    differing = [
        (a, b) for a, b in zip(page.splitlines(), found.report.read_bytes().splitlines(), strict=True) if a != b
    ]
    assert all(b"yair diagnose" in a for a, _ in differing) and len(differing) <= 2


def test_sweep(command, scenarios, tmp_path):
    scenario = scenarios / "paper.toml"
    expected = document(command, "sweep", scenario, "--trials", "60", "--seed", "5", "--jobs", "1")
    for options in [{"jobs": 1}, {"jobs": 2}, {"out": tmp_path / "sweep"}]:
        assert yair.sweep(scenario, trials=60, seed=5, **options).json == expected
    shards = [tmp_path / f"shard-{number}" for number in (1, 2)]
    for number, shard in enumerate(shards, start=1):
        assert yair.sweep(scenario, trials=60, seed=5, shard=f"{number}/2", out=shard) is None
    assert yair.merge(*shards, out=tmp_path / "merged").json == expected


def test_check_and_plan(command, robot, scenarios):
    assert yair.check(robot).json == document(command, "check", robot)
    scenario = scenarios / "motion-capture.toml"
    assert yair.plan(scenario, minutes=3, room=(4, 3)).json == document(
        command, "plan", scenario, "--minutes", "3", "--room", "4,3"
    )


def test_fleet(command, scenarios, tmp_path):
    scenario = scenarios / "fleet.toml"
    for day, point in [(23, 1), (24, 3)]:
        recorded = f"2026-11-{day}T08:00:00+01:00"
        out = tmp_path / "robots" / str(day)
        yair.simulate(scenario, point=point, seed=day, robot_id="cart", recorded=recorded, out=out)
    expected = document(command, "fleet", tmp_path / "robots", "--calibrate-only")
    found = yair.fleet(tmp_path / "robots", calibrate_only=True)
    assert found.json == expected
    assert found.report is not None
    changed = found.to_pandas().set_index("parameter").changed
    assert changed["right_wheel_diameter_m"] and not changed["wheel_separation_m"]


def test_correct_and_simulate(command, robot, scenarios, tmp_path):
    found = yair.calibrate(robot, out=tmp_path / "calibrated")
    document(command, "correct", robot, "--calibration", found.file, "--out", tmp_path / "command")
    yair.correct(robot, calibration=found, out=tmp_path / "package")
    document(command, "simulate", scenarios / "motion-capture.toml", "--out", tmp_path / "robot")
    pairs = [(tmp_path / "command", tmp_path / "package"), (tmp_path / "robot", robot)]
    for theirs, ours in pairs:
        names = sorted(path.name for path in theirs.iterdir())
        assert names == sorted(path.name for path in ours.iterdir()) and names
        assert all((theirs / name).read_bytes() == (ours / name).read_bytes() for name in names)


@pytest.mark.parametrize("arguments", [["--version"], ["check", "no-such-folder"], ["sweep"], []])
def test_module(command, arguments):
    done = subprocess.run([sys.executable, "-m", "yair", *arguments], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == command(*arguments)
