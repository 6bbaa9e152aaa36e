"""Is the simulator what it is said to be? `python check_simulator.py` prints each property with its number and fails on the first that does not hold."""
import dataclasses
import math

import mujoco
import numpy as np

from drives import PERIOD_S, REST, Program, Simulator, circles, setpoints, straight, training
from make_logs import case_of
from robot import CONTACT_TIME_S, GRAVITY_M_S2, IMPEDANCE, Robot, build, draw

PLAIN = Robot()
# Hard tyres, no rolling resistance to speak of, a castor that does not drag.
RIGID = Robot(tyre_stiffness_n_m=2e6, tyre_creep_m_s_n=1e-6, slip_stiffness=1e4, tyre_patch_m=1e-5, swivel_friction_nm=1e-5, castor_bearing_friction_nm=1e-5, castor_patch_m=1e-5)


def hold(what: str, value: float, expected: float, tolerance: float) -> None:
    """Prints a property and fails if it is off by more than the tolerance."""
    print(f"{what}: {value:.6g}, expected {expected:.6g} within {tolerance:.2g}")
    assert abs(value - expected) <= tolerance, what


def believed(robot: Robot) -> tuple[float, float]:
    return robot.wheel_radius_m, robot.hub_track_m


def dead_reckoning_error(robot: Robot, program: Program, timestep_s: float) -> tuple[np.ndarray, float]:
    """x, y and heading at the end beyond dead reckoning by the true shafts, and the distance."""
    simulator = Simulator(robot, timestep_s)
    simulator.place(0.0, 0.0, 0.0)
    record = simulator.drive(program, believed(robot))
    travel = np.diff(record.shaft_rad, axis=0) * robot.wheel_radius_m
    step, turned = travel.mean(axis=1), (travel[:, 1] - travel[:, 0]) / (robot.hub_track_m + 2 * robot.crown_offset_m)
    heading = record.pose[0, 2] + np.concatenate([[0.0], np.cumsum(turned)])
    middle = heading[:-1] + turned / 2
    dead_reckoned = np.array([np.sum(step * np.cos(middle)), np.sum(step * np.sin(middle)), heading[-1]])
    return record.pose[-1] - np.array([*record.pose[0, :2], 0.0]) - dead_reckoned, float(np.abs(step).sum())


def straight_line() -> None:
    error, length_m = dead_reckoning_error(RIGID, Program("straight", "straight", REST + straight(2.0, 0.4)), 0.002)
    hold("straight of rigid contacts: distance over radius times angle", 1 + error[0] / length_m, 1.0, 1e-3)
    hold("straight of rigid contacts: aside, m", error[1], 0.0, 1e-4)
    error, length_m = dead_reckoning_error(PLAIN, Program("straight", "straight", REST + straight(2.0, 0.4)), 0.002)
    sag = (PLAIN.body_mass_kg * GRAVITY_M_S2) * 0.4 / PLAIN.tyre_stiffness_n_m / PLAIN.wheel_radius_m
    hold("straight of the plain robot: the same, at most sag, creep and drag less", 1 + error[0] / length_m, 1.0, 1e-3 + sag)


def integrator() -> None:
    hold("integrator (0 is Euler)", build(PLAIN).opt.integrator, int(mujoco.mjtIntegrator.mjINT_EULER), 0)


def half_step() -> None:
    """The drawn step against a quarter of it, in what an odometer would miss."""
    for program in (training(np.random.default_rng(0))[i] for i in (1, 3, 7)):
        coarse, length_m = dead_reckoning_error(PLAIN, program, 0.002)
        half, _ = dead_reckoning_error(PLAIN, program, 0.001)
        fine, _ = dead_reckoning_error(PLAIN, program, 0.0005)
        for name, other in (("half", half), ("a quarter", fine)):
            hold(f"{program.name}, {length_m:.1f} m: the end moves with {name} of the step, m", float(np.hypot(*(coarse - other)[:2])), 0.0, 2e-3)
            hold(f"{program.name}: and turns, rad", float((coarse - other)[2]), 0.0, 2e-4)


def angles_stay() -> None:
    simulator = Simulator(PLAIN)
    simulator.place(0.0, 0.0, 0.0)
    record = simulator.drive(Program("straight", "straight", straight(1.0, 0.4)), believed(PLAIN))
    swivel_rad = simulator.data.qpos[simulator.swivel]
    simulator.place(0.3, 0.1, 1.0)
    hold("wheels keep their angle from run to run, rad", float(np.abs(simulator.data.qpos[simulator.shaft] - record.shaft_rad[-1]).max()), 0.0, 2e-3)
    hold("the castor keeps its angle, rad", float(simulator.data.qpos[simulator.swivel] - swivel_rad), 0.0, 0.02)


def height_m(robot: Robot) -> tuple[float, float]:
    """How far the axle's middle sinks, and the load of a drive wheel."""
    simulator = Simulator(robot)
    simulator.place(0.0, 0.0, 0.0)
    mujoco.mj_step(simulator.model, simulator.data, nstep=2000)
    force = np.zeros(6)
    mujoco.mj_contactForce(simulator.model, simulator.data, contact_of(simulator, "left_tyre"), force)
    return robot.wheel_radius_m - simulator.data.qpos[2], force[0]


def contact_of(simulator: Simulator, geom: str) -> int:
    number = simulator.model.geom(geom).id
    return next(i for i in range(simulator.data.ncon) if number in simulator.data.contact[i].geom)


def tyres() -> None:
    for payload_kg in (0.0, 8.0):
        robot = dataclasses.replace(PLAIN, tyre_stiffness_n_m=3e4, payload_kg=payload_kg)
        sag_m, load_n = height_m(robot)
        hold(f"soft tyre under {load_n:.1f} N: stiffness, N/m", load_n / sag_m, 3e4, 1.5e3)


def pulled(speed_m_s: float, force_n: float, robot: Robot) -> float:
    """Speed that the body has less than the shafts say, under a force that pulls it back."""
    simulator = Simulator(robot)
    simulator.place(0.0, 0.0, 0.0)
    data, speeds = simulator.data, []
    data.ctrl[:] = speed_m_s / robot.wheel_radius_m
    for step in range(2000):
        data.xfrc_applied[simulator.chassis] = (-force_n, 0, 0, 0, 0, 0)
        mujoco.mj_step(simulator.model, data)
        if step >= 1000:
            speeds.append(data.qvel[simulator.shaft_speed].mean() * robot.wheel_radius_m - data.qvel[0])
    return float(np.mean(speeds))


def slip() -> None:
    _, load_n = height_m(PLAIN)
    for speed_m_s in (0.2, 0.5):
        share = (pulled(speed_m_s, 6.0, PLAIN) - pulled(speed_m_s, 0.0, PLAIN)) / speed_m_s
        # Above the speed creep * load * slip stiffness (0.1 m/s) the cone's creep is the larger of the two, and the regularised one is not added.
        hold(f"slip stiffness at {speed_m_s} m/s under 6 N", 6.0 / (2 * load_n) / share, PLAIN.slip_stiffness, 0.15 * PLAIN.slip_stiffness)
    hold("creep at rest under 6 N: an artefact, m/s", pulled(0.0, 6.0, PLAIN), PLAIN.tyre_creep_m_s_n * 6.0 / 2, 0.2 * PLAIN.tyre_creep_m_s_n * 3.0)


def no_hopping() -> None:
    """Loads of robots as drawn, at the highest speed that is driven."""
    worst = 0.0
    for seed in range(8):
        robot = draw(np.random.default_rng([seed, 0]))
        simulator = Simulator(robot)
        simulator.place(0.0, 0.0, 0.0)
        simulator.drive(Program("fast", "free", [(0.6, 0.4, 2.5)]), believed(robot))
        loads, force = [], np.zeros(6)
        for _ in range(250):
            mujoco.mj_step(simulator.model, simulator.data)
            mujoco.mj_contactForce(simulator.model, simulator.data, contact_of(simulator, "left_tyre"), force)
            loads.append(force[0])
        worst = max(worst, float(np.std(loads) / np.mean(loads)))
    hold("scatter of a tyre's load at 0.6 m/s, worst of 8 robots", worst, 0.0, 0.05)


def lifting() -> None:
    """A wheel that rolls is lifted by the cone, which makes its radius grow with speed."""
    heights = []
    for speed_m_s in (0.1, 0.6):
        simulator = Simulator(PLAIN)
        simulator.place(0.0, 0.0, 0.0)
        simulator.drive(Program("straight", "straight", [(speed_m_s, 0.0, 2.0)]), believed(PLAIN))
        heights.append(float(simulator.data.qpos[2]))
    rolling_m = PLAIN.wheel_radius_m * PLAIN.friction**2 / PLAIN.slip_stiffness
    hold("lift of the axle from 0.1 to 0.6 m/s: an artefact, m", heights[1] - heights[0], 2 * CONTACT_TIME_S * rolling_m * 0.5 / PLAIN.wheel_radius_m, 5e-5)


def skid() -> None:
    """The regularisation leaves out the change of the contact's frame, so that a contact in a bend slides outwards."""
    simulator = Simulator(RIGID)
    simulator.place(0.0, 0.0, 0.0)
    record = simulator.drive(Program("circle", "circle_ccw", circles(0.5, (0.4,), 1, 1.0)), believed(RIGID))
    rows = slice(len(record.t_s) // 2, -10)
    across, v, omega = record.twist[rows, 1].mean(), record.twist[rows, 0].mean(), record.twist[rows, 2].mean()
    hold("outward slide of rigid contacts in a bend over speed times yaw rate, s", -across / (v * omega), IMPEDANCE * CONTACT_TIME_S / 2, 0.4e-3)


def play_under_braking() -> None:
    """Where the tyre is in the play of its shaft, from -0.5 (behind the hub) to 0.5: braking crosses the gap, before any reversal."""
    robot = dataclasses.replace(PLAIN, left_play_rad=0.03, right_play_rad=0.03)
    simulator = Simulator(robot)
    simulator.place(0.0, 0.0, 0.0)
    joint, place = simulator.model.joint("left_play").qposadr[0], []
    for speed_m_s, _ in setpoints(Program("stop", "free", [(0.4, 0.0, 2.0), (0.0, 0.0, 1.5), (-0.4, 0.0, 2.0)])):
        simulator.data.ctrl[:] = speed_m_s / robot.wheel_radius_m
        mujoco.mj_step(simulator.model, simulator.data, nstep=round(PERIOD_S / simulator.timestep_s))
        place.append(simulator.data.qpos[joint] / robot.left_play_rad)
    for name, row, expected in (("driving forward", 150, -0.5), ("braking", 240, 0.5), ("at rest after it", 340, 0.5), ("driving backward", 500, 0.5)):
        hold(f"the tyre in its play, {name}", place[row], expected, 0.1)


def kicks() -> None:
    """How far a castor turns the robot while it flips after a straight reversal: printed, not asked for."""
    for fault in ("nothing_built_in", "long_castor", "stiff_castor"):
        turns_mrad, ways_m = [], []
        for seed in range(2000, 2006):
            robot = case_of(fault, seed)[0].robot
            simulator = Simulator(robot)
            simulator.place(0.0, 0.0, 0.0)
            record = simulator.drive(Program("back", "free", [(0.4, 0.0, 3.0), (0.0, 0.0, 0.8), (-0.3, 0.0, 6.0)]), believed(robot))
            back = slice(round(3.8 / PERIOD_S), None)
            travel = record.shaft_rad[back] * robot.wheel_radius_m
            turned = (travel[:, 1] - travel[:, 0]) / (robot.hub_track_m + 2 * robot.crown_offset_m)
            turns_mrad.append(1e3 * float(np.ptp(record.pose[back, 2] - turned)))
            fork = np.abs(np.unwrap(record.swivel_rad[back]) - record.swivel_rad[back][0])
            ways_m.append(float(-travel.mean(axis=1)[np.argmax(fork > 2.8)] + travel.mean(axis=1)[0]) if (fork > 2.8).any() else math.nan)
        print(f"a castor flips, {fault}: within {min(ways_m):.2f} to {max(ways_m):.2f} m, and turns the robot by {min(turns_mrad):.1f} to {max(turns_mrad):.1f} mrad")


def servo_artefact() -> None:
    """What the integrator implicitfast does to a velocity servo: printed, not asked for."""
    for name, integrator_number in (("Euler", mujoco.mjtIntegrator.mjINT_EULER), ("implicitfast", mujoco.mjtIntegrator.mjINT_IMPLICITFAST)):
        simulator = Simulator(dataclasses.replace(RIGID, motor_gain_nm_s_rad=20.0))
        simulator.model.opt.integrator = integrator_number
        simulator.place(0.0, 0.0, 0.0)
        record = simulator.drive(Program("straight", "straight", REST + straight(2.0, 0.4)), believed(RIGID))
        ratio = (record.pose[-1, 0] - record.pose[0, 0]) / ((record.shaft_rad[-1] - record.shaft_rad[0]).mean() * RIGID.wheel_radius_m)
        print(f"stiff velocity servo under {name}: distance over radius times angle {ratio:.5f}")


if __name__ == "__main__":
    for check in (integrator, straight_line, half_step, angles_stay, tyres, slip, no_hopping, lifting, skid, play_under_braking, kicks, servo_artefact):
        check()
    print("the simulator is as described")
