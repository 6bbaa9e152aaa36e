"""The models of a beam by `yair diagnose --beam`, and what formulas for their comparison need of them (posterior.py).

    python beam.py --yair PATH --logs DIR... --work DIR [--part K/N]

Each log is diagnosed once: the models and what `diagnose` reports go into a file of DIR. Logs hold an answer.json each, as
`replay` draws them (target/replay/logs/blind/SEED). `--part` takes every N-th log. Needs NumPy.
"""

import argparse
import gzip
import json
import math
import pickle
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from drawn_logs import answer_of, diagnose

# As `diagnose` has them: cost of a rejected innovation, and units below which runs do not say how they scatter.
OUTLIER_COST = 0.5 * 25.9 / 3.0
MIN_UNITS = 6
# Columns of the normal equations before those of sizes.
GEOMETRY_COLUMNS = 8
# What a size may differ by from run to run.
FORM_ERROR = 0.1
UNLISTED = "unlisted"

FAMILIES = {
    "wheel": "backlash wheel_eccentricity load_transfer payload_compression thermal_drift wear direction_asymmetry",
    "contact": "slip_speed slip_acceleration turn_rate_wheelbase lateral_skid turn_slip stick_slip traction_loss"
    " contact_patch_wheelbase",
    "castor": "castor_kick castor_drag",
    "floor": "floor_slope carpet_nap bumps",
    "encoder": "encoder_cycle missed_counts low_speed_truncation",
    "clock": "sampling_skew interval_error clock_rate truth_latency",
    "instrument": "truth_lever_arm truth_yaw truth_map_scale",
}
# What is found in the residuals of the model with all effects: no formula here says anything of it.
AFTER_THE_MEAN = {"contact_patch_wheelbase", "traction_loss", "stick_slip", "bumps", UNLISTED}
AFTER_THE_MEAN |= {"truth_correlated_noise", "truth_outliers"}
FAMILY = {effect: family for family, effects in FAMILIES.items() for effect in effects.split()}


def dump_one(log, yair, work, number):
    kept = work / f"{log.parent.name}-{log.name}.json.gz"
    if kept.exists():
        return
    beam = work / f"beam-{number}.jsonl"
    beam.unlink(missing_ok=True)
    begun = time.time()
    ran = diagnose(yair, log, "--beam", str(beam))
    document = json.loads(ran.stdout) if ran.returncode in (0, 3) and ran.stdout else None
    short = document and {key: document[key] for key in ("findings", "candidates")}
    models = [json.loads(line) for line in beam.read_text().splitlines()] if beam.exists() else []
    with gzip.open(kept, "wt", compresslevel=5) as file:
        json.dump({"answer": answer_of(log), "document": short, "models": models, "seconds": time.time() - begun}, file)


@dataclass
class Model:
    """A model of the beam, without what no formula needs."""

    names: tuple  # of candidates, with their variants
    ids: tuple  # sorted; `unlisted` for a product
    parts: list  # how many sizes each candidate has
    possible: list  # whether a robot can have the sizes of each
    keeps: bool  # effects do not cancel each other, wheels stay as stated
    trials: int
    cost: float = 0.0
    sizes: np.ndarray = None
    keys: list = None
    scales: np.ndarray = None
    information: np.ndarray = None  # of the sizes, other columns eliminated
    scores: np.ndarray = None  # of units by the sizes, the same
    design: float = 1.0  # trace of the scatter of scores over the information, all columns
    form: float = 0.0  # ln of the likelihood with a coefficient of each unit, over that without
    sessions: list = None
    of_units: list = None
    costs: np.ndarray = None
    likelihood: tuple = None
    along: float = 1.0


@dataclass
class Case:
    seed: str
    answer: dict
    findings: list  # of today's rules: of the mean, and of stages before it
    before: list  # the latter alone
    models: list
    variants: Counter
    inflation: dict
    base_design: float
    runs: int
    units: int
    seconds: float
    cache: dict = field(default_factory=dict)


def effect(name):
    return UNLISTED if name.startswith("*") else name.split("/")[0]


def eliminated(line):
    """Information and unit scores of the sizes with the other free columns eliminated, and the same of all columns."""
    columns, fixed = line["columns"]
    matrix = np.array(line["information"][0]).reshape(len(columns), len(columns))
    gradients = np.array([unit["gradient"] for unit in line["units"]]).reshape(len(line["units"]), len(columns))
    base = [k for k, column in enumerate(columns) if column < GEOMETRY_COLUMNS]
    own = [k for k, column in enumerate(columns) if column >= GEOMETRY_COLUMNS]
    basis = np.eye(len(base))
    if fixed:
        along = np.array([[of[columns[k]] if columns[k] < len(of) else 0.0 for k in base] for of in fixed])
        _, values, right = np.linalg.svd(along)
        basis = right[(values > 1e-9).sum() :].T
    whole = np.zeros((len(columns), basis.shape[1] + len(own)))
    whole[np.ix_(base, range(basis.shape[1]))] = basis
    whole[own, range(basis.shape[1], whole.shape[1])] = 1.0
    matrix, gradients = whole.T @ matrix @ whole, gradients @ whole
    n = basis.shape[1]
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    matrix, gradients = matrix / np.outer(scale, scale), gradients / scale
    nuisance = matrix[:n, :n] + 1e-12 * np.eye(n)
    weights = np.linalg.solve(nuisance, matrix[:n, n:]).T
    information = (matrix[n:, n:] - weights @ matrix[:n, n:]) * np.outer(scale[n:], scale[n:])
    scores = (gradients[:, n:] - gradients[:, :n] @ weights.T) * scale[n:]
    return information, scores, matrix, gradients


def grouped(scores, sessions):
    """Sums over sessions where there are six of them."""
    if len(set(sessions)) < MIN_UNITS:
        return scores
    return np.array(
        [scores[[k for k, of in enumerate(sessions) if of == own]].sum(axis=0) for own in sorted(set(sessions))]
    )


def design_effect(information, scores):
    """Scatter of the units' scores about their mean over the information, a mean over directions."""
    units, d = scores.shape
    if units < 2 or d == 0:
        return 1.0
    centred = scores - scores.mean(axis=0)
    scatter = centred.T @ centred * units / (units - 1)
    try:
        return float(np.trace(np.linalg.solve(information + 1e-9 * np.diag(np.diag(information)), scatter)) / d)
    except np.linalg.LinAlgError:
        return 1.0


def form_gain(line, share):
    """ln of the likelihood with a coefficient of each unit that varies by a share, summed over inexact effects."""
    gain, at = 0.0, 0
    sizes = np.array(line["sizes"])
    first = len(line["columns"][0]) - len(sizes)
    for k, (own, _) in enumerate(line["parameters"]):
        exact = FAMILY.get(effect(line["candidates"][k])) in ("clock", "instrument")
        for unit in line["units"] if not exact else []:
            score = -np.dot(unit["gradient"][first + at : first + at + own], sizes[at : at + own])
            spread = 1.0 + share**2 * max(unit["along"][k], 0.0)
            gain += 0.5 * share**2 * score**2 / spread - 0.5 * math.log(spread)
        at += own
    return gain


def read_model(line):
    names = tuple(line["candidates"])
    ids = tuple(sorted(effect(name) for name in names))
    chi_square, log_det, count, _ = line["likelihood"]
    parts = [own for own, _ in line["parameters"]]
    keeps = line["limits"][1] and not line["limits"][0]
    model = Model(names, ids, parts, [can for _, can in line["parameters"]], keeps, line["trials"])
    model.likelihood = (0.5 * (chi_square + log_det), count, log_det)
    model.sizes = np.array(line["sizes"])
    model.keys = [name for name, _ in line["scales"]]
    model.scales = np.array([scale for _, scale in line["scales"]])
    model.information, model.scores, whole, gradients = eliminated(line)
    model.sessions = [unit["of"][0] for unit in line["units"]]
    model.of_units = [tuple(unit["of"]) for unit in line["units"]]
    model.costs = np.array([unit["likelihood"][1] for unit in line["units"]])
    model.design = design_effect(whole, grouped(gradients, model.sessions))
    if len(model.sizes):
        along = grouped(model.scores, model.sessions) @ model.sizes
        signal = float(model.sizes @ model.information @ model.sizes)
        centred = along - along.mean()
        model.along = float(centred @ centred * len(along) / max(len(along) - 1, 1) / max(signal, 1e-300))
        model.form = form_gain(line, FORM_ERROR)
    return model


def is_sound(line):
    numbers = [*line["likelihood"], *line["sizes"], *line["information"][0]]
    return all(number is not None and math.isfinite(number) for number in numbers)


def read_case(path):
    with gzip.open(path, "rt") as file:
        case = json.load(file)
    if case["document"] is None or not case["models"]:
        return (path.name, case["answer"])
    lines = [line for line in case["models"] if is_sound(line)]
    scored = [line for line in lines if line["candidates"] and not any(line["sizes"])]
    models = {}
    variants, inflation = Counter(), {}
    for line in lines:
        if line["candidates"] and not any(line["sizes"]):
            continue
        if not line["candidates"] and line["scanned"]:
            variants = Counter(effect(of[0]) for of in line["scanned"] if of[1] > 0)
            inflation = {of[0]: of[4] for of in line["scanned"]}
        key = tuple(sorted(line["candidates"]))
        products = sum(name.startswith("*") for name in key)
        if products > 1 or (products == 1 and line["trials"] == 1) or len(set(map(effect, key))) < len(key):
            continue
        model = read_model(line)
        known = models.get(key)
        if known is None or model.likelihood[0] < known.likelihood[0]:
            models[key] = model
    models = list(models.values())
    most = max(model.likelihood[1] for model in models)
    for model in models:
        cost, count, log_det = model.likelihood
        model.cost = cost + (most - count) * (OUTLIER_COST + 0.5 * log_det / max(count, 1.0))
    runs = len({tuple(unit["of"]) for unit in lines[0]["units"]})
    base_design = design_of_base(scored[0], models) if scored else 1.0
    of_mean = lambda of: of["in_extended_model"] is not None
    found = [of for of in case["document"]["findings"] if of_mean(of) or of["names"][0] not in AFTER_THE_MEAN]
    findings = [
        {**{key: of[key] for key in ("names", "parameters")}, "odds": 0.5 * of["z"] ** 2, "mean": of_mean(of)}
        for of in found
    ]
    before = [of for of in findings if not of["mean"]]
    seed = path.name.split("-")[0]
    return Case(
        seed,
        case["answer"],
        findings,
        before,
        models,
        variants,
        inflation,
        base_design,
        runs,
        len(lines[0]["units"]),
        case["seconds"],
    )


def design_of_base(line, models):
    """Scatter of the calibrated model's scores by the best single effect."""
    information, scores, _, _ = eliminated(line)
    single = [model for model in models if len(model.names) == 1 and model.names[0] in line["candidates"]]
    if not single:
        return 1.0
    best = min(single, key=lambda model: model.cost)
    index = line["candidates"].index(best.names[0])
    first = sum(own for own, _ in line["parameters"][:index])
    own = slice(first, first + line["parameters"][index][0])
    along = grouped(scores[:, own], [unit["of"][0] for unit in line["units"]]) @ best.sizes
    signal = float(best.sizes @ information[own, own] @ best.sizes)
    centred = along - along.mean()
    return float(centred @ centred * len(along) / max(len(along) - 1, 1) / max(signal, 1e-300))


def cases_of(work, seeds):
    kept = work / f"cases-{'-'.join(seeds)}.pickle"
    paths = sorted(path for seed in seeds for path in work.glob(f"{seed}-*.json.gz"))
    if kept.exists():
        with kept.open("rb") as file:
            cases = pickle.load(file)
        if len(cases) == len(paths):
            return cases
    with ProcessPoolExecutor(2) as pool:
        cases = list(pool.map(read_case, paths, chunksize=16))
    with kept.open("wb") as file:
        pickle.dump(cases, file)
    return cases


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--yair", required=True)
    parser.add_argument("--logs", type=Path, nargs="+", required=True)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--part", default="1/1")
    arguments = parser.parse_args()
    part, parts = (int(of) for of in arguments.part.split("/"))
    logs = [file.parent for of in arguments.logs for file in of.glob("*/answer.json")]
    logs.sort(key=lambda log: (log.name, log))
    arguments.work.mkdir(parents=True, exist_ok=True)
    for log in logs[part - 1 :: parts]:
        dump_one(log, arguments.yair, arguments.work, part)


if __name__ == "__main__":
    main()
