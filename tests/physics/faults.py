"""Fourteen faults, and the robot that has none: what is built otherwise, and which causes of the catalogue count as right.

A fault changes a shape, a joint, a mass, the friction, the ground, or the recorder of the truth; its size is drawn from the seed. `right` was written down
from the physics before any of these logs was diagnosed, and names as well what docs/effects.md calls the same trace on every path.
"""
import dataclasses
import math
from collections.abc import Callable

import numpy as np

from drives import Push
from robot import GRAVITY_M_S2, Patch, Robot, Sill
from write_log import Instruments


# What is true of every robot, with what no log tells from it.
OWN = ("lateral_skid", "slip_acceleration", "truth_latency", "castor_drag")


@dataclasses.dataclass
class Case:
    """A robot, what measures it and what happens to it."""
    robot: Robot
    instruments: Instruments
    # Runs of odd number carry this.
    payload_kg: float = 0.0
    payload_y_m: float = 0.0
    training_pushes: list[Push] = dataclasses.field(default_factory=list)
    held_out_pushes: list[Push] = dataclasses.field(default_factory=list)
    # What the fault's size is, for people.
    size: dict[str, float] = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True)
class Fault:
    """A fault and its right causes."""
    name: str
    changes: str
    right: tuple[str, ...]
    why: str
    apply: Callable[[Case, np.random.Generator], None]


def off_centre_wheel(case: Case, rng: np.random.Generator) -> None:
    for side in (["left"], ["right"], ["left", "right"])[rng.integers(3)]:
        size = rng.uniform(0.003, 0.010)
        setattr(case.robot, f"{side}_axis_offset_m", size * case.robot.wheel_radius_m)
        case.size[f"{side}_offset_over_radius"] = size


def oval_wheel(case: Case, rng: np.random.Generator) -> None:
    for side in (["left"], ["right"], ["left", "right"])[rng.integers(3)]:
        size = rng.uniform(0.003, 0.010)
        setattr(case.robot, f"{side}_oval", size)
        case.size[f"{side}_oval"] = size


def shaft_play(case: Case, rng: np.random.Generator) -> None:
    for side in (["left"], ["right"], ["left", "right"])[rng.integers(3)]:
        gap_m = rng.uniform(0.001, 0.003)
        setattr(case.robot, f"{side}_play_rad", gap_m / case.robot.wheel_radius_m)
        case.size[f"{side}_gap_m"] = gap_m


def load_the_castor(robot: Robot, share: float) -> None:
    """Moves the body's mass back until the castor carries this share of it."""
    robot.body_com_x_m = share * robot.castor_x_m


def long_castor(case: Case, rng: np.random.Generator) -> None:
    robot = case.robot
    robot.castor_trail_m = rng.uniform(0.05, 0.08)
    robot.friction, robot.castor_friction = rng.uniform(0.30, 0.42), rng.uniform(0.6, 0.8)
    load_the_castor(robot, rng.uniform(0.32, 0.42))
    case.size = {"trail_m": robot.castor_trail_m, "floor_friction": robot.friction, "load_share": robot.body_com_x_m / robot.castor_x_m}


def stiff_castor(case: Case, rng: np.random.Generator) -> None:
    robot = case.robot
    robot.swivel_friction_nm = rng.uniform(0.1, 0.3)
    robot.castor_bearing_friction_nm = rng.uniform(0.1, 0.3)
    robot.friction, robot.castor_friction = rng.uniform(0.40, 0.55), rng.uniform(0.6, 0.8)
    load_the_castor(robot, rng.uniform(0.30, 0.40))
    case.size = {"swivel_friction_nm": robot.swivel_friction_nm, "bearing_friction_nm": robot.castor_bearing_friction_nm, "floor_friction": robot.friction}


def payload_soft_tyres(case: Case, rng: np.random.Generator) -> None:
    case.robot.tyre_stiffness_n_m = rng.uniform(2.0e4, 5.0e4)
    case.payload_kg = round(case.robot.body_mass_kg * rng.uniform(0.7, 1.3), 1)
    case.payload_y_m = rng.uniform(-0.1, 0.1) * case.robot.hub_track_m
    case.size = {"tyre_stiffness_n_m": case.robot.tyre_stiffness_n_m, "payload_kg": case.payload_kg, "payload_y_m": case.payload_y_m}


def ice(case: Case, rng: np.random.Generator) -> None:
    case.robot.friction = rng.uniform(0.05, 0.09)
    case.robot.castor_friction = case.robot.friction
    # Ice takes the grip and leaves the tyre's slope: or else a wheel would slip at a touch.
    case.robot.slip_stiffness = 15.0
    case.size = {"friction": case.robot.friction}


def toe(case: Case, rng: np.random.Generator) -> None:
    size = rng.choice([-1, 1]) * math.radians(rng.uniform(0.6, 2.5))
    case.robot.left_toe_rad = case.robot.right_toe_rad = size
    case.size = {"toe_rad": size}


def high_centre_of_mass(case: Case, rng: np.random.Generator) -> None:
    robot = case.robot
    robot.body_com_z_m = rng.uniform(0.7, 1.0) * robot.hub_track_m
    robot.tyre_stiffness_n_m = rng.uniform(4.0e3, 8.0e3) * robot.body_mass_kg / 8.0
    case.size = {"com_above_axle_m": robot.body_com_z_m, "tyre_stiffness_n_m": robot.tyre_stiffness_n_m}


def slippery_patch(case: Case, rng: np.random.Generator) -> None:
    x, y = rng.uniform(1.1, 1.4), rng.uniform(-0.5, -0.2)
    case.robot.patch = Patch(x, x + 0.8, y, y + 0.7, rng.uniform(0.01, 0.03))
    case.size = {"friction": case.robot.patch.friction}


def oblique_sill(case: Case, rng: np.random.Generator) -> None:
    yaw = math.pi / 2 + rng.choice([-1, 1]) * rng.uniform(0.3, 0.7)
    case.robot.sill = Sill(rng.uniform(0.8, 1.1), 0.0, yaw, rng.uniform(0.005, 0.010))
    case.size = {"height_m": case.robot.sill.height_m, "obliquity_rad": abs(yaw - math.pi / 2)}


def push(run: int, end_s: float, case: Case, rng: np.random.Generator) -> Push:
    """A push a little stronger than the floor holds, aside and about the vertical."""
    robot = case.robot
    force_n = rng.uniform(1.3, 1.7) * robot.friction * robot.body_mass_kg * GRAVITY_M_S2
    direction = rng.uniform(-math.pi, math.pi)
    torque_nm = rng.uniform(-0.3, 0.3) * force_n * robot.hub_track_m
    return Push(run, rng.uniform(6.0, end_s), rng.uniform(0.15, 0.25), force_n * math.cos(direction), force_n * math.sin(direction), torque_nm)


def pushed(case: Case, rng: np.random.Generator) -> None:
    runs = rng.choice(8, size=2, replace=False)
    case.training_pushes = [push(int(run), 18.0, case, rng) for run in runs]
    case.held_out_pushes = []
    case.size = {"pushes": 2.0}


def late_truth(case: Case, rng: np.random.Generator) -> None:
    case.instruments.late_s = rng.uniform(0.03, 0.12)
    case.size = {"late_s": case.instruments.late_s}


def marker_offset(case: Case, rng: np.random.Generator) -> None:
    case.instruments.marker_x_m, case.instruments.marker_y_m = rng.uniform(0.02, 0.06, 2) * rng.choice([-1, 1], 2)
    case.size = {"marker_x_m": case.instruments.marker_x_m, "marker_y_m": case.instruments.marker_y_m}


FAULTS = [
    Fault("nothing_built_in", "nothing", (), "only what every robot has: creep, scrub of the patches, a castor", lambda case, rng: None),
    Fault("off_centre_wheel", "shape: the tyre's centre lies beside the hinge", ("wheel_eccentricity", "encoder_cycle"),
          "the radius varies once a turn; an encoder that errs once a turn leaves exactly the same", off_centre_wheel),
    Fault("oval_wheel", "shape: the tyre is an ellipse", ("encoder_cycle",), "the radius varies twice a turn, as encoder_cycle with two cycles has it", oval_wheel),
    Fault("shaft_play", "joint: between hub and tyre, about the axle", ("backlash",), "a reversal turns the hub and not the tyre", shaft_play),
    Fault("long_castor", "shape, mass, friction: a long trail and a loaded castor on a smooth floor", ("castor_kick",),
          "after a reversal the fork swings through a long arc and pushes the tail aside", long_castor),
    Fault("stiff_castor", "joint, mass, friction: a swivel and a bearing that resist, a loaded castor", ("castor_kick", "castor_drag"),
          "the castor points late where the robot goes, and resists as it rolls", stiff_castor),
    Fault("payload_soft_tyres", "mass, stiffness: a load in every second run", ("payload_compression",), "the load presses the tyres flatter", payload_soft_tyres),
    Fault("ice", "friction: of the whole floor", ("traction_loss", "slip_acceleration"),
          "wheels slide where they are accelerated; where the floor holds nearly all that is slip in proportion to acceleration", ice),
    Fault("toe", "joint: the axle stands askew under the chassis", ("truth_yaw",), "the chassis drives a little sideways on every path; so does one whose instrument is turned", toe),
    Fault("high_centre_of_mass", "mass, stiffness: high above soft tyres", ("load_transfer",), "in bends the outer tyre is pressed flatter", high_centre_of_mass),
    Fault("slippery_patch", "friction: of a part of the floor", ("traction_loss", "robot_displaced"),
          "wheels slide where they are accelerated on it; few times, so that it is as well an unknown motion", slippery_patch),
    Fault("oblique_sill", "ground: a bar that one wheel crosses after the other", ("bumps",), "a wheel's way over the bar is longer than the robot's", oblique_sill),
    Fault("pushed", "force: by a hand, in two runs", ("robot_displaced", "truth_jump"), "the robot moves as its wheels do not say; the instrument may have jumped instead", pushed),
    Fault("late_truth", "recorder: its stamps are late", ("truth_latency", "slip_acceleration"), "a lag of both wheels is the same delay exactly", late_truth),
    Fault("marker_offset", "recorder: the marker is not over the axle's middle", ("truth_lever_arm",), "what is seen goes round the axle's middle", marker_offset),
]
BY_NAME = {fault.name: fault for fault in FAULTS}
