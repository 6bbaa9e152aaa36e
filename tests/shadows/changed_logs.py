"""Lengths that `calibrate` finds in ordinary logs that are changed as strangers' logs are (docs/one-model.md).

    python changed_logs.py --logs DIR --yair PATH... --work DIR

DIR holds logs of `replay --cases 0`: `target/replay/logs/ordinary`. Each change has logs of one kind, with the truth of
the log that was changed. A table has, for each executable, how many logs are calibrated, the root mean square of the
errors of both wheels and the separation over their standard deviations, and that of the separation's error, per cent.
Where one run is changed, it says in how many logs `check` names that run and the offset to 50 ms.
"""

import argparse
import csv
import json
import math
import os
import random
import re
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

LENGTHS = ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"]
RADIUS_M, SEPARATION_M = 0.08, 0.363


class Log:
    """The tables of a session, which changes alter in place."""

    def __init__(self, folder):
        self.manifest = (folder / "dataset.toml").read_text()
        self.tables = {}
        for name in ("odometry", "truth"):
            rows = list(csv.reader((folder / f"{name}.csv").open()))
            self.tables[name] = (rows[0], rows[1:])

    def rows(self, name):
        return self.tables[name][1]

    def runs(self, name):
        runs = {}
        for row in self.rows(name):
            runs.setdefault(row[0], []).append(row)
        return runs

    def write(self, folder):
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "dataset.toml").write_text(self.manifest)
        for name, (header, rows) in self.tables.items():
            with (folder / f"{name}.csv").open("w", newline="") as file:
                csv.writer(file).writerows([header, *rows])


def noise(share):
    def change(log, draws):
        for row in log.rows("odometry"):
            row[2:4] = [f"{float(of) * (1 + share * draws.gauss(0, 1)):.6f}" for of in row[2:4]]

    return change


def late_run(by_s):
    def change(log, draws):
        late = draws.choice(list(log.runs("truth")))
        for row in log.rows("truth"):
            row[1] = f"{float(row[1]) + by_s * (row[0] == late):.6f}"
        return late, by_s

    return change


def drift(rate):
    def change(log, draws):
        starts = dict(re.findall(r'id = "([^"]+)"[^\[]*?start_s = ([\d.]+)', log.manifest))
        for row in log.rows("truth"):
            row[1] = f"{float(row[1]) * (1 + rate) + rate * float(starts.get(row[0], 0)):.7f}"

    return change


def received(mean_s):
    def change(log, draws):
        for rows in log.runs("odometry").values():
            before_s = -math.inf
            for row in rows:
                before_s = max(float(row[1]) - mean_s * math.log(1 - draws.random()), before_s + 1e-4)
                row[1] = f"{before_s:.6f}"

    return change


def every(step):
    def change(log, draws):
        header, _ = log.tables["odometry"]
        log.tables["odometry"] = (header, [row for rows in log.runs("odometry").values() for row in rows[::step]])

    return change


def counts(per_turn):
    def change(log, draws):
        offsets = [draws.random(), draws.random()]
        for row in log.rows("odometry"):
            row[2:4] = [math.floor(float(of) * per_turn / math.tau + offset) for of, offset in zip(row[2:4], offsets)]
        log.tables["odometry"] = (["run", "t_s", "left_ticks", "right_ticks"], log.rows("odometry"))
        log.manifest = re.sub(r"ticks_per_rev = .*", f"ticks_per_rev = {float(per_turn)}", log.manifest)

    return change


def cut(step):
    """Distance and angle since the last poll, cut to whole millimetres and degrees."""

    def change(log, draws):
        every(step)(log, draws)
        found = []
        for rows in log.runs("odometry").values():
            found.append([*rows[0][:2], 0, 0])
            for before, row in zip(rows, rows[1:]):
                left_m, right_m = (RADIUS_M * (float(row[k]) - float(before[k])) for k in (2, 3))
                row_s = float(row[1]) - float(before[1])
                distance_m = math.trunc(500 * (left_m + right_m)) / 1000
                turn_rad = math.radians(math.trunc(math.degrees((right_m - left_m) / SEPARATION_M)))
                found.append([*row[:2], f"{distance_m / row_s:.9f}", f"{turn_rad / row_s:.9f}"])
        log.tables["odometry"] = (["run", "t_s", "v_mps", "omega_radps"], found)

    return change


CHANGES = {
    "noise of 5 % in each speed": ("speeds", noise(0.05)),
    "noise of 10 %": ("speeds", noise(0.10)),
    "noise of 25 %": ("speeds", noise(0.25)),
    "a clock that gains 100 ppm over the session": ("speeds", drift(1e-4)),
    "a clock that gains 500 ppm over the session": ("speeds", drift(5e-4)),
    "one run 0.3 s late": ("speeds", late_run(0.3)),
    "one run 1.5 s late": ("angles", late_run(1.5)),
    "one run 5 s late": ("speeds", late_run(5.0)),
    "one run of four 5 s late": ("four-runs", late_run(5.0)),
    "received 5 ms late": ("500-ticks-a-turn", received(5e-3)),
    "received 20 ms late": ("500-ticks-a-turn", received(2e-2)),
    "radians at 50 Hz": ("angles", every(2)),
    "360 counts a turn": ("angles", counts(360)),
    "whole mm and degrees since the last poll": ("angles", cut(5)),
}


def errors(yair, folder):
    """Errors of the lengths, each with its standard deviation, relative; None where nothing is calibrated."""
    command = [yair, "calibrate", str(folder / "session"), "--method", "joint", "--json", "--quiet"]
    ran = subprocess.run(command, capture_output=True, env={**os.environ, "RAYON_NUM_THREADS": "1"})
    if ran.returncode:
        return None
    found = json.loads(ran.stdout)["methods"][0]["parameters"]
    truth = json.loads((folder / "answer.json").read_text())["geometry_m"]
    return [(found[of]["value"] / truth[of] - 1, found[of]["sigma"] / truth[of]) for of in LENGTHS]


def names(yair, folder, late):
    """Whether `check` names the run that is late, and by how much."""
    ran = subprocess.run([yair, "check", str(folder / "session"), "--json", "--quiet"], capture_output=True)
    offsets = (of for of in json.loads(ran.stdout)["problems"] if of["id"] == "clock_offset" and of["runs"] == [late[0]])
    size_s = [float(found[1]) for of in offsets if (found := re.search(r"the truth is ([\d.]+) s", of["sentence"]))]
    return len(size_s) == 1 and abs(size_s[0] - late[1]) < 0.05


def rms(values):
    return math.sqrt(sum(of * of for of in values) / max(len(values), 1))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=Path, required=True)
    parser.add_argument("--yair", nargs="+", required=True)
    parser.add_argument("--work", type=Path, required=True)
    arguments = parser.parse_args()
    cells = " | ".join("calibrated | RMS z: left, right, separation | separation off, % | run named" for _ in arguments.yair)
    print(f"| change | {cells} |\n| --- |{' ---: | --- | ---: | ---: |' * len(arguments.yair)}")
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for number, (name, (kind, change)) in enumerate(CHANGES.items()):
            logs = [log for log in sorted(arguments.logs.iterdir()) if re.sub(r"-\d{6,}$", "", log.name) == kind]
            folders, changes = [], []
            for log in logs:
                changed = Log(log / "training/session_0")
                changes.append(change(changed, random.Random(f"{name} {log.name}")))
                folders.append(arguments.work / f"{number}" / log.name)
                changed.write(folders[-1] / "session")
                (folders[-1] / "answer.json").write_text((log / "answer.json").read_text())
            row = []
            for yair in arguments.yair:
                found = [of for of in pool.map(lambda folder: errors(yair, folder), folders) if of]
                z = ", ".join(f"{rms([of[k][0] / of[k][1] for of in found]):.2f}" for k in range(3)) if found else "–"
                off = f"{100 * rms([of[2][0] for of in found]):.3f}" if found else "–"
                late = [(folder, of) for folder, of in zip(folders, changes) if of]
                named = sum(pool.map(lambda of: names(yair, *of), late))
                row.append(f"{len(found)} of {len(logs)} | {z} | {off} | {f'{named} of {len(late)}' if late else ''}")
            print(f"| {name} | {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()
