"""Writes runs of the simulator as a dataset: counts of the encoders and poses of a motion capture, with what such instruments add.

Encoders give whole counts, and go on over all runs. The motion capture sees the axle's middle with white noise. Every row stands at the instant at which
it was true, unless a fault of the instrument says otherwise; nothing in the folder tells of the fault.
"""
import dataclasses
import math
import pathlib

import numpy as np

from drives import PERIOD_S, Record
from robot import Robot


@dataclasses.dataclass
class Instruments:
    """What measures. The last four are faults of the truth's recorder."""
    ticks_per_rev: int = 4096
    odometry_every: int = 2  # periods: 50 Hz
    truth_every: int = 5  # periods: 20 Hz
    sigma_xy_m: float = 0.001
    sigma_theta_rad: float = 0.002
    late_s: float = 0.0
    marker_x_m: float = 0.0
    marker_y_m: float = 0.0


@dataclasses.dataclass
class Nominal:
    """What dataset.toml says of the robot: the drawing, off by what people misread."""
    left_wheel_diameter_m: float
    right_wheel_diameter_m: float
    wheel_separation_m: float


def misread(robot: Robot, rng: np.random.Generator) -> Nominal:
    """The drawing's diameter and track, each off by at most one per cent."""
    diameter_m = round(2 * robot.wheel_radius_m * (1 + rng.uniform(-0.01, 0.01)), 4)
    return Nominal(diameter_m, diameter_m, round(robot.hub_track_m * (1 + rng.uniform(-0.01, 0.01)), 4))


def seen(record: Record, instruments: Instruments, rng: np.random.Generator) -> np.ndarray:
    """t, x, y, heading of every measurement of a run."""
    t_s = record.t_s[:: instruments.truth_every]
    # What is stamped t was seen at t - late: before the run's start the robot stood.
    pose = np.column_stack([np.interp(t_s - instruments.late_s, record.t_s, record.pose[:, axis]) for axis in range(3)])
    cos, sin = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    x = pose[:, 0] + cos * instruments.marker_x_m - sin * instruments.marker_y_m + rng.normal(0, instruments.sigma_xy_m, len(t_s))
    y = pose[:, 1] + sin * instruments.marker_x_m + cos * instruments.marker_y_m + rng.normal(0, instruments.sigma_xy_m, len(t_s))
    heading = pose[:, 2] + rng.normal(0, instruments.sigma_theta_rad, len(t_s))
    return np.column_stack([t_s, x, y, (heading + math.pi) % (2 * math.pi) - math.pi])


def write(folder: pathlib.Path, records: list[Record], starts_s: list[float], nominal: Nominal, instruments: Instruments, rng: np.random.Generator, source: str) -> None:
    """One dataset folder of these runs, whose starts stand on the session's clock."""
    folder.mkdir(parents=True, exist_ok=True)
    payloads = len({record.program.payload_kg for record in records}) > 1
    head = f"""format = 1
source = "{source}"
[robot]
left_wheel_diameter_m  = {nominal.left_wheel_diameter_m}
right_wheel_diameter_m = {nominal.right_wheel_diameter_m}
wheel_separation_m     = {nominal.wheel_separation_m}
ticks_per_rev          = {instruments.ticks_per_rev}.0
[truth]
sigma_xy_m      = {instruments.sigma_xy_m}
sigma_theta_rad = {instruments.sigma_theta_rad}
"""
    odometry, truth = ["run,t_s,left_ticks,right_ticks"], ["run,t_s,x_m,y_m,theta_rad"]
    for number, (record, start_s) in enumerate(zip(records, starts_s)):
        name = f"{number:02d}_{record.program.name}"
        head += f'[[run]]\nid = "{name}"\nprotocol = "{record.program.protocol}"\nstart_s = {start_s:.2f}\n'
        if payloads:
            head += f"payload_kg = {record.program.payload_kg:.1f}\n"
        ticks = np.floor(record.shaft_rad * instruments.ticks_per_rev / (2 * math.pi)).astype(int)
        for i in range(0, len(record.t_s), instruments.odometry_every):
            odometry.append(f"{name},{i * PERIOD_S:.2f},{ticks[i, 0]},{ticks[i, 1]}")
        truth += [f"{name},{t:.2f},{x:.4f},{y:.4f},{heading:.4f}" for t, x, y, heading in seen(record, instruments, rng)]
    (folder / "dataset.toml").write_text(head)
    (folder / "odometry.csv").write_text("\n".join(odometry) + "\n")
    (folder / "truth.csv").write_text("\n".join(truth) + "\n")
