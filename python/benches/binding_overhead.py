"""What a call from Python costs over the command, on the paper's sweep:

    YAIR_COMMAND=target/release/yair python python/benches/binding_overhead.py scenarios/paper.toml [TURNS]

docs/python.md has the figures. Command and package are to be builds of one state with one profile.
"""

from __future__ import annotations

import os
import subprocess
import sys

import yair
from turns import in_turn, median_interval

TURNS = 21


def main(scenario: str, turns: int) -> None:
    """Prints the ratios package over command."""
    command = [os.environ.get("YAIR_COMMAND", "yair"), "sweep", scenario, "--json", "--quiet"]
    outputs: list[str] = ["", ""]

    def of_command() -> None:
        outputs[0] = subprocess.run(command, check=True, capture_output=True, text=True).stdout

    def of_package() -> None:
        found = yair.sweep(scenario)
        outputs[1] = found.json if found else ""

    taken = in_turn([of_command, of_package], turns)
    if outputs[0].rstrip("\n") != outputs[1]:
        sys.exit("command and package give different documents: they are not of one state")
    for name, ratios in (
        ("wall", [package.wall_s / command.wall_s for command, package in taken]),
        ("processor", [package.cpu_s / command.cpu_s for command, package in taken]),
    ):
        print(f"{name} time, package over command, median of {turns} turns: {median_interval(ratios)}")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else TURNS)
