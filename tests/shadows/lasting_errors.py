"""Errors of an instrument that last, as states of a filter: white noise, a Gauss-Markov error and a lag of first order.

An experiment beside `estimation`, which thins measurements until their errors are independent (docs/one-model.md). Every
measurement of every run is used. The state is the robot's pose, the pose behind the instrument's lag, and the lasting error;
geometry, noise, time constants and a delay are fitted by maximum likelihood, with Fisher scoring from innovations and their
covariances (Harvey 1989, eq. 3.4.69), the derivatives by differences.

    python lasting_errors.py --sessions DIR --yair PATH [--simulate SEED]

DIR holds imported datasets with a pose at every row. With --simulate, wheels turn as in DIR, and poses are drawn: a lag, a delay
and noise that are known.
"""

import argparse
import csv
import json
import math
import subprocess
import sys
import tomllib
from collections import defaultdict
from pathlib import Path

import numpy as np

GEOMETRY = ["ln left radius", "ln right radius", "ln separation"]
NOISE = ["ln wheel", "ln turn", "ln white m", "ln white rad"]
LASTING = ["ln lasting m", "ln lasting rad", "ln lasting s"]
INSTRUMENT = ["delay s"]
LAG = ["ln lag s"]
# What is freed, model by model.
MODELS = {
    "white": GEOMETRY + NOISE + INSTRUMENT,
    "white + Gauss-Markov": GEOMETRY + NOISE + INSTRUMENT + LASTING,
    "white + Gauss-Markov + lag": GEOMETRY + NOISE + INSTRUMENT + LASTING + LAG,
}
ALL = GEOMETRY + NOISE + LASTING + INSTRUMENT + LAG
# Step of a difference: a relative 1e-5 of a length moves a pose by less than its noise, and far more than rounding does.
STEP = {**dict.fromkeys(GEOMETRY, 1e-5), **dict.fromkeys(NOISE + LASTING + LAG, 1e-3), "delay s": 1e-4}
ITERATIONS = 25
# A scoring step is cut to this much of a logarithm, and of a delay to 20 ms.
LARGEST_STEP = {**dict.fromkeys(ALL, 0.7), **dict.fromkeys(GEOMETRY, 0.02), "delay s": 0.02}
START = {"ln wheel": math.log(1e-3), "ln turn": math.log(3e-3), "ln white m": math.log(5e-4), "ln white rad": math.log(2e-3), "ln lasting m": math.log(1e-3),
         "ln lasting rad": math.log(2e-3), "ln lasting s": math.log(1.0), "delay s": 0.0, "ln lag s": math.log(0.02)}
# The start of a run is known to this much beside its first pose: far more than any noise.
START_SIGMA = (0.05, 0.05, 0.05)
# Time constants stay within two rows and a third of a run.
LASTING_S = (0.1, 20.0)
LAG_S = (1e-3, 0.5)


class Run:
    """One run: wheel angles at instants, and a pose at each."""

    def __init__(self, session, name, t_s, wheel_rad, pose):
        self.session, self.name, self.t_s, self.wheel_rad, self.pose = session, name, t_s, wheel_rad, pose


def read(folder):
    """The nominal lengths of a robot and its runs."""
    head = tomllib.loads((folder / "dataset.toml").read_text())["robot"]
    rows, poses = defaultdict(list), defaultdict(list)
    for file, into in [("odometry.csv", rows), ("truth.csv", poses)]:
        with open(folder / file) as lines:
            for run, *values in list(csv.reader(lines))[1:]:
                into[run].append([float(value) for value in values])
    runs = []
    for name, of in rows.items():
        odometry, truth = np.array(of), np.array(poses[name])
        if odometry.shape[0] != truth.shape[0] or np.abs(odometry[:, 0] - truth[:, 0]).max() > 1e-6:
            sys.exit(f"{folder}: run {name} has no pose at every row")
        wheel_rad = odometry[:, 1:] * 2 * math.pi / head["ticks_per_rev"]
        truth[:, 3] = np.unwrap(truth[:, 3])
        runs.append(Run(folder.name, name, odometry[:, 0], wheel_rad, truth[:, 1:]))
    radii = (head["left_wheel_diameter_m"] / 2, head["right_wheel_diameter_m"] / 2)
    return [math.log(radii[0]), math.log(radii[1]), math.log(head["wheel_separation_m"])], runs


class Batch:
    """Runs of all sessions side by side, the longest first."""

    def __init__(self, runs):
        self.runs = sorted(runs, key=lambda run: -len(run.t_s))
        self.length = np.array([len(run.t_s) for run in self.runs])
        steps, count = self.length[0], len(self.runs)
        self.dt_s, self.turned = np.ones((steps, count)), np.zeros((steps, count, 2))
        self.pose = np.zeros((steps, count, 3))
        for place, run in enumerate(self.runs):
            rows = len(run.t_s)
            self.dt_s[1:rows, place] = np.diff(run.t_s)
            self.turned[1:rows, place] = np.diff(run.wheel_rad, axis=0)
            self.pose[:rows, place] = run.pose
        # How many runs have this row.
        self.active = [int((self.length > row).sum()) for row in range(steps)]


def inverse(s):
    """Inverses and logarithms of determinants of symmetric 3×3 matrices."""
    a, b, c, d, e, f = s[..., 0, 0], s[..., 0, 1], s[..., 0, 2], s[..., 1, 1], s[..., 1, 2], s[..., 2, 2]
    minors = d * f - e * e, c * e - b * f, b * e - c * d, a * f - c * c, b * c - a * e, a * d - b * b
    determinant = a * minors[0] + b * minors[1] + c * minors[2]
    rows = [[minors[0], minors[1], minors[2]], [minors[1], minors[3], minors[4]], [minors[2], minors[4], minors[5]]]
    return np.stack([np.stack(row, -1) for row in rows], -2) / determinant[..., None, None], np.log(determinant)


def filtered(batch, values):
    """Innovations, their covariances, and which rows have them, by parameters of shape (variants, runs, ALL)."""
    variants, count = values.shape[:2]
    of = {name: values[..., place] for place, name in enumerate(ALL)}
    radius = np.stack([np.exp(of["ln left radius"]), np.exp(of["ln right radius"])], -1)
    separation, wheel_var, turn_var = np.exp(of["ln separation"]), np.exp(2 * of["ln wheel"]), np.exp(2 * of["ln turn"])
    white = np.exp(2 * np.stack([of["ln white m"], of["ln white m"], of["ln white rad"]], -1))
    lasting = np.exp(2 * np.stack([of["ln lasting m"], of["ln lasting m"], of["ln lasting rad"]], -1))
    lasting_s, lag_s, delay_s = np.exp(of["ln lasting s"]), np.exp(of["ln lag s"]), of["delay s"]
    state = np.zeros((variants, count, 9))
    state[..., :3] = state[..., 3:6] = batch.pose[0]
    covariance = np.zeros((variants, count, 9, 9))
    for axis in range(3):
        # The robot stands at first: the lag has caught up.
        for one in (axis, 3 + axis):
            for other in (axis, 3 + axis):
                covariance[..., one, other] = START_SIGMA[axis] ** 2
        covariance[..., 6 + axis, 6 + axis] = lasting[..., axis]
    identity = np.eye(3)
    innovations, spreads = [], []
    for row, live in enumerate(batch.active):
        x, p = state[:, :live], covariance[:, :live]
        velocity = np.zeros((variants, live, 3))
        if row > 0:
            dt_s = batch.dt_s[row, :live]
            travel = radius[:, :live] * batch.turned[row, :live]
            ahead, turn = travel.mean(-1), (travel[..., 1] - travel[..., 0]) / separation[:, :live]
            middle = x[..., 2] + 0.5 * turn
            sin, cos = np.sin(middle), np.cos(middle)
            motion = np.stack([ahead * cos, ahead * sin, turn], -1)
            velocity = motion / dt_s[:, None]
            after = x[..., :3] + motion
            ratio = dt_s / lag_s[:, :live]
            keep = np.exp(-ratio)
            mean = -np.expm1(-ratio) / ratio
            new, old = 1 - mean, mean - keep
            rho = np.exp(-dt_s / lasting_s[:, :live])
            of_pose = np.broadcast_to(identity, (variants, live, 3, 3)).copy()
            of_pose[..., 0, 2], of_pose[..., 1, 2] = -ahead * sin, ahead * cos
            f = np.zeros((variants, live, 9, 9))
            f[..., :3, :3] = of_pose
            f[..., 3:6, :3] = old[..., None, None] * identity + new[..., None, None] * of_pose
            f[..., 3:6, 3:6] = keep[..., None, None] * identity
            f[..., 6:, 6:] = rho[..., None, None] * identity
            x[..., 3:6] = keep[..., None] * x[..., 3:6] + old[..., None] * x[..., :3] + new[..., None] * after
            x[..., :3] = after
            x[..., 6:] *= rho[..., None]
            p = f @ p @ np.swapaxes(f, -1, -2)
            # Wheels err by what grows with the root of their travel, and turns with the root of theirs.
            g = np.zeros((variants, live, 9, 3))
            for side, sign in ((0, -1.0), (1, 1.0)):
                g[..., 0, side], g[..., 1, side] = 0.5 * cos, 0.5 * sin
                g[..., 2, side] = sign / separation[:, :live]
            g[..., :2] *= np.sqrt(wheel_var[:, :live, None] * np.abs(travel))[..., None, :]
            g[..., 2, 2] = np.sqrt(turn_var[:, :live] * np.abs(turn))
            g[..., 3:6, :] = new[..., None, None] * g[..., :3, :]
            p += g @ np.swapaxes(g, -1, -2)
            for axis in range(3):
                p[..., 6 + axis, 6 + axis] += (1 - rho * rho) * lasting[:, :live, axis]
        predicted = x[..., 3:6] + x[..., 6:] - delay_s[:, :live, None] * velocity
        innovation = batch.pose[row, :live] - predicted
        seen = p[..., 3:6, :] + p[..., 6:, :]
        spread = seen[..., 3:6] + seen[..., 6:]
        for axis in range(3):
            spread[..., axis, axis] += white[:, :live, axis]
        inverted, _ = inverse(spread)
        gain = np.swapaxes(seen, -1, -2) @ inverted
        state[:, :live] = x + (gain @ innovation[..., None])[..., 0]
        p = p - gain @ seen
        covariance[:, :live] = 0.5 * (p + np.swapaxes(p, -1, -2))
        innovations.append(innovation)
        spreads.append(spread)
    return innovations, spreads


def scored(batch, values, free):
    """Log-likelihood, score and information of every run."""
    variants = np.repeat(values[None], 1 + len(free), 0)
    for place, name in enumerate(free):
        variants[1 + place, :, ALL.index(name)] += STEP[name]
    steps = np.array([STEP[name] for name in free])
    count = len(batch.runs)
    likelihood, score = np.zeros(count), np.zeros((count, len(free)))
    information = np.zeros((count, len(free), len(free)))
    innovations, spreads = filtered(batch, variants)
    # The first row gives the start, and no more.
    for row in range(1, len(innovations)):
        live = batch.active[row]
        innovation, spread = innovations[row], spreads[row]
        inverted, log_determinant = inverse(spread[0])
        slope = (innovation[1:] - innovation[0]) / steps[:, None, None]
        growth = (spread[1:] - spread[0]) / steps[:, None, None, None]
        weighted = (inverted @ innovation[0][..., None])[..., 0]
        likelihood[:live] -= 0.5 * (np.einsum("ni,ni->n", innovation[0], weighted) + log_determinant)
        relative = inverted @ growth
        trace = np.einsum("knii->kn", relative)
        score[:live] -= (np.einsum("kni,ni->kn", slope, weighted) + 0.5 * trace
                         - 0.5 * np.einsum("ni,knij,nj->kn", weighted, growth, weighted)).T
        information[:live] += np.einsum("kni,nij,lnj->nkl", slope, inverted, slope)
        information[:live] += 0.5 * np.einsum("knij,lnji->nkl", relative, relative)
    return likelihood, score, information


def fit(batch, nominal, free):
    """Parameters of each session, by scoring with halved steps; scores and information of every run at the end."""
    sessions = sorted(nominal)
    of_run = np.array([sessions.index(run.session) for run in batch.runs])
    values = np.array([[*nominal[session], *(START[name] for name in ALL[3:])] for session in sessions])
    for name in set(LASTING) - set(free):
        if name != "ln lasting s":
            values[:, ALL.index(name)] = math.log(1e-9)
    if "ln lag s" not in free:
        values[:, ALL.index("ln lag s")] = math.log(LAG_S[0])
    places = [ALL.index(name) for name in free]

    def total(of):
        return np.stack([of[of_run == session].sum(0) for session in range(len(sessions))])

    damping, best = np.full(len(sessions), 1e-3), None
    kept = values.copy()
    for _ in range(ITERATIONS):
        likelihood, score, information = scored(batch, values[of_run], free)
        whole = total(likelihood)
        if best is not None:
            worse = whole < best[0] - 1e-6
            damping = np.where(worse, damping * 30, damping * 0.1)
            values[worse] = kept[worse]
            whole = np.where(worse, best[0], whole)
            runs_worse = worse[of_run]
            score = np.where(runs_worse[:, None], best[1], score)
            information = np.where(runs_worse[:, None, None], best[2], information)
        best, kept = (whole, score, information), values.copy()
        gradient, curvature = total(score), total(information)
        for session in range(len(sessions)):
            scale = np.sqrt(np.diag(curvature[session]).clip(1e-12))
            damped = curvature[session] / np.outer(scale, scale) + damping[session] * np.eye(len(free))
            step = np.linalg.solve(damped, gradient[session] / scale) / scale
            largest = np.array([LARGEST_STEP[name] for name in free])
            values[session, places] += np.clip(step, -largest, largest)
        for name, (low, high) in (("ln lasting s", LASTING_S), ("ln lag s", LAG_S)):
            values[:, ALL.index(name)] = np.clip(values[:, ALL.index(name)], math.log(low), math.log(high))
    values = kept
    whole, score, information = best
    results = {}
    for place, session in enumerate(sessions):
        own = of_run == place
        inverse_information = np.linalg.pinv(information[own].sum(0))
        scatter = score[own].T @ score[own]
        # Of the geometry alone, the rest taken out: the design effect of runs.
        covariance, robust = inverse_information[:3, :3], (inverse_information @ scatter @ inverse_information)[:3, :3]
        runs = own.sum()
        design = np.trace(np.linalg.solve(covariance, robust)) / 3 * runs / max(runs - 1, 1)
        results[session] = {"values": dict(zip(ALL, values[place])), "covariance": covariance, "design": design, "likelihood": whole[place]}
    return results


def thinned(yair, folder):
    """Logarithms of the lengths by `yair calibrate`, and their standard deviations; `None` where it has no result."""
    ran = subprocess.run([yair, "calibrate", folder, "--method", "joint", "--json", "--quiet"], capture_output=True, text=True)
    if ran.returncode != 0:
        return None
    parameters = json.loads(ran.stdout)["methods"][0]["parameters"]
    of = [parameters[name] for name in ("left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m")]
    halves = np.array([0.5, 0.5, 1.0])
    return np.log([one["value"] for one in of] * halves), np.array([one["sigma"] / one["value"] for one in of])


def reckoned(run, geometry):
    """How far a run ends from its last pose by dead reckoning from the first, metres and radians."""
    radius, separation = np.exp(geometry[:2]), math.exp(geometry[2])
    travel = radius * np.diff(run.wheel_rad, axis=0)
    turn = (travel[:, 1] - travel[:, 0]) / separation
    heading = run.pose[0, 2] + np.concatenate([[0], np.cumsum(turn)[:-1]]) + 0.5 * turn
    ahead = travel.mean(1)
    end = run.pose[0, :2] + [np.sum(ahead * np.cos(heading)), np.sum(ahead * np.sin(heading))]
    return math.hypot(*(end - run.pose[-1, :2])), abs(run.pose[0, 2] + turn.sum() - run.pose[-1, 2])


def simulated(runs, nominal, seed):
    """The same wheels with poses that are drawn: of the nominal lengths, behind a lag of 50 ms."""
    random = np.random.default_rng(seed)
    wheel, white, lasting, lasting_s, lag_s = 3e-4, (3e-4, 3e-4, 1e-3), (5e-4, 5e-4, 2e-3), 1.0, 0.05
    drawn = []
    for run in runs:
        dt_s, turned = np.diff(run.t_s), np.diff(run.wheel_rad, axis=0)
        geometry = np.array(nominal[run.session])
        travel = np.exp(geometry[:2]) * turned
        travel = travel + wheel * np.sqrt(np.abs(travel)) * random.standard_normal(travel.shape)
        turn = (travel[:, 1] - travel[:, 0]) / math.exp(geometry[2])
        heading = np.concatenate([[0], np.cumsum(turn)])
        middle, ahead = heading[:-1] + 0.5 * turn, travel.mean(1)
        pose = np.zeros((len(run.t_s), 3))
        pose[1:, 0], pose[1:, 1] = np.cumsum(ahead * np.cos(middle)), np.cumsum(ahead * np.sin(middle))
        pose[:, 2] = heading
        behind, error = pose.copy(), np.zeros_like(pose)
        error[0] = lasting * random.standard_normal(3)
        for row, dt in enumerate(dt_s):
            keep, mean = math.exp(-dt / lag_s), -math.expm1(-dt / lag_s) * lag_s / dt
            behind[row + 1] = keep * behind[row] + (mean - keep) * pose[row] + (1 - mean) * pose[row + 1]
            rho = math.exp(-dt / lasting_s)
            error[row + 1] = rho * error[row] + math.sqrt(1 - rho * rho) * np.array(lasting) * random.standard_normal(3)
        seen = behind + error + np.array(white) * random.standard_normal(pose.shape)
        drawn.append(Run(run.session, run.name, run.t_s, run.wheel_rad, seen))
    return drawn


def written(runs, source, into):
    """Datasets with the poses of these runs."""
    by_session = defaultdict(list)
    for run in runs:
        by_session[run.session].append(run)
    for session, of in by_session.items():
        folder = into / session
        folder.mkdir(parents=True, exist_ok=True)
        for name in ("dataset.toml", "odometry.csv"):
            (folder / name).write_text((source / session / name).read_text())
        rows = (f"{run.name},{t_s!r},{x!r},{y!r},{theta!r}" for run in of
                for t_s, (x, y, theta) in zip(run.t_s.tolist(), run.pose.tolist()))
        (folder / "truth.csv").write_text("\n".join(["run,t_s,x_m,y_m,theta_rad", *rows]) + "\n")


def mean_line(name, values, form="{:8.3f}"):
    return f"{name:<44}" + " ".join(form.format(value) for value in values)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sessions", type=Path, required=True)
    parser.add_argument("--yair", required=True)
    parser.add_argument("--simulate", type=int, metavar="SEED")
    parser.add_argument("--work", type=Path, default=Path("target/shadows"))
    arguments = parser.parse_args()
    folders = sorted(folder for folder in arguments.sessions.iterdir() if (folder / "dataset.toml").exists())
    nominal, runs = {}, []
    for folder in folders:
        nominal[folder.name], of = read(folder)
        runs += of
    sessions, truth = arguments.sessions, None
    if arguments.simulate is not None:
        truth = {session: np.array(of) for session, of in nominal.items()}
        runs = simulated(runs, nominal, arguments.simulate)
        sessions = arguments.work / f"simulated-{arguments.simulate}"
        written(runs, arguments.sessions, sessions)
    batch = Batch(runs)
    print(f"{len(nominal)} sessions, {len(runs)} runs, {batch.length.sum()} poses")
    by_thinning = {session: thinned(arguments.yair, str(sessions / session)) for session in nominal}
    by_thinning = {session: of for session, of in by_thinning.items() if of is not None}
    estimates = {"thinned (yair calibrate)": by_thinning}
    for model, free in MODELS.items():
        found = fit(batch, nominal, free)
        estimates[model] = {session: (np.array([of["values"][name] for name in GEOMETRY]), np.sqrt(np.diag(of["covariance"])))
                            for session, of in found.items()}
        print(f"\n{model}")
        print("session        wheel mm/√m  turn mrad/√rad  white mm  mrad  lasting mm  mrad    s   delay ms  lag ms    ln L      c")
        for session, of in found.items():
            v = of["values"]
            scale = [1e3 * math.exp(v[name]) for name in ("ln wheel", "ln turn", "ln white m", "ln white rad", "ln lasting m", "ln lasting rad")]
            print(f"{session:<14} {scale[0]:10.3f} {scale[1]:14.2f} {scale[2]:10.3f} {scale[3]:5.2f} {scale[4]:10.3f} {scale[5]:6.2f}"
                  f" {math.exp(v['ln lasting s']):6.2f} {1e3 * v['delay s']:8.1f} {1e3 * math.exp(v['ln lag s']):7.1f} {of['likelihood']:10.0f} {of['design']:6.2f}")
        design = np.array([of["design"] for of in found.values()])
        print(f"c: median {np.median(design):.2f}, {np.sum(design <= 1.5)} of {len(design)} at most 1.5")
    print("\n                                              lengths: left, right, separation")
    for model, of in estimates.items():
        shared = [session for session in of if session in by_thinning]
        if truth is not None:
            z = np.array([(of[session][0] - truth[session]) / of[session][1] for session in of])
            print(mean_line(f"{model}: RMS z to the truth", np.sqrt((z * z).mean(0))))
            print(mean_line(f"{model}: mean error, %", 100 * np.mean([of[s][0] - truth[s] for s in of], 0), "{:8.4f}"))
            print(mean_line(f"{model}: RMS error, %", 100 * np.sqrt(np.mean([(of[s][0] - truth[s]) ** 2 for s in of], 0)), "{:8.4f}"))
        elif model in MODELS:
            off = np.array([(of[session][0] - by_thinning[session][0]) / by_thinning[session][1] for session in shared])
            print(mean_line(f"{model}: RMS off the thinned fit, its σ", np.sqrt((off * off).mean(0))))
            print(mean_line(f"{model}: within 1 σ of it, of {len(shared)}", (np.abs(off) < 1).sum(0), "{:8d}"))
        ratio = np.array([of[session][1] / by_thinning[session][1] for session in shared])
        print(mean_line(f"{model}: ± over the thinned fit's, median", np.median(ratio, 0)))
    print("\nruns of other sessions, by dead reckoning: RMS of ends, mm and mrad; geometric mean of RMS over the thinned fit's by session")
    reference = None
    for model, of in estimates.items():
        ends = {}
        for session in by_thinning:
            errors = np.array([reckoned(run, of[session][0]) for run in runs if run.session != session])
            ends[session] = np.sqrt((errors ** 2).mean(0))
        rms = np.sqrt(np.mean([end ** 2 for end in ends.values()], 0))
        reference = reference or ends
        ratio = np.exp(np.mean([np.log(ends[session] / reference[session]) for session in ends], 0))
        print(mean_line(model, [1e3 * rms[0], 1e3 * rms[1], *ratio]))


if __name__ == "__main__":
    main()
