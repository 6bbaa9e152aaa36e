"""The command beside the package, and a robot to work on."""

import os
import subprocess
from pathlib import Path

import pytest
import yair

ROOT = Path(__file__).resolve().parents[2]

COMMAND = Path(os.environ.get("YAIR_COMMAND", ROOT / "target" / "release" / "yair"))


@pytest.fixture(scope="session")
def command():
    """Runs the command's binary, and returns exit code, standard output and standard error."""
    assert COMMAND.is_file(), f"{COMMAND}: no such file; build it (cargo build --release) or set YAIR_COMMAND"

    def run(*arguments, cwd=None):
        done = subprocess.run([COMMAND, *arguments], capture_output=True, text=True, cwd=cwd, check=False)
        return done.returncode, done.stdout, done.stderr

    return run


@pytest.fixture(scope="session")
def scenarios():
    """The folder of scenarios."""
    return ROOT / "scenarios"


@pytest.fixture(scope="session")
def robot(scenarios, tmp_path_factory):
    """A robot under motion capture, with a wheel out of true."""
    folder = tmp_path_factory.mktemp("robots") / "robot"
    yair.simulate(scenarios / "motion-capture.toml", out=folder)
    return folder
