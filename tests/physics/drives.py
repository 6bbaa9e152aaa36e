"""What is driven, and the simulation of it: programs of speeds and yaw rates as an engineer drives to calibrate.

A program is a list of segments (speed, yaw rate, duration), which the robot's controller slews to at a limited acceleration and turns into wheel
speeds by the geometry that it believes. Training runs and held-out runs are of other shapes and speeds. A robot is set down anew before each run;
its wheels and its castor keep their angles.
"""
import dataclasses
import math

import mujoco
import numpy as np

from robot import Robot, build

TIMESTEP_S = 0.002
# The controller's period, and that of every record made here. Writers take every n-th.
PERIOD_S = 0.01
SETTLE_S = 0.5


@dataclasses.dataclass
class Program:
    """One run."""
    name: str
    protocol: str
    segments: list[tuple[float, float, float]]
    accel_m_s2: float = 0.6
    yaw_accel_rad_s2: float = 2.0
    payload_kg: float = 0.0


@dataclasses.dataclass
class Push:
    """A hand that pushes the chassis for a while, in the room's axes."""
    run: int
    start_s: float
    duration_s: float
    force_x_n: float
    force_y_n: float
    torque_nm: float


@dataclasses.dataclass
class Record:
    """A run as the simulator knows it, a row a period."""
    program: Program
    t_s: np.ndarray
    command: np.ndarray  # speed, yaw rate
    shaft_rad: np.ndarray  # left, right
    shaft_rad_s: np.ndarray
    pose: np.ndarray  # x, y, yaw (unwrapped) of the axle's middle
    twist: np.ndarray  # along, across, yaw rate of the axle's middle in the body's frame
    swivel_rad: np.ndarray


def straight(length_m: float, speed_m_s: float) -> list[tuple[float, float, float]]:
    """A straight of this length, whose slewing is allowed for."""
    sign = math.copysign(1.0, length_m * speed_m_s)
    return [(sign * abs(speed_m_s), 0.0, abs(length_m / speed_m_s)), (0.0, 0.0, 0.6)]


def turn(angle_rad: float, rate_rad_s: float) -> list[tuple[float, float, float]]:
    """A turn on the spot."""
    return [(0.0, math.copysign(rate_rad_s, angle_rad), abs(angle_rad) / rate_rad_s), (0.0, 0.0, 0.5)]


def square(side_m: float, speed_m_s: float, rate_rad_s: float, sense: int) -> list[tuple[float, float, float]]:
    """Four sides and four corners that are turned on the spot."""
    return [segment for _ in range(4) for segment in straight(side_m, speed_m_s) + turn(sense * math.pi / 2, rate_rad_s)]


def circles(radius_m: float, speeds_m_s: tuple[float, ...], sense: int, turns: float) -> list[tuple[float, float, float]]:
    """Circles of one radius, at one speed after the other."""
    return [(speed, sense * speed / radius_m, 2 * math.pi * radius_m * turns / speed) for speed in speeds_m_s]


def wander(rng: np.random.Generator, duration_s: float, speeds_m_s: tuple[float, float], rates_rad_s: tuple[float, float]) -> list[tuple[float, float, float]]:
    """Straights, bends, spins and short ways back in no order."""
    segments, total_s = [], 0.0
    while total_s < duration_s:
        kind, length_s = rng.choice(["straight", "bend", "bend", "spin", "back"]), rng.uniform(1.2, 3.0)
        speed, rate = rng.uniform(*speeds_m_s), rng.uniform(*rates_rad_s) * rng.choice([-1, 1])
        segment = {"straight": (speed, 0.0), "bend": (speed, rate), "spin": (0.0, rate), "back": (-0.7 * speed, 0.5 * rate)}[str(kind)]
        segments.append((*segment, length_s))
        total_s += length_s
    return segments + [(0.0, 0.0, 0.8)]


REST = [(0.0, 0.0, 0.8)]


def training(rng: np.random.Generator) -> list[Program]:
    """Eight runs of about half a minute."""
    there_and_back = straight(2.6, 0.35) + straight(-2.6, 0.25) + straight(2.6, 0.55) + straight(-2.6, 0.5)
    spins = turn(4 * math.pi, 0.8) + turn(-4 * math.pi, 1.5) + turn(2 * math.pi, 1.5)
    return [
        Program("straight", "straight", REST + there_and_back),
        Program("square_ccw", "square_ccw", REST + square(1.6, 0.4, 1.0, 1)),
        Program("square_cw", "square_cw", REST + square(1.6, 0.5, 1.3, -1)),
        Program("circle_ccw", "circle_ccw", REST + circles(0.6, (0.3, 0.55), 1, 1.25) + REST),
        Program("circle_cw", "circle_cw", REST + circles(0.7, (0.25, 0.5), -1, 1.0) + REST),
        Program("spin", "spin", REST + spins),
        Program("free_a", "free", REST + wander(rng, 30.0, (0.2, 0.45), (0.3, 1.0))),
        Program("free_b", "free", REST + wander(rng, 30.0, (0.3, 0.6), (0.4, 1.4)), accel_m_s2=1.0, yaw_accel_rad_s2=3.0),
    ]


def held_out(rng: np.random.Generator) -> list[Program]:
    """Four runs of other shapes: a figure of eight, a slalom, a shuttle with turns, and a wander."""
    eight = circles(0.5, (0.4,), 1, 1.0) + circles(0.5, (0.4,), -1, 1.0) + circles(0.8, (0.5,), 1, 1.0)
    slalom = [(0.45, 0.9 * (-1) ** (i // 2 + i), 1.7) for i in range(14)]
    shuttle = [s for _ in range(3) for s in straight(1.5, 0.45) + turn(math.pi, 1.1) + straight(1.2, 0.3) + turn(-math.pi / 2, 0.9)]
    return [
        Program("eight", "free", REST + eight + REST),
        Program("slalom", "free", REST + slalom + REST),
        Program("shuttle", "free", REST + shuttle),
        Program("wander", "free", REST + wander(rng, 30.0, (0.2, 0.6), (0.3, 1.3)), accel_m_s2=0.9),
    ]


def setpoints(program: Program) -> np.ndarray:
    """Speed and yaw rate of every period, slewed."""
    rows, speed, rate = [], 0.0, 0.0
    step, yaw_step = program.accel_m_s2 * PERIOD_S, program.yaw_accel_rad_s2 * PERIOD_S
    for target_speed, target_rate, duration_s in program.segments:
        for _ in range(round(duration_s / PERIOD_S)):
            speed += float(np.clip(target_speed - speed, -step, step))
            rate += float(np.clip(target_rate - rate, -yaw_step, yaw_step))
            rows.append((speed, rate))
    return np.array(rows)


class Simulator:
    """One robot through all its runs."""

    def __init__(self, robot: Robot, timestep_s: float = TIMESTEP_S):
        self.timestep_s = timestep_s
        self.data = None
        self.use(robot)

    def use(self, robot: Robot) -> None:
        """Takes another state of the same robot (a payload); joints keep their angles."""
        model = build(robot, self.timestep_s)
        data = mujoco.MjData(model)
        if self.data is not None:
            data.qpos[:] = self.data.qpos
        self.robot, self.model, self.data = robot, model, data
        self.shaft = [model.joint(f"{side}_shaft").qposadr[0] for side in ("left", "right")]
        self.shaft_speed = [model.joint(f"{side}_shaft").dofadr[0] for side in ("left", "right")]
        self.swivel = model.joint("swivel").qposadr[0]
        self.tyres = [(model.geom(name).id, model.geom(name).friction.copy()) for name in ("left_tyre", "right_tyre", "castor")]
        self.chassis = model.body("chassis").id

    def place(self, x_m: float, y_m: float, yaw_rad: float) -> None:
        """Sets the robot down at rest and lets it settle."""
        data = self.data
        data.qpos[:7] = (x_m, y_m, self.robot.wheel_radius_m, math.cos(yaw_rad / 2), 0, 0, math.sin(yaw_rad / 2))
        data.qvel[:] = 0.0
        data.ctrl[:] = 0.0
        mujoco.mj_forward(self.model, data)
        mujoco.mj_step(self.model, data, nstep=round(SETTLE_S / self.timestep_s))

    def friction_under_wheels(self) -> None:
        """Sets each contact's friction to that of the floor under it."""
        patch = self.robot.patch
        for geom, friction in self.tyres:
            x, y = self.data.geom_xpos[geom][:2]
            inside = patch.x_min_m < x < patch.x_max_m and patch.y_min_m < y < patch.y_max_m
            share = min(1.0, patch.friction / friction[0]) if inside else 1.0
            # Rolling goes with the square, as in robot.tyre_friction.
            self.model.geom_friction[geom] = friction * (share, share, share**2)

    def drive(self, program: Program, believed: tuple[float, float], pushes: list[Push] = []) -> Record:
        """Drives a program; `believed` is the wheel radius and the track of the controller."""
        radius_m, track_m = believed
        command = setpoints(program)
        steps = round(PERIOD_S / self.timestep_s)
        rows = np.empty((len(command) + 1, 11))
        model, data = self.model, self.data
        for i in range(len(command) + 1):
            w, x, y, z = data.qpos[3:7]
            yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
            cos, sin = math.cos(yaw), math.sin(yaw)
            vx, vy = data.qvel[0], data.qvel[1]
            # Angular speeds of a free joint are in the body's frame; the body pitches by milliradians.
            rows[i] = (*data.qpos[self.shaft], *data.qvel[self.shaft_speed], data.qpos[0], data.qpos[1], yaw, cos * vx + sin * vy, cos * vy - sin * vx, data.qvel[5], data.qpos[self.swivel])
            if i == len(command):
                break
            speed, rate = command[i]
            data.ctrl[:] = ((speed - rate * track_m / 2) / radius_m, (speed + rate * track_m / 2) / radius_m)
            if self.robot.patch is not None:
                self.friction_under_wheels()
            data.xfrc_applied[self.chassis] = 0.0
            for push in pushes:
                if push.start_s <= i * PERIOD_S < push.start_s + push.duration_s:
                    data.xfrc_applied[self.chassis] = (push.force_x_n, push.force_y_n, 0, 0, 0, push.torque_nm)
            mujoco.mj_step(model, data, nstep=steps)
        pose = rows[:, 4:7].copy()
        pose[:, 2] = np.unwrap(pose[:, 2])
        return Record(program, np.arange(len(rows)) * PERIOD_S, np.vstack([command, command[-1:]]), rows[:, 0:2].copy(), rows[:, 2:4].copy(), pose, rows[:, 7:10].copy(), rows[:, 10].copy())
