"""What is true of a robot: the simulator's own motion less what its wheels say, regressed on its states.

`python own_physics.py --seeds 2000..2019 [--faults nothing_built_in]` drives the training runs, without instruments. Over windows of 0.1 s the motion is compared with the
midpoint rule on the true shaft angles; along (m/s), across (m/s) and yaw (rad/s) of the difference are regressed on

    geometry    v for the scale; v and omega for the heading
    mechanisms  speeds that a balance of forces gives, so that their coefficients are expected to be 1 (docs/physics-judge.md)
    the rest    the products of states that explain most of what is left, one by one

Standard errors hold whole runs together (a sandwich over runs). R2 is the share of what geometry leaves.
"""
import argparse
import dataclasses

import numpy as np

from drives import PERIOD_S, TIMESTEP_S, Record, Simulator, training
from make_logs import case_of, drive_all, seeds_of
from robot import CONTACT_TIME_S, GRAVITY_M_S2, IMPEDANCE, Robot

WINDOW = 10
# A product is kept while it explains this share of what geometry leaves.
MIN_SHARE = 0.03
MAX_PRODUCTS = 3

GEOMETRY = {"along": ("v",), "across": (), "yaw": ("v", "omega")}


STATES = ("v", "omega", "a", "alpha", "pivot", "castor lag", "left", "right", "payload")


@dataclasses.dataclass
class Windows:
    """Differences of all windows of all runs, and the states beside them."""
    run: np.ndarray
    # RMS of the fork about its line within windows of steady driving: does the castor shimmy?
    shimmy_rad: float
    error: dict[str, np.ndarray]
    states: dict[str, np.ndarray]


def windows(robot: Robot, records: list[Record]) -> Windows:
    """Cuts runs into windows; nothing reaches over a run's end."""
    runs, errors, states, wobbles = [], [], [], []
    track_m = robot.hub_track_m + 2 * robot.crown_offset_m
    for number, record in enumerate(records):
        count = (len(record.t_s) - 1) // WINDOW
        travel = np.diff(record.shaft_rad, axis=0)[: count * WINDOW].reshape(count, WINDOW, 2) * robot.wheel_radius_m
        step, turned = travel.mean(axis=2), (travel[:, :, 1] - travel[:, :, 0]) / track_m
        start, end = record.pose[: count * WINDOW : WINDOW], record.pose[WINDOW : count * WINDOW + 1 : WINDOW]
        heading = start[:, 2:3] + np.cumsum(turned, axis=1) - turned / 2
        dead_reckoned = np.stack([(step * np.cos(heading)).sum(axis=1), (step * np.sin(heading)).sum(axis=1), turned.sum(axis=1)], axis=1)
        off = (end - start - dead_reckoned) / (WINDOW * PERIOD_S)
        middle = start[:, 2] + turned.sum(axis=1) / 2
        along, across = np.cos(middle) * off[:, 0] + np.sin(middle) * off[:, 1], np.cos(middle) * off[:, 1] - np.sin(middle) * off[:, 0]
        errors.append(np.column_stack([along, across, off[:, 2]]))
        v, omega = step.sum(axis=1) / (WINDOW * PERIOD_S), turned.sum(axis=1) / (WINDOW * PERIOD_S)
        middle_row = slice(WINDOW // 2, count * WINDOW, WINDOW)
        # The pivot of the castor goes so to the chassis; the fork points there late.
        pivot = np.arctan2(omega * robot.castor_x_m, v)
        moves = np.abs(v) + np.abs(omega) > 0.02
        castor = np.where(moves, np.sin(record.swivel_rad[middle_row] - pivot), 0.0)
        left, right = record.shaft_rad[middle_row].T
        payload = np.full(count, record.program.payload_kg)
        states.append(np.column_stack([v, omega, np.gradient(v, WINDOW * PERIOD_S), np.gradient(omega, WINDOW * PERIOD_S), pivot * moves, castor, left, right, payload]))
        runs.append(np.full(count, number))
        fork = np.unwrap(record.swivel_rad)[: count * WINDOW].reshape(count, WINDOW)
        instant = np.arange(WINDOW) - (WINDOW - 1) / 2
        fork = fork - fork.mean(axis=1, keepdims=True)
        fork -= np.outer(fork @ instant / (instant @ instant), instant)
        steady = (np.abs(states[-1][:, 2]) < 0.05) & (np.abs(states[-1][:, 3]) < 0.1) & (v > 0.3)
        wobbles += list((fork[steady] ** 2).mean(axis=1))
    error, state = np.concatenate(errors), np.concatenate(states)
    return Windows(np.concatenate(runs), float(np.sqrt(np.mean(wobbles))), dict(zip(("along", "across", "yaw"), error.T)), dict(zip(STATES, state.T)))


def library(states: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The products that are tried, by name."""
    v, omega, a, alpha = (states[name] for name in ("v", "omega", "a", "alpha"))
    return {
        "v": v, "omega": omega, "|v|": np.abs(v), "|omega|": np.abs(omega), "a": a, "alpha": alpha, "|v| a": np.abs(v) * a, "|v| alpha": np.abs(v) * alpha, "|omega| a": np.abs(omega) * a,
        "|omega| alpha": np.abs(omega) * alpha, "v^2": v * v, "v |v|": v * np.abs(v), "omega^2": omega**2, "omega |omega|": omega * np.abs(omega), "v omega": v * omega, "|v| omega": np.abs(v) * omega, "v |omega|": v * np.abs(omega),
        "v^2 omega": v * v * omega, "v |v| omega": v * np.abs(v) * omega, "v omega^2": v * omega**2, "|v| omega^2": np.abs(v) * omega**2, "omega^3": omega**3, "v^3": v**3, "sign omega": np.tanh(omega / 0.05), "sign v": np.tanh(v / 0.02),
        "castor lag": states["castor lag"], "|v| castor lag": np.abs(v) * states["castor lag"], "v payload": v * states["payload"], "omega payload": omega * states["payload"],
        **{f"v {wave}({turns} {side})": v * np.__dict__[wave](turns * states[side]) for wave in ("sin", "cos") for turns in (1, 2) for side in ("left", "right")},
    }


def mechanisms(robot: Robot, states: dict[str, np.ndarray]) -> dict[str, dict[str, np.ndarray]]:
    """What each mechanism adds to each channel, from a balance of forces on a robot without payload, in m/s and rad/s."""
    v, omega, a, alpha = (states[name] for name in ("v", "omega", "a", "alpha"))
    track_m, arm_m = robot.hub_track_m + 2 * robot.crown_offset_m, -robot.body_com_x_m
    mass_kg = robot.body_mass_kg + 2 * robot.wheel_mass_kg
    wheel_n = GRAVITY_M_S2 * (robot.body_mass_kg * (1 - robot.body_com_x_m / robot.castor_x_m) / 2 + robot.wheel_mass_kg)
    # How fast each patch slides in the cone's measure, by rolling and by spin; a tangential force makes it creep by so much a newton, or by the regularised creep if
    # that is larger. The patch's spin is resisted meanwhile.
    wheels = [v + side * omega * track_m / 2 for side in (-1, 1)]
    spin = robot.friction * robot.tyre_patch_m * omega
    slides = [np.hypot(robot.friction**2 / robot.slip_stiffness * wheel, spin) + 1e-9 for wheel in wheels]
    creep = sum(np.maximum(robot.tyre_creep_m_s_n, slide / (robot.friction**2 * wheel_n)) for slide in slides) / 2
    scrub_nm = sum(robot.friction * robot.tyre_patch_m * spin * wheel_n / np.maximum(slide, robot.friction**2 * wheel_n * robot.tyre_creep_m_s_n) for slide in slides)
    turning = creep * 2 / track_m**2  # yaw rate a newton metre
    inertia = robot.body_mass_kg * ((robot.body_length_m**2 + robot.body_width_m**2) / 12 + arm_m**2) + 2 * robot.wheel_mass_kg * track_m**2 / 4
    drag_n = robot.castor_bearing_friction_nm / robot.castor_radius_m
    # The castor's patch resists its turning on the floor; a side force on the trail balances that about the swivel.
    castor_n = GRAVITY_M_S2 * robot.body_mass_kg * robot.body_com_x_m / robot.castor_x_m
    side_n = castor_n * robot.castor_friction * robot.castor_patch_m / robot.castor_trail_m * np.tanh(omega / 0.05) * np.cos(states["pivot"])
    # The cone lifts a rolling wheel, so that its radius grows with its speed (an artefact); half of the lift is radius.
    lift = CONTACT_TIME_S * robot.friction**2 / robot.slip_stiffness / robot.wheel_radius_m
    left, right = wheels
    transfer_n = mass_kg * v * omega * (robot.wheel_radius_m + robot.body_com_z_m) / track_m
    return {
        "along": {
            "tyres give to acceleration": -creep / 2 * mass_kg * a,
            "mass behind the axle flies outwards": -creep / 2 * robot.body_mass_kg * arm_m * omega**2,
            "cone lifts the wheels": lift * (left * np.abs(left) + right * np.abs(right)) / 2,
            "castor's drag": -creep / 2 * drag_n * np.cos(states["pivot"]) * np.tanh(np.hypot(v, omega * robot.castor_x_m) / 0.005),
        },
        "across": {
            "tyres give to the bend": -creep / 2 * (mass_kg * v * omega - robot.body_mass_kg * arm_m * alpha),
            "castor's patch": -creep / 2 * side_n,
            "regularisation and step": -(IMPEDANCE * CONTACT_TIME_S / 2 - TIMESTEP_S / 2) * v * omega,
        },
        "yaw": {
            # Mass behind the axle pushes the tail out; the outer tyre is pressed flatter, and lifted more.
            "balance in bends": turning * robot.body_mass_kg * arm_m * v * omega - v * transfer_n / (robot.tyre_stiffness_n_m * robot.wheel_radius_m * track_m)
            + lift * (right * np.abs(right) - left * np.abs(left)) / track_m,
            "tyres' patches scrub": -turning * scrub_nm,
            "castor's patch pushes the tail out": -turning * robot.castor_x_m * side_n,
            "tyres give to angular acceleration": -turning * inertia * alpha,
            "castor's drag": turning * drag_n * robot.castor_x_m * -np.sin(states["pivot"]) * np.tanh(np.hypot(v, omega * robot.castor_x_m) / 0.005),
        },
    }


def fit(columns: list[np.ndarray], error: np.ndarray, run: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Coefficients, standard errors with runs held together, and the sum of squares that is left."""
    design = np.column_stack(columns) if columns else np.zeros((len(error), 0))
    if not columns:
        return np.zeros(0), np.zeros(0), float(error @ error)
    coefficients, *_ = np.linalg.lstsq(design, error, rcond=None)
    left = error - design @ coefficients
    bread = np.linalg.pinv(design.T @ design)
    scores = np.array([design[run == number].T @ left[run == number] for number in np.unique(run)])
    groups = len(scores)
    covariance = bread @ (scores.T @ scores) @ bread * groups / (groups - 1)
    return coefficients, np.sqrt(np.diag(covariance)), float(left @ left)


def ordinary(channel: str, data: Windows, robot: Robot) -> np.ndarray:
    """Windows that geometry and mechanisms miss by no more than twenty robust sigma: those of a slide, a kick or a push would choose the products."""
    columns = [library(data.states)[name] for name in GEOMETRY[channel]] + list(mechanisms(robot, data.states)[channel].values())
    keep = np.ones(len(data.run), dtype=bool)
    for _ in range(3):
        coefficients, *_ = fit([column[keep] for column in columns], data.error[channel][keep], data.run[keep])
        left = data.error[channel] - np.column_stack(columns) @ coefficients
        keep = np.abs(left) < 20 * 1.4826 * np.median(np.abs(left)) + 1e-9
    return keep


def explain(channel: str, data: Windows, robot: Robot) -> list[tuple[str, float, float, float]]:
    """Term, coefficient, standard error, and the share explained with it and all before: geometry, then mechanisms, then products."""
    products, physics = library(data.states), mechanisms(robot, data.states)[channel]
    error, run, columns = data.error[channel], data.run, {**products, **physics}
    keep = ordinary(channel, data, robot)
    error, run, columns = error[keep], run[keep], {name: column[keep] for name, column in columns.items()}
    names = list(GEOMETRY[channel])
    _, _, base = fit([columns[name] for name in names], error, run)
    shares, left = [0.0] * len(names), base
    for name in physics:
        names.append(name)
        left = fit([columns[n] for n in names], error, run)[2]
        shares.append(1 - left / base)
    for _ in range(MAX_PRODUCTS):
        tried = {name: fit([columns[n] for n in [*names, name]], error, run)[2] for name in products if name not in names}
        best = min(tried, key=tried.get)
        if left - tried[best] < MIN_SHARE * base:
            break
        names.append(best)
        left = tried[best]
        shares.append(1 - left / base)
    coefficients, sigmas, _ = fit([columns[name] for name in names], error, run)
    return [(name, float(value), float(sigma), share) for name, value, sigma, share in zip(names, coefficients, sigmas, shares)]


def report(fault: str, seed: int) -> dict[str, list[tuple[str, float, float, float]]]:
    """Drives and regresses one robot, and prints it."""
    case, rng = case_of(fault, seed)
    records, _ = drive_all(case, Simulator(case.robot), training(rng), case.training_pushes, rng)
    data = windows(case.robot, records)
    found = {channel: explain(channel, data, case.robot) for channel in GEOMETRY}
    print(f"{fault}-{seed}: the fork wobbles by {1e3 * data.shimmy_rad:.1f} mrad", flush=True)
    for channel, terms in found.items():
        far = 100 * (1 - ordinary(channel, data, case.robot).mean())
        print(f"  {channel} ({far:.1f} % of the windows left out): " + ", ".join(f"{name} {value:+.3e} ± {sigma:.1e}" + (f" (R2 {share:.2f})" if share else "") for name, value, sigma, share in terms))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=seeds_of, required=True)
    parser.add_argument("--faults", default="nothing_built_in")
    arguments = parser.parse_args()
    for fault in arguments.faults.split(","):
        found = [report(fault, seed) for seed in arguments.seeds]
        print(f"{fault}: terms in at least a fifth of {len(found)} robots")
        for channel in GEOMETRY:
            chosen: dict[str, list[float]] = {}
            for robot in found:
                for name, value, sigma, share in robot[channel]:
                    chosen.setdefault(name, []).append((value, share))
            for name, pairs in sorted(chosen.items(), key=lambda item: -len(item[1])):
                if len(pairs) >= 0.2 * len(found):
                    values = [value for value, _ in pairs]
                    quartiles = np.percentile(values, [25, 50, 75])
                    print(f"  {channel} {name}: in {len(values)}, median {quartiles[1]:+.2e}, quartiles {quartiles[0]:+.2e} to {quartiles[2]:+.2e}, R2 so far {np.median([share for _, share in pairs]):.2f}", flush=True)
            print(f"  {channel}: R2 of all terms, median {np.median([robot[channel][-1][3] for robot in found]):.2f}, least {min(robot[channel][-1][3] for robot in found):.2f}", flush=True)


if __name__ == "__main__":
    main()
