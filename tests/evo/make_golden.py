"""Small planar paths and what evo says of them: golden.json, the TUM files and the dataset beside it.

Versions: Python 3.11, evo 1.38.1, numpy 2.4.6, scipy 1.17.1.

    python3 -m venv venv && venv/bin/pip install evo==1.38.1 numpy==2.4.6 scipy==1.17.1
    venv/bin/python make_golden.py

The references are a square, a circle, a free drive and a straight; the estimates are the same drives by wheels that are 2 and 3 % too large, with
seeded noise. The dataset `robot` has two runs; its estimates are dead-reckoned here, by the midpoint rule, with the numbers of `dataset.toml`.
"""

import json
import math
import random
from pathlib import Path

import numpy as np
from evo import EvoException, main_ape, main_rpe
from evo.core import sync
from evo.core.metrics import PoseRelation, Unit
from evo.core.trajectory import PoseTrajectory3D
from evo.tools.file_interface import read_tum_trajectory_file

HERE = Path(__file__).parent
RELATIONS = {"translation_m": PoseRelation.translation_part, "rotation_rad": PoseRelation.rotation_angle_rad}
STATISTICS = ["rmse", "mean", "median", "std", "min", "max"]
UNITS = {"f": Unit.frames, "d": Unit.degrees, "r": Unit.radians, "m": Unit.meters}
# Step, unit, all pairs, tolerance. No step is a multiple of the drives' own: rounding must not decide over a pair.
DELTAS = [
    (1, "f", False, 0.1), (7, "f", False, 0.1), (7, "f", True, 0.1), (0.53, "m", False, 0.1), (0.53, "m", True, 0.1), (0.53, "m", True, 0.05),
    (31, "d", False, 0.1), (31, "d", True, 0.1), (0.47, "r", False, 0.1), (0.47, "r", True, 0.03), (170, "d", True, 0.02),
]
# Speed, yaw rate and rows of 0.2 s.
DRIVES = {
    "square": [(0.3, 0.0, 10), (0.0, 0.7853, 10)] * 3,
    "circle": [(0.4, 0.55, 60)],
    "free": [(0.3, 0.0, 8), (0.3, 0.9, 14), (0.2, -0.7, 18), (-0.2, 0.3, 10), (0.0, -1.1, 12)],
    "straight": [(0.25, 0.0, 30)],
}


def drive(pieces, scale, noise):
    """Poses along arcs; `scale` of speed and yaw rate, `noise` of each step."""
    x, y, theta = 1.25, -0.5, 0.0
    poses = [(0.0, x, y, theta)]
    for speed, yaw_rate, count in pieces:
        for _ in range(count):
            moved, turned = 0.2 * scale[0] * speed + noise(speed), 0.2 * scale[1] * yaw_rate + noise(yaw_rate)
            chord = moved if turned == 0 else moved * math.sin(turned / 2) / (turned / 2)
            x, y = x + chord * math.cos(theta + turned / 2), y + chord * math.sin(theta + turned / 2)
            theta += turned
            poses.append((0.2 * len(poses), x, y, theta))
    return poses


def write_tum(path, poses):
    rows = (f"{t:.1f} {x:.6f} {y:.6f} 0 0 0 {math.sin(theta / 2):.9f} {math.cos(theta / 2):.9f}\n" for t, x, y, theta in poses)
    path.write_text("".join(rows))


def statistics(metric, reference, estimate, **options):
    """Both relations of one metric; evo's message where it has none."""
    found = {}
    for name, relation in RELATIONS.items():
        pair = sync.associate_trajectories(reference, estimate)
        try:
            result = metric(*pair, pose_relation=relation, **options)
        except EvoException as error:
            return {"refused": str(error)}
        found[name] = {key: float(result.stats[key]) for key in STATISTICS}
    return found


def both_metrics(reference, estimate):
    ape = {name: statistics(main_ape.ape, reference, estimate, align=align) for name, align in [("none", False), ("se2", True)]}
    rpe = []
    for delta, unit, all_pairs, tolerance in DELTAS:
        options = {"delta": float(delta), "delta_unit": UNITS[unit], "all_pairs": all_pairs, "rel_delta_tol": tolerance}
        named = {"delta": delta, "unit": unit, "all_pairs": all_pairs, "tolerance": tolerance}
        rpe.append(named | statistics(main_rpe.rpe, reference, estimate, **options))
    return {"ape": ape, "rpe": rpe}


def trajectory(poses):
    quaternions = [(math.cos(theta / 2), 0, 0, math.sin(theta / 2)) for _, _, _, theta in poses]
    return PoseTrajectory3D(np.array([(x, y, 0.0) for _, x, y, _ in poses]), np.array(quaternions), np.array([pose[0] for pose in poses]))


def dataset(folder):
    """A dataset of two runs, and evo's numbers of its dead reckoning by the nominal robot."""
    diameter, separation, ticks = 0.15, 0.3, 4096.0
    toml = f"format = 1\n[robot]\nleft_wheel_diameter_m = {diameter}\nright_wheel_diameter_m = {diameter}\nwheel_separation_m = {separation}\nticks_per_rev = {ticks}\n"
    odometry, truth, found = "run,t_s,left_ticks,right_ticks\n", "run,t_s,x_m,y_m,theta_rad\n", {}
    for run in ["square", "free"]:
        toml += f'[[run]]\nid = "{run}"\n'
        reference, dead_reckoned, left_m, right_m, before = [], [], 0.0, 0.0, None
        true = drive(DRIVES[run], (1.0, 1.0), lambda _: 0.0)
        x, y, theta = (float(f"{value:.6f}") for value in true[0][1:])
        for row, pose in enumerate(true):
            if row > 0:
                moved = math.hypot(pose[1] - true[row - 1][1], pose[2] - true[row - 1][2])
                ahead = math.cos(true[row - 1][3]) * (pose[1] - true[row - 1][1]) + math.sin(true[row - 1][3]) * (pose[2] - true[row - 1][2])
                moved, turned = math.copysign(moved, ahead), pose[3] - true[row - 1][3]
                left_m, right_m = left_m + 0.985 * (moved - 0.153 * turned), right_m + 0.99 * (moved + 0.153 * turned)
            counts = [round(metres / (math.pi * diameter) * ticks) for metres in (left_m, right_m)]
            if before is not None:
                left, right = (math.pi * diameter / ticks * (now - last) for now, last in zip(counts, before))
                turned = (right - left) / separation
                x, y = x + (left + right) / 2 * math.cos(theta + turned / 2), y + (left + right) / 2 * math.sin(theta + turned / 2)
                theta += turned
            before = counts
            odometry += f"{run},{pose[0]:.1f},{counts[0]},{counts[1]}\n"
            if row % 2 == 0:
                truth += f"{run},{pose[0]:.1f},{pose[1]:.6f},{pose[2]:.6f},{pose[3]:.6f}\n"
                reference.append(tuple(float(text) for text in truth.splitlines()[-1].split(",")[1:]))
                dead_reckoned.append((float(f"{pose[0]:.1f}"), x, y, theta))
        found[run] = both_metrics(trajectory(reference), trajectory(dead_reckoned))
    folder.mkdir(exist_ok=True)
    for name, text in [("dataset.toml", toml), ("odometry.csv", odometry), ("truth.csv", truth)]:
        (folder / name).write_text(text)
    return found


golden = {"evo": "1.38.1", "paths": {}}
for number, (name, pieces) in enumerate(DRIVES.items()):
    source = random.Random(number)
    # The straight stays one: evo's alignment in space has no rank there.
    noise = (lambda _: 0.0) if name == "straight" else (lambda rate: source.gauss(0, 0.002) if rate else 0.0)
    write_tum(HERE / f"{name}.truth.tum", drive(pieces, (1.0, 1.0), lambda _: 0.0))
    write_tum(HERE / f"{name}.odometry.tum", drive(pieces, (1.02, 1.03), noise))
    files = (HERE / f"{name}.truth.tum", HERE / f"{name}.odometry.tum")
    golden["paths"][name] = both_metrics(*(read_tum_trajectory_file(str(file)) for file in files))
golden["robot"] = dataset(HERE / "robot")
(HERE / "golden.json").write_text(json.dumps(golden, indent=None, separators=(",", ":")).replace('},"', '},\n"').replace('},{', '},\n{') + "\n")
