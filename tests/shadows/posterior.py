"""One posterior over sets of effects, by several formulas, next to what the rules of `diagnose` report of the mean.

An experiment on `diagnose` (docs/one-model.md). beam.py has the models that are compared: the calibrated one, single effects,
pairs and triples of the best, products of covariates. Formulas for their comparison are evaluated here, without another fit.

    python posterior.py --work DIR --tune SEED... --judge SEED... [--nulls SHARE] [--both] [--tables FORMULA...]

DIR is that of beam.py. Thresholds are set on the logs of the first seeds, and the table is of the others. Needs NumPy.
"""

import argparse
import math
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from beam import FAMILIES, FAMILY, MIN_UNITS, UNLISTED, Case, cases_of, effect

# As `diagnose` has them: scales of a size, prior odds of an uncatalogued cause, the log odds that discriminate, and the share
# of the best ones that is form.
SCALES = 11
UNLISTED_PRIOR = 0.05 / 0.95
MARGIN, FORM_SHARE = 3.0, 0.01
# ln of the prior odds against each effect of the model that c is of: about what the thresholds come to.
ODDS_OF_EFFECT = 5.0
COVERED = 1.96
NORMAL_95 = 1.645


@dataclass(frozen=True)
class Formula:
    """A way to compare the models of a beam."""

    name: str
    c: str = (
        "one"  # one, base, along (the best model's sizes), trace (all its columns), runs (the same of six runs or more)
    )
    inflated: bool = False  # c is no less than what coarse encoders inflate the best by
    student: str = "never"  # never, few (below six runs), blocks (the same, by blocks), always
    form: str = "none"  # none, share, units, scatter
    prior: str = "uniform"  # uniform, family
    limits: bool = True  # models whose effects cancel, or whose wheels are not as stated, are out
    impossible: str = "out"  # out, unlisted
    most: int = 3
    mass: float = 0.95
    doubts: bool = False  # what today's rules hold to be perhaps unlisted may be
    decide: str = (
        "prior"  # prior: the threshold is ln of the prior odds against each effect; odds: of each given the others
    )


def log_occam(model, c):
    """ln of the integral over the sizes, over the likelihood at the best ones: each effect has a scale of its own."""
    information = model.information * np.outer(model.scales, model.scales) / c
    sizes = model.sizes / model.scales
    k = len(model.parts)
    step = 1 if k == 1 else 2
    scales = np.array(list(product(range(0, SCALES, step), repeat=k)), dtype=float)
    shrink = np.repeat(2.0**-scales, model.parts, axis=1)
    scaled = np.eye(len(sizes)) + shrink[:, :, None] * information * shrink[:, None, :]
    signs, dets = np.linalg.slogdet(scaled)
    # θᵀ(Σ + I⁻¹)⁻¹θ = θᵀI θ − θᵀI L (1 + L I L)⁻¹ L I θ, L² = Σ.
    weighted = shrink * (information @ sizes)
    whole = float(sizes @ information @ sizes)
    fitted = np.einsum("ij,ij->i", weighted, np.linalg.solve(scaled, weighted[:, :, None])[:, :, 0])
    values = np.where(signs > 0, -0.5 * dets - 0.5 * np.maximum(whole - fitted, 0.0), -np.inf)
    most = values.max()
    return most + math.log(np.exp(values - most).mean())


def log_sum(values):
    most = max(values, default=-math.inf)
    return most + math.log(sum(math.exp(value - most) for value in values)) if most > -math.inf else -math.inf


def log_prior(ids, case, formula):
    total = 0.0
    for of in ids:
        if of == UNLISTED:
            total += math.log(UNLISTED_PRIOR)
        elif formula.prior == "family":
            alike = sum(FAMILY.get(other) == FAMILY.get(of) for other in case.variants)
            total += math.log(max(len(case.variants), 1) / len(FAMILIES) / max(alike, 1))
    return total


def design_of(case, formula, evidence):
    """The design effect that all models share."""
    if formula.c == "one":
        c = 1.0
    elif formula.c == "base":
        c = case.base_design
    else:
        best = max(evidence, key=lambda pair: pair[0])[1]
        c = best.along if formula.c == "along" and len(best.sizes) else best.design
        c = 1.0 if formula.c == "runs" and case.runs < MIN_UNITS else c
    c = max(1.0, c if math.isfinite(c) else 1.0)
    if formula.inflated and evidence:
        best = max((pair for pair in evidence if pair[1].names), key=lambda pair: pair[0], default=(0.0, None))[1]
        names = ["/".join(name.split("/")[:2]) for name in best.names] if best else []
        c = max([c, *(case.inflation.get(name, 1.0) for name in names)])
    return c


def occam_of(case, model, c):
    key = (model.names, round(c, 6))
    if key not in case.cache:
        case.cache[key] = log_occam(model, c)
    return case.cache[key]


def evidence_of(case, formula, c):
    """ln of the posterior of each model over none, without its constant."""
    none = next(model for model in case.models if not model.names)
    all_of = []
    few = case.runs < MIN_UNITS
    freedom = max(case.runs - 1, 1) if few and formula.student != "blocks" else max(case.units - 1, 1)
    for model in case.models:
        if len(model.names) > formula.most or (formula.limits and not model.keeps):
            continue
        ids, impossible = model.ids, model.possible.count(False)
        if impossible:
            if formula.impossible == "out" or impossible + ids.count(UNLISTED) > 1:
                continue
            own = [effect(name) for name, can in zip(model.names, model.possible) if can]
            ids = tuple(sorted([*own, UNLISTED]))
        gain = none.cost - model.cost
        if formula.form == "units":
            gain += model.form
        if formula.student == "always" or (formula.student in ("few", "blocks") and few):
            gain = 0.5 * (freedom + 1) * math.log1p(2.0 * gain / (freedom * c)) if gain > 0.0 else gain / c
        else:
            gain /= c
        occam = occam_of(case, model, c) if model.names else 0.0
        trials = sum(math.log(max(case.variants[of], 1)) for of in model.ids if of != UNLISTED) + math.log(model.trials)
        trials += math.log(max(len(case.variants), 1)) if impossible else 0.0
        all_of.append((gain + occam - trials + log_prior(ids, case, formula), model, ids))
    return all_of


def posterior(case, formula):
    """ln of the posterior of each set of effects over none, and the most probable model of each."""
    plain = evidence_of(case, replace(formula, c="one", student="never", form="none"), 1.0)
    c = design_of(case, formula, [(odds - ODDS_OF_EFFECT * len(ids), model) for odds, model, ids in plain])
    sets, models = {}, {}
    for odds, model, ids in evidence_of(case, formula, c):
        if ids not in models or odds > models[ids][0]:
            models[ids] = (odds, model)
        sets.setdefault(ids, []).append(odds)
    return {ids: log_sum(odds) for ids, odds in sets.items()}, models, c


def findings_of(case, formula):
    """The most probable set of each size: its log odds over none, and its findings."""
    sets, models, c = posterior(case, formula)
    sizes = {}
    for ids, odds in sets.items():
        if ids and odds > sizes.get(len(ids), ((), -math.inf))[1]:
            sizes[len(ids)] = (ids, odds)
    most = max((odds for _, odds in sizes.values()), default=0.0)
    scale = max(1.0, FORM_SHARE / MARGIN * most) if formula.form in ("share", "scatter") else 1.0
    found = []
    for ids, odds in sizes.values():
        of = [finding(own, ids, (sets, models, c), scale, formula) for own in ids]
        found.append((len(ids), odds / scale, sorted(of, key=lambda finding: -finding["odds"])))
    return found


def finding(own, best, posterior_of, scale, formula):
    """An effect of a set: log odds of some cause in its place, names that have the mass together, and sizes."""
    sets, models, c = posterior_of
    rest = list(best)
    rest.remove(own)
    without = sets.get(tuple(rest), -math.inf)
    instead = {}
    for ids, odds in sets.items():
        left = Counter(ids) - Counter(rest)
        if len(ids) == len(best) and sum(left.values()) == 1:
            (name,) = left
            instead[name] = (odds, models[ids][1])
    first = models[best][1]
    top = max(odds for odds, _ in instead.values())

    def weight(odds, model):
        scatter = NORMAL_95 * scatter_of_units(first, model) / MARGIN if formula.form == "scatter" else 1.0
        return math.exp((odds - top) / max(scale, scatter))

    weights = {name: weight(odds, model) for name, (odds, model) in instead.items()}
    weights[UNLISTED] = weights.get(UNLISTED, 0.0) + math.exp(min((without - top) / scale, 50.0))
    whole, so_far, names = sum(weights.values()), 0.0, []
    for name in sorted(weights, key=weights.get, reverse=True):
        names.append(name)
        so_far += weights[name]
        if so_far >= formula.mass * whole:
            break
    odds = log_sum([odds / scale for odds, _ in instead.values()])
    odds -= without / scale if math.isfinite(without) else 0.0
    return {"odds": odds, "names": names, "parameters": sizes_of(first, own, c)}


def scatter_of_units(one, other):
    """Standard error of the sum over units of the difference of two log likelihoods."""
    if one.of_units != other.of_units or len(one.of_units) < 2:
        return 0.0
    return math.sqrt(len(one.costs)) * float(np.std(one.costs - other.costs, ddof=1))


def sizes_of(model, own, c):
    try:
        covariance = np.linalg.inv(model.information) * c
    except np.linalg.LinAlgError:
        return {}
    first, sizes = 0, {}
    for name, count in zip(model.names, model.parts):
        for k in range(first, first + count):
            if effect(name) == own and covariance[k, k] > 0.0:
                sizes[model.keys[k]] = {"value": model.sizes[k], "sigma": math.sqrt(covariance[k, k])}
        first += count
    return sizes


def counted(answer, findings):
    causes = [name for cause in answer["causes"] for name in cause["right"]]
    exempts = lambda of: any(name in answer["exempt"] and name not in causes for name in of["names"])
    return [of for of in findings if not exempts(of)]


def score(answer, findings, mean_effects):
    """What each measure says of one log, as `replay` has it, of findings of the mean."""
    found = counted(answer, findings)
    question, causes = answer["question"], answer["causes"]
    is_mean = lambda cause: any(name in mean_effects for name in cause["right"])
    of = {}
    if question == "null":
        of["nulls with a finding"] = bool(found)
    elif question == "one" and not is_mean(causes[0]):
        right = {UNLISTED, *causes[0]["right"], *causes[0]["aliases"]}
        of["cause not of the mean: a wrong name"] = any(not right & set(finding["names"]) for finding in found)
    elif question == "one":
        cause = causes[0]
        if cause["is_plain"]:
            of["plain causes: something is found"] = bool(found)
        if not cause["is_aliased"]:
            of["no alias: found, right cause first"] = bool(found) and found[0]["names"][0] in cause["right"]
        if found:
            names = found[0]["names"]
            is_right = any(name in names for name in cause["right"])
            if cause["is_aliased"]:
                of["aliased: right cause in the set"] = is_right
                of["aliased: names over the oracle's"] = len(names) / len(set(cause["right"] + cause["aliases"]))
            else:
                of["no alias: right cause first"] = names[0] in cause["right"]
                of["no alias: right cause in the set"] = is_right
                of["no alias: names"] = float(len(names))
            of["one cause: further findings"] = len(found) > 1
            covers = covered(cause, findings)
            if covers is not None:
                of["sizes of right causes covered"] = covers
    elif question == "two" and all(cause["is_plain"] and is_mean(cause) for cause in causes):
        names = {name for finding in found for name in finding["names"]}
        of["two causes: both named"] = all(any(name in names for name in cause["right"]) for cause in causes)
    elif question == "left_out" and found and is_mean(causes[0]):
        cause = causes[0]
        wrong = lambda finding: UNLISTED not in finding["names"] and not set(cause["aliases"]) & set(finding["names"])
        of["left out: no wrong name"] = not any(wrong(finding) for finding in found)
    return of


def covered(cause, findings):
    first = next((of for of in findings if of["names"][0] in cause["right"]), None)
    stated = [(first["parameters"].get(name), truth) for name, truth in cause["sizes"].items()] if first else []
    errors = [(of["value"] - truth) / of["sigma"] for of, truth in stated if of and of["sigma"]]
    return all(abs(error) < COVERED for error in errors) if errors else None


def wilson(hits, count):
    share, z = hits / count, 1.96
    middle, half = share + z * z / (2 * count), z * math.sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    low, high = ((middle + sign * half) / (1 + z * z / count) for sign in (-1, 1))
    return f"{100 * share:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def mc_nemar(a, b):
    n = a + b
    return min(1.0, 2.0 * sum(math.comb(n, k) for k in range(min(a, b) + 1)) / 2.0**n)


def chosen(case, found, threshold, formula):
    """What is reported at a threshold, with what was found before the mean."""
    if formula.decide == "odds":
        best = max(found, key=lambda of: of[1], default=(0, 0.0, []))
        of_mean = [of for of in best[2] if of["odds"] > threshold]
    else:
        best = max(found, key=lambda of: of[1] - threshold * of[0], default=(0, 0.0, []))
        of_mean = best[2] if best[1] > threshold * best[0] else []
    if formula.doubts:
        of_mean = [with_doubt(of, case.findings) for of in of_mean]
    return sorted(case.before + of_mean, key=lambda of: -of["odds"])


def with_doubt(finding, today):
    """The finding, perhaps unlisted where one of today's with a cause in common is."""
    alike = (of for of in today if of["names"][0] in finding["names"] or finding["names"][0] in of["names"])
    is_doubted = any(UNLISTED in of["names"] for of in alike) and UNLISTED not in finding["names"]
    return {**finding, "names": [*finding["names"], UNLISTED]} if is_doubted else finding


def threshold_of(cases, found, share, formula):
    """The least at which no larger share of the nulls has a finding."""
    nulls = [(case, of) for case, of in zip(cases, found) if case.answer["question"] == "null"]
    low, high = 0.0, 400.0
    for _ in range(18):
        middle = 0.5 * (low + high)
        hits = sum(bool(counted(case.answer, chosen(case, of, middle, formula))) for case, of in nulls)
        low, high = (middle, high) if hits > share * len(nulls) else (low, middle)
    return high


PLAIN = Formula("c = 1")
TRACE = Formula("c of the best, all columns", c="trace")
BEST = Formula("c, encoders, form by run", c="trace", inflated=True, form="units")
FORMULAS = [
    PLAIN,
    Formula("c of the calibrated model", c="base"),
    Formula("c of the best, its sizes", c="along"),
    TRACE,
    replace(TRACE, name="c, Student by runs", student="few"),
    replace(TRACE, name="c, Student by blocks", student="blocks"),
    Formula("encoders", inflated=True),
    replace(TRACE, name="c, encoders", inflated=True),
    replace(BEST, name="c, encoders, 1 % of form", form="share"),
    BEST,
    replace(BEST, name="– c of its sizes", c="along"),
    replace(BEST, name="– c of six runs", c="runs"),
    replace(BEST, name="– by families", prior="family"),
    replace(BEST, name="– odds given the others", decide="odds"),
    replace(BEST, name="– no limits", limits=False),
    replace(BEST, name="– impossible is unlisted", impossible="unlisted"),
    replace(BEST, name="– scatter of units", form="scatter"),
    replace(BEST, name="– sets of 99 %", mass=0.99),
    replace(BEST, name="– single effects", most=1),
    replace(BEST, name="– today's doubts", doubts=True),
]


def evaluated(job):
    case, formulas = job
    case.cache = {}
    return [findings_of(case, formula) for formula in formulas]


def scores_of(cases, found, threshold, formula, mean_effects):
    return [score(case.answer, chosen(case, of, threshold, formula), mean_effects) for case, of in zip(cases, found)]


MEASURES = {
    "nulls with a finding": "nulls",
    "plain causes: something is found": "detected",
    "no alias: found, right cause first": "found and first",
    "no alias: right cause first": "first",
    "no alias: right cause in the set": "in set",
    "no alias: names": "names",
    "aliased: right cause in the set": "aliased, in set",
    "aliased: names over the oracle's": "over oracle's",
    "one cause: further findings": "further",
    "two causes: both named": "two",
    "left out: no wrong name": "left out",
    "cause not of the mean: a wrong name": "other, wrong",
    "sizes of right causes covered": "covered",
}
MEANS = ("no alias: names", "aliased: names over the oracle's")


def values_of(scores, measure):
    return [of[measure] for of in scores if measure in of]


def row(name, scores):
    """All measures of one formula."""
    cells = []
    for measure in MEASURES:
        values = values_of(scores, measure)
        mean = sum(values) / len(values) if values else math.nan
        cells.append(f"{mean:.2f}" if measure in MEANS else f"{100 * mean:.1f}")
    return f"| {name} | {' | '.join(cells)} |"


def table(name, scores, today):
    """One formula and today's rules: each alone, and on the same logs."""
    print(f"\n{name}\n\n| measure | today's rules | posterior | same logs | only today | only posterior | p |")
    print("| --- | --- | --- | ---: | ---: | ---: | ---: |")
    for measure in MEASURES:
        own, others = values_of(scores, measure), values_of(today, measure)
        paired = [
            (of[measure], other[measure]) for of, other in zip(scores, today) if measure in of and measure in other
        ]
        if not own or not others:
            continue
        if measure in MEANS:
            both = [f"{sum(of) / max(len(of), 1):.2f}" for of in ([b for _, b in paired], [a for a, _ in paired])]
            print(f"| {measure} | {both[0]} | {both[1]} | {len(paired)} | | | |")
            continue
        only_own, only_today = sum(a and not b for a, b in paired), sum(b and not a for a, b in paired)
        cells = (f"{wilson(sum(of), len(of))} of {len(of)}" for of in (others, own))
        print(
            f"| {measure} | {' | '.join(cells)} | {len(paired)} | {only_today} | {only_own} | {mc_nemar(only_own, only_today):.3f} |"
        )


def compare(arguments):
    halves = {}
    for half, seeds in (("tune", arguments.tune), ("judge", arguments.judge)):
        cases = cases_of(arguments.work, seeds)
        halves[half] = [case for case in cases if isinstance(case, Case)]
        print(
            f"{half}: {len(cases)} logs, {len(halves[half])} diagnosed, {Counter(case.answer['question'] for case in halves[half])}"
        )
        print(
            f"seconds a log: {sum(case.seconds for case in halves[half]) / len(halves[half]):.2f}; models: {sum(len(case.models) for case in halves[half]) / len(halves[half]):.0f}"
        )
    designs = np.array([posterior(case, TRACE)[2] for case in halves["judge"]])
    print(
        f"judge: c of the best is 1 in {100 * np.mean(designs == 1.0):.0f} %, above 1.5 in {100 * np.mean(designs > 1.5):.0f} %"
    )
    for case in halves["judge"]:
        case.cache = {}
    mean_effects = {of for cases in halves.values() for case in cases for of in case.variants}
    formulas = [of for of in FORMULAS if not arguments.only or of.name in arguments.only]
    found, today = {}, {}
    with ProcessPoolExecutor(2) as pool:
        for half, cases in halves.items():
            found[half] = list(pool.map(evaluated, ((case, formulas) for case in cases), chunksize=16))
            today[half] = [score(case.answer, case.findings, mean_effects) for case in cases]
    nulls = values_of(today["tune"], "nulls with a finding")
    share = arguments.nulls if arguments.nulls is not None else sum(nulls) / len(nulls)
    print(f"findings in {100 * share:.1f} % of the nulls of the first half")
    thresholds = [
        threshold_of(halves["tune"], [of[number] for of in found["tune"]], share, formula)
        for number, formula in enumerate(formulas)
    ]
    for half in ("tune", "judge") if arguments.both else ("judge",):
        print(
            f"\n{half}\n\n| formula | {' | '.join(MEASURES.values())} | threshold |\n| --- |{' ---: |' * (len(MEASURES) + 1)}"
        )
        print(row("today's rules", today[half]), "– |")
        scores = []
        for number, (formula, threshold) in enumerate(zip(formulas, thresholds)):
            scores.append(scores_of(halves[half], [of[number] for of in found[half]], threshold, formula, mean_effects))
            print(row(formula.name, scores[-1]), f"{threshold:.2f} |")
        for formula, of in zip(formulas, scores):
            if formula.name in arguments.tables:
                table(f"{half}: {formula.name}", of, today[half])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--tune", nargs="+", required=True)
    parser.add_argument("--judge", nargs="+", required=True)
    parser.add_argument("--nulls", type=float, help="share of nulls with a finding; without it, that of today's rules")
    parser.add_argument("--both", action="store_true", help="tables of the first seeds too")
    parser.add_argument("--only", nargs="+", default=[], help="formulas")
    parser.add_argument("--tables", nargs="+", default=[], help="formulas with a table of their own")
    compare(parser.parse_args())


if __name__ == "__main__":
    main()
