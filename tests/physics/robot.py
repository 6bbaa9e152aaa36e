"""A differential drive with a castor as rigid bodies: the MuJoCo model made from shapes, joints, masses and friction.

Nothing here knows odometry. The chassis hangs on a free joint with its origin at the middle of the axle; each wheel is an
ellipsoid on a hinge that a motor turns under velocity control; a fork with a wheel trails behind a vertical hinge.

Contacts are MuJoCo's regularised ones. Their compliance is set so that it stands for a tyre: a tyre of stiffness K is pressed in by N/K, and creeps at
c * F under a tangential force F, at rest as well (an artefact). With the constraint's R = (1 - d)/d * w, k = 1/(d tc)^2 and b = 2/(d tc) that is K = k d/R and
c = R/(b impratio); w is the inverse mass that MuJoCo assumes of a contact's bodies. It is set by hand, or a payload would stiffen the tyres that it presses.

Friction resists sliding (coefficient mu), spin (mu * patch) and rolling (rho, a length) in one elliptic cone. A wheel that rolls is at the cone's edge, so that a
tangential force makes it creep by the share F/(N C) of its distance, with C = radius * mu^2 / rho: the slip stiffness of a tyre, which is why rho is set by it.
Of the two creeps the larger one is seen. The cone lifts a rolling wheel by 2 tc rho times its speed (an artefact of convex contacts, that makes its radius grow with speed):
tyres are soft enough, and tc short enough, that this stays below what the load presses in, or else wheels would hop.
"""
import dataclasses
import math

import mujoco
import numpy as np

GRAVITY_M_S2 = 9.81
# Impedance and time constant of every contact. K and c of a tyre follow from w and impratio.
IMPEDANCE = 0.9
CONTACT_TIME_S = 0.004


@dataclasses.dataclass
class Sill:
    """A bar on the floor, whose cross-section is a half circle."""
    x_m: float
    y_m: float
    yaw_rad: float
    height_m: float
    half_length_m: float = 4.0


@dataclasses.dataclass
class Patch:
    """A rectangle of the floor with another friction."""
    x_min_m: float
    x_max_m: float
    y_min_m: float
    y_max_m: float
    friction: float


@dataclasses.dataclass
class Robot:
    """Everything that is built. Fields named left_ and right_ are what a fault changes on one side."""
    wheel_radius_m: float = 0.075
    hub_track_m: float = 0.33
    # The tyre's crown stands so far outside of the hub's middle plane, on either side.
    crown_offset_m: float = 0.00165
    wheel_half_width_m: float = 0.015
    wheel_mass_kg: float = 0.35
    body_mass_kg: float = 8.0
    body_com_x_m: float = -0.05
    body_com_y_m: float = 0.0
    body_com_z_m: float = 0.03
    body_length_m: float = 0.40
    body_width_m: float = 0.28
    castor_x_m: float = -0.22
    castor_trail_m: float = 0.025
    castor_radius_m: float = 0.03
    castor_mass_kg: float = 0.08
    castor_stiffness_n_m: float = 2.0e5
    swivel_friction_nm: float = 0.004
    castor_bearing_friction_nm: float = 0.004
    castor_patch_m: float = 0.001
    tyre_stiffness_n_m: float = 0.9e5
    tyre_creep_m_s_n: float = 1.0e-4
    # Spin of the patch resists by friction times this length.
    tyre_patch_m: float = 0.002
    slip_stiffness: float = 30.0
    friction: float = 0.7
    castor_friction: float = 0.5
    rotor_inertia_kg_m2: float = 0.004
    motor_gain_nm_s_rad: float = 1.5
    motor_limit_nm: float = 6.0
    # Faults, all nothing in a robot that is as drawn.
    left_axis_offset_m: float = 0.0
    right_axis_offset_m: float = 0.0
    left_oval: float = 0.0
    right_oval: float = 0.0
    left_toe_rad: float = 0.0
    right_toe_rad: float = 0.0
    left_play_rad: float = 0.0
    right_play_rad: float = 0.0
    payload_kg: float = 0.0
    payload_x_m: float = 0.0
    payload_y_m: float = 0.0
    payload_z_m: float = 0.10
    sill: Sill | None = None
    patch: Patch | None = None


def draw(rng: np.random.Generator) -> Robot:
    """A robot of ordinary make: sizes unlike those of YAIR, on which the simulator of the workspace is modelled."""
    radius = rng.uniform(0.05, 0.10)
    track = rng.uniform(0.25, 0.45)
    mass = 8.0 * (track / 0.33) ** 2 * rng.uniform(0.8, 1.25)
    length = track * rng.uniform(1.1, 1.4)
    return Robot(
        wheel_radius_m=radius,
        hub_track_m=track,
        crown_offset_m=0.005 * track,
        wheel_half_width_m=0.2 * radius,
        wheel_mass_kg=0.35 * (radius / 0.075) ** 2,
        body_mass_kg=mass,
        body_com_x_m=-rng.uniform(0.10, 0.20) * track,
        body_com_y_m=rng.uniform(-0.02, 0.02) * track,
        body_com_z_m=rng.uniform(0.0, 0.10) * track,
        body_length_m=length,
        body_width_m=0.85 * track,
        castor_x_m=-0.55 * length,
        castor_trail_m=rng.uniform(0.020, 0.035),
        castor_radius_m=rng.uniform(0.025, 0.04),
        tyre_stiffness_n_m=rng.uniform(0.6e5, 1.2e5),
        tyre_creep_m_s_n=rng.uniform(0.5e-4, 1.5e-4),
        tyre_patch_m=rng.uniform(0.001, 0.003),
        slip_stiffness=rng.uniform(20.0, 40.0),
        friction=rng.uniform(0.5, 0.8),
        castor_friction=rng.uniform(0.4, 0.7),
        swivel_friction_nm=rng.uniform(0.002, 0.006),
        castor_bearing_friction_nm=rng.uniform(0.002, 0.006),
    )


def box_inertia(mass_kg: float, x_m: float, y_m: float, z_m: float) -> str:
    """Diagonal moments of inertia of a box, as MJCF writes them."""
    moments = (y_m**2 + z_m**2, x_m**2 + z_m**2, x_m**2 + y_m**2)
    return " ".join(f"{mass_kg * moment / 12:.9g}" for moment in moments)


def tyre_friction(robot: Robot, friction: float) -> str:
    """Sliding, spin and rolling of a tyre on a floor of this friction."""
    return f"{friction:.9g} {friction * robot.tyre_patch_m:.9g} {robot.wheel_radius_m * friction**2 / robot.slip_stiffness:.9g}"


def wheel_xml(robot: Robot, side: str) -> str:
    """A hub on the motor's hinge, and on it the tyre: stiffly, or with play about the same axis."""
    sign = 1.0 if side == "left" else -1.0
    radius, half_width, mass = robot.wheel_radius_m, robot.wheel_half_width_m, robot.wheel_mass_kg
    toe_rad = robot.left_toe_rad if side == "left" else robot.right_toe_rad
    play_rad = robot.left_play_rad if side == "left" else robot.right_play_rad
    offset_m = robot.left_axis_offset_m if side == "left" else robot.right_axis_offset_m
    oval = robot.left_oval if side == "left" else robot.right_oval
    tyre = (
        f'<inertial pos="0 0 0" mass="{mass}" diaginertia="{0.3 * mass * radius**2:.9g} {0.5 * mass * radius**2:.9g} {0.3 * mass * radius**2:.9g}"/>'
        f'<geom name="{side}_tyre" type="ellipsoid" size="{radius * (1 + oval):.9g} {half_width:.9g} {radius * (1 - oval):.9g}"'
        f' pos="{offset_m:.9g} {sign * robot.crown_offset_m:.9g} 0" friction="{tyre_friction(robot, robot.friction)}" condim="6"'
        f' solref="{CONTACT_TIME_S} 1" solimp="{IMPEDANCE} {IMPEDANCE} 0.001 0.5 2"/>'
    )
    hinge = f'<joint name="{side}_shaft" type="hinge" axis="0 1 0" armature="{robot.rotor_inertia_kg_m2}" damping="0.002"/>'
    if play_rad > 0.0:
        hub = '<inertial pos="0 0 0" mass="0.05" diaginertia="2e-5 4e-5 2e-5"/>'
        tyre = (
            f'{hub}<body name="{side}_wheel"><joint name="{side}_play" type="hinge" axis="0 1 0" limited="true" damping="0.01"'
            f' range="{-play_rad / 2:.9g} {play_rad / 2:.9g}" solreflimit="0.004 1" solimplimit="0.99 0.999 0.0001"/>{tyre}</body>'
        )
    name = f"{side}_hub" if play_rad > 0.0 else f"{side}_wheel"
    return f'<body name="{name}" pos="0 {sign * robot.hub_track_m / 2:.9g} 0" euler="0 0 {toe_rad:.9g}">{hinge}{tyre}</body>'


def mjcf(robot: Robot, timestep_s: float, tyre_impratio: float) -> str:
    """The whole model as MJCF, in SI units and radians."""
    payload = ""
    if robot.payload_kg > 0.0:
        payload = (
            f'<body pos="{robot.payload_x_m} {robot.payload_y_m} {robot.payload_z_m}"><inertial pos="0 0 0" mass="{robot.payload_kg}"'
            f' diaginertia="{box_inertia(robot.payload_kg, 0.2, 0.2, 0.1)}"/></body>'
        )
    sill = ""
    if robot.sill is not None:
        bar = robot.sill
        # A cylinder lies on its side, sunk by half of its diameter.
        sill = (
            f'<geom name="sill" type="capsule" size="{bar.height_m} {bar.half_length_m}" pos="{bar.x_m} {bar.y_m} 0"'
            f' euler="{-math.pi / 2} 0 {bar.yaw_rad - math.pi / 2}" friction="1e-5 1e-7 1e-7" condim="1"'
            f' solref="{CONTACT_TIME_S} 1" solimp="{IMPEDANCE} {IMPEDANCE} 0.001 0.5 2"/>'
        )
    castor_z_m = robot.castor_radius_m - robot.wheel_radius_m
    contact = f'solref="{CONTACT_TIME_S} 1" solimp="{IMPEDANCE} {IMPEDANCE} 0.001 0.5 2"'
    castor_inertia = f"{0.4 * robot.castor_mass_kg * robot.castor_radius_m**2:.9g}"
    return f"""
<mujoco model="differential drive">
  <compiler angle="radian" eulerseq="XYZ" inertiafromgeom="false"/>
  <option timestep="{timestep_s}" integrator="Euler" cone="elliptic" impratio="{tyre_impratio:.9g}" gravity="0 0 -{GRAVITY_M_S2}" tolerance="1e-8" jacobian="dense"><flag eulerdamp="disable"/></option>
  <worldbody>
    <geom name="floor" type="plane" size="50 50 1" friction="1e-5 1e-7 1e-7" condim="1" {contact}/>
    {sill}
    <body name="chassis" pos="0 0 {robot.wheel_radius_m}">
      <freejoint name="chassis"/>
      <inertial pos="{robot.body_com_x_m:.9g} {robot.body_com_y_m:.9g} {robot.body_com_z_m:.9g}" mass="{robot.body_mass_kg:.9g}"
        diaginertia="{box_inertia(robot.body_mass_kg, robot.body_length_m, robot.body_width_m, 0.12)}"/>
      {payload}
      {wheel_xml(robot, "left")}
      {wheel_xml(robot, "right")}
      <body name="fork" pos="{robot.castor_x_m:.9g} 0 {castor_z_m:.9g}">
        <joint name="swivel" type="hinge" axis="0 0 1" frictionloss="{robot.swivel_friction_nm}" damping="0.0005" armature="1e-5"/>
        <inertial pos="{-robot.castor_trail_m / 2:.9g} 0 0.03" mass="0.1" diaginertia="2e-5 2e-5 2e-5"/>
        <body name="castor" pos="{-robot.castor_trail_m:.9g} 0 0">
          <joint name="castor" type="hinge" axis="0 1 0" frictionloss="{robot.castor_bearing_friction_nm}" damping="0.0001" armature="1e-6"/>
          <inertial pos="0 0 0" mass="{robot.castor_mass_kg}" diaginertia="{castor_inertia} {castor_inertia} {castor_inertia}"/>
          <geom name="castor" type="sphere" size="{robot.castor_radius_m}" friction="{robot.castor_friction} {robot.castor_friction * robot.castor_patch_m:.9g} 0.0001" condim="4" {contact}/>
        </body>
      </body>
    </body>
  </worldbody>
  <contact>
    <exclude body1="left_wheel" body2="chassis"/><exclude body1="right_wheel" body2="chassis"/>
    <exclude body1="left_wheel" body2="castor"/><exclude body1="right_wheel" body2="castor"/><exclude body1="chassis" body2="castor"/>
  </contact>
  <actuator>
    <velocity name="left_motor" joint="left_shaft" kv="{robot.motor_gain_nm_s_rad}" forcelimited="true" forcerange="-{robot.motor_limit_nm} {robot.motor_limit_nm}"/>
    <velocity name="right_motor" joint="right_shaft" kv="{robot.motor_gain_nm_s_rad}" forcelimited="true" forcerange="-{robot.motor_limit_nm} {robot.motor_limit_nm}"/>
  </actuator>
</mujoco>"""


def build(robot: Robot, timestep_s: float = 0.001) -> mujoco.MjModel:
    """The compiled model, its contacts as compliant as the robot's tyres and castor are to be."""
    k_d = IMPEDANCE / (IMPEDANCE * CONTACT_TIME_S) ** 2
    b = 2.0 / (IMPEDANCE * CONTACT_TIME_S)
    tyre_r = k_d / robot.tyre_stiffness_n_m
    impratio = tyre_r / (b * robot.tyre_creep_m_s_n)
    model = mujoco.MjModel.from_xml_string(mjcf(robot, timestep_s, impratio))
    weight = IMPEDANCE / (1.0 - IMPEDANCE)
    for name, stiffness in (("left_wheel", robot.tyre_stiffness_n_m), ("right_wheel", robot.tyre_stiffness_n_m), ("castor", robot.castor_stiffness_n_m)):
        model.body_invweight0[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)][0] = k_d / stiffness * weight
    return model
