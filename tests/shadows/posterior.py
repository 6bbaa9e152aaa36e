"""Names by the log odds alone: what a plain posterior over single effects says, beside what `diagnose` reports.

An experiment beside `diagnose` (docs/one-model.md). Its JSON has a log Bayes factor over none of every mean effect of the
catalogue (`candidates`), reported or refused. Here the effects are ranked by it and by nothing else: no gate, no doubt.

    python posterior.py --logs DIR --yair PATH [--work DIR]

DIR holds logs with an answer.json each, as `replay` draws them (target/replay/logs/blind/SEED). The threshold of the log odds
is set on the nulls of the other half of the logs, for 5 % of them with a finding.
"""

import argparse
import hashlib
import json
import math
import os
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

FALSE_ALARMS = 0.05
MASS = 0.95
# Form errors: log odds are divided by this share of the best one, as `diagnose` has it.
FORM_SHARES = (0.0, 0.01, 0.03)


def diagnosed(yair, digest, log, work):
    kept = work / digest / f"{log.parent.name}-{log.name}.json"
    if not kept.exists():
        answer = json.loads((log / "answer.json").read_text())
        sessions = sorted(str(folder) for folder in (log / "training").iterdir())
        without = [word for name in answer.get("without", []) for word in ("--without", name)]
        environment = {**os.environ, "RAYON_NUM_THREADS": "1"}
        ran = subprocess.run([yair, "diagnose", *sessions, *without, "--json", "--quiet"], capture_output=True, env=environment)
        document = json.loads(ran.stdout) if ran.returncode in (0, 3) else None
        short = document and {key: document[key] for key in ("candidates", "findings")}
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps(short))
    return json.loads(kept.read_text())


def ranked(document):
    """Effects with their log odds, the best first."""
    return sorted(((of["log_odds"], of["id"]) for of in document["candidates"]), reverse=True)


def ambiguity_set(ranks, form_share):
    """The best effects that have the mass together."""
    scale = max(1.0, form_share * ranks[0][0])
    weights = [math.exp((odds - ranks[0][0]) / scale) for odds, _ in ranks]
    names, so_far = [], 0.0
    for weight, (_, name) in zip(weights, ranks):
        names.append(name)
        so_far += weight
        if so_far >= MASS * sum(weights):
            break
    return names


def wilson(hits, count):
    if count == 0:
        return "–"
    share, z = hits / count, 1.96
    middle, half = share + z * z / (2 * count), z * math.sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    return f"{100 * share:5.1f} ({100 * (middle - half) / (1 + z * z / count):.1f} to {100 * (middle + half) / (1 + z * z / count):.1f}) of {count}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=Path, nargs="+", required=True)
    parser.add_argument("--yair", required=True)
    parser.add_argument("--work", type=Path, default=Path("target/shadows"))
    arguments = parser.parse_args()
    digest = hashlib.sha256(Path(arguments.yair).read_bytes()).hexdigest()[:12]
    logs = sorted(file.parent for of in arguments.logs for file in of.glob("*/answer.json"))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        documents = list(pool.map(lambda log: diagnosed(arguments.yair, digest, log, arguments.work), logs))
    answers = [json.loads((log / "answer.json").read_text()) for log in logs]
    # A single effect is compared with none: where something ordinary must be in the model as well, that says nothing.
    cases = [(answer, document) for answer, document in zip(answers, documents) if document is not None and not answer["exempt"]]
    halves = cases[: len(cases) // 2], cases[len(cases) // 2 :]
    print(f"{len(logs)} logs, of which {len(cases)} are diagnosed by {digest} and have nothing exempt")
    thresholds = []
    for other in reversed(halves):
        nulls = sorted((ranked(document)[0][0] for answer, document in other if answer["question"] == "null"), reverse=True)
        thresholds.append(nulls[int(FALSE_ALARMS * len(nulls))])
        print(f"threshold: log odds {thresholds[-1]:.2f}, from {len(nulls)} nulls of the other half")

    def reported(answer, document):
        causes = [name for cause in answer["causes"] for name in cause["right"]]
        is_exempt = lambda of: any(name in answer["exempt"] and name not in causes for name in of["names"])
        return [of for of in document["findings"] if not is_exempt(of)]

    rows = {}

    def count(measure, way, hit):
        hits, all_of = rows.setdefault(measure, {}).get(way, (0, 0))
        rows[measure][way] = hits + bool(hit), all_of + 1

    sizes = {}
    for threshold, (answer, document) in ((of, case) for of, half in zip(thresholds, halves) for case in half):
        ranks, findings = ranked(document), reported(answer, document)
        top = ranks[0]
        question = answer["question"]
        if question == "null":
            count("nulls with a finding", "reported", findings)
            count("nulls with a finding", "log odds", top[0] > threshold)
        if question != "one":
            continue
        cause = answer["causes"][0]
        # Faults of records and what only scatters have no log odds here.
        if not any(name in dict((b, a) for a, b in ranks) for name in cause["right"]):
            continue
        if cause["is_plain"]:
            count("plain mean effects: something is found", "reported", findings)
            count("plain mean effects: something is found", "log odds", top[0] > threshold)
        # The same cases for both: those that both detect.
        if findings and top[0] > threshold:
            if not cause["is_aliased"]:
                count("no alias: right cause first", "reported", findings[0]["names"][0] in cause["right"])
                count("no alias: right cause first", "log odds", top[1] in cause["right"])
            kind = "aliased: right cause in the set" if cause["is_aliased"] else "no alias: right cause in the set"
            sets = {"reported": [name for name in findings[0]["names"]]}
            sets |= {f"log odds, form errors of {100 * share:.0f} %": ambiguity_set(ranks, share) for share in FORM_SHARES}
            for way, names in sets.items():
                count(kind, way, any(name in names for name in cause["right"]))
                sizes.setdefault((kind, way), []).append(len(names))
    for measure, ways in rows.items():
        for way, (hits, all_of) in ways.items():
            size = sizes.get((measure, way))
            mean = f", {sum(size) / len(size):.2f} names" if size else ""
            print(f"{measure:<42} {way:<32} {wilson(hits, all_of)}{mean}")


if __name__ == "__main__":
    main()
