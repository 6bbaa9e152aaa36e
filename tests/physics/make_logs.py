"""Drives robots with a fault built in, and writes their logs: `python make_logs.py --out DIR --seeds 2000..2019 [--faults a,b]`.

A log is DIR/FAULT-SEED with `training` and `held_out`, two datasets of one robot, and `made.json`, which says what was built: for people and for
the table, never for the estimator. A log that is there is kept, so that an interrupted sweep goes on. Seeds below 2000 were for trying.
"""
import argparse
import dataclasses
import json
import pathlib
import time

import numpy as np

from drives import Program, Push, Simulator, held_out, training
from faults import BY_NAME, FAULTS, OWN, Case
from robot import draw
from write_log import Instruments, misread, write

# Between two runs somebody carries the robot back.
PAUSE_S = 20.0


def seeds_of(text: str) -> list[int]:
    """`3` or `2000..2019`, both ends included."""
    first, _, last = text.partition("..")
    return list(range(int(first), int(last or first) + 1))


def case_of(fault: str, seed: int) -> tuple[Case, np.random.Generator]:
    """The robot of a seed with this fault in it, and the stream of everything else. The robot is the same whatever the fault."""
    robot = draw(np.random.default_rng([seed, 0]))
    instruments = Instruments(ticks_per_rev=int(np.random.default_rng([seed, 1]).choice([2048, 4096, 8192])))
    case = Case(robot, instruments)
    BY_NAME[fault].apply(case, np.random.default_rng([seed, 2, sorted(BY_NAME).index(fault)]))
    return case, np.random.default_rng([seed, 3])


def drive_all(case: Case, simulator: Simulator, programs: list[Program], pushes: list[Push], rng: np.random.Generator):
    """All runs of a part, each begun where somebody sets the robot down."""
    robot = case.robot
    records, starts_s, clock_s = [], [], 0.0
    for number, program in enumerate(programs):
        if case.payload_kg > 0.0:
            program.payload_kg = case.payload_kg * (number % 2)
            simulator.use(dataclasses.replace(robot, payload_kg=program.payload_kg, payload_x_m=robot.body_com_x_m, payload_y_m=case.payload_y_m))
        simulator.place(rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), rng.uniform(-0.15, 0.15))
        record = simulator.drive(program, (robot.wheel_radius_m, robot.hub_track_m), [push for push in pushes if push.run == number])
        records.append(record)
        starts_s.append(clock_s)
        clock_s += float(record.t_s[-1]) + PAUSE_S
    return records, starts_s


def make(folder: pathlib.Path, fault: str, seed: int, shorter: bool = False) -> float:
    """One log. Returns the metres driven. `shorter`: five training runs at half of the rates, and two held out."""
    case, rng = case_of(fault, seed)
    simulator = Simulator(case.robot)
    nominal = misread(case.robot, np.random.default_rng([seed, 4]))
    length_m = 0.0
    for part, programs, pushes in (("training", training(rng), case.training_pushes), ("held_out", held_out(rng), case.held_out_pushes)):
        if shorter:
            programs = [programs[i] for i in ((0, 1, 3, 5, 7) if part == "training" else (0, 2))]
            case.instruments.odometry_every, case.instruments.truth_every = 5, 10
        records, starts_s = drive_all(case, simulator, programs, pushes, rng)
        write(folder / part, records, starts_s, nominal, case.instruments, np.random.default_rng([seed, 5, len(records)]), "rigid bodies in MuJoCo, tests/physics")
        length_m += sum(float(np.hypot(*np.diff(record.pose[:, :2], axis=0).T).sum()) for record in records)
    made = {"fault": fault, "seed": seed, "size": case.size, "robot": dataclasses.asdict(case.robot), "nominal": dataclasses.asdict(nominal)}
    (folder / "made.json").write_text(json.dumps(made, indent=1, default=float) + "\n")
    return length_m


def answer(folder: pathlib.Path, fault: str, seed: int) -> None:
    """What is true of a log, as `replay` reads it (crates/replay)."""
    right = list(BY_NAME[fault].right)
    said = {
        "corpus": "physics", "question": "one" if right else "null", "causes": [{"right": right}] if right else [],
        "exempt": [cause for cause in OWN if cause not in right], "seed": seed, "strata": {"fault": fault},
    }
    (folder / "answer.json").write_text(json.dumps(said, indent=1) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--seeds", type=seeds_of, required=True)
    parser.add_argument("--faults", default=",".join(fault.name for fault in FAULTS))
    parser.add_argument("--shorter", action="store_true", help="few and coarse runs, as they stand in the repository")
    arguments = parser.parse_args()
    for seed in arguments.seeds:
        for fault in arguments.faults.split(","):
            folder = arguments.out / f"{fault}-{seed:04d}"
            if (folder / "made.json").exists():
                answer(folder, fault, seed)
                continue
            started = time.perf_counter()
            length_m = make(folder, fault, seed, arguments.shorter)
            answer(folder, fault, seed)
            print(f"{folder.name}: {length_m:.1f} m in {time.perf_counter() - started:.1f} s", flush=True)


if __name__ == "__main__":
    main()
