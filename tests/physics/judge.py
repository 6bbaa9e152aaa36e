"""Asks `yair` what is wrong with each log, and scores the answers: `python judge.py --yair PATH --logs DIR --out results.json`.

`yair diagnose` sees the training runs; `yair evaluate` then drives the held-out runs of the same robot by dead reckoning, with the configured
geometry, with the calibration alone and with the extended model. A log that this binary has judged is not judged again.

Every robot creeps in bends and under acceleration and drags a castor (docs/physics-judge.md). Findings that name these and no right cause are true of every robot;
they are set aside before the first cause is read, and `first_strict` says what stands first with them. The outcomes:

    right_first  the first finding that is left has a right cause in the first place
    in_set       a right cause is among the causes of some finding
    unlisted     the first finding that is left is in no catalogue
    wrong        the first finding that is left has another name
    nothing      no finding is left
    failed       the command did not answer
"""
import argparse
import hashlib
import json
import math
import os
import pathlib
import subprocess
import tempfile
import time

import numpy as np

from faults import BY_NAME, FAULTS, OWN

OUTCOMES = ("right_first", "in_set", "unlisted", "wrong", "nothing", "failed")
TIMEOUT_S = 300.0
RESAMPLES = 4000


def outcome_of(findings: list[dict], right: tuple[str, ...]) -> tuple[str, str | None]:
    """The outcome and the first cause that is left, of findings as they are printed."""
    left = [finding for finding in findings if set(finding["names"]) & set(right) or not set(finding["names"]) & set(OWN)]
    if not left:
        return "nothing", None
    first = left[0]["names"][0]
    if first in right:
        return "right_first", first
    if any(set(finding["names"]) & set(right) for finding in left):
        return "in_set", first
    return ("unlisted" if first == "unlisted" else "wrong"), first


def answer(command: list[str]) -> dict:
    """The JSON that a command prints."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S)
    if done.returncode != 0:
        raise RuntimeError(f"exit {done.returncode}: {done.stderr.strip()[-300:]}")
    return json.loads(done.stdout)


def judge(yair: str, log: pathlib.Path, scratch: pathlib.Path) -> dict:
    """One row of results."""
    made = json.loads((log / "made.json").read_text())
    right = BY_NAME[made["fault"]].right
    row = {"fault": made["fault"], "seed": made["seed"], "size": made["size"]}
    started = time.perf_counter()
    try:
        said = answer([yair, "diagnose", str(log / "training"), "--json", "--quiet", "--force", "--out", str(scratch)])
        row["diagnose_s"] = round(time.perf_counter() - started, 2)
        row["verdict"] = said["verdict"]
        row["findings"] = [{"id": f["id"], "names": f["names"], "probability": f["probability"], "z": f["z"], "carries_over": f.get("carries_over"),
                            "parameters": f["parameters"], "term": f.get("unlisted_term")} for f in said["findings"]]
        row["failed_checks"] = [check["name"] for check in said["checks"] if not check["passes"]]
        row["outcome"], row["first"] = outcome_of(said["findings"], right)
        row["set"] = said["findings"] and next((f["names"] for f in said["findings"] if f["names"][0] == row["first"]), [])
        row["first_strict"] = said["findings"][0]["names"][0] if said["findings"] else None
        command = [yair, "evaluate", str(log / "held_out"), "--json", "--quiet", "--calibration", str(scratch / "calibration.toml")]
        if (scratch / "extended.toml").exists():
            command += ["--calibration", str(scratch / "extended.toml")]
        drifts = [calibration["drift_percent"] for calibration in answer(command)["calibrations"]]
        row["drift_configured"], row["drift_calibrated"], row["drift_extended"] = drifts[0], drifts[1], drifts[-1]
    except (RuntimeError, subprocess.TimeoutExpired, KeyError, json.JSONDecodeError) as error:
        row["outcome"], row["error"] = "failed", f"{type(error).__name__}: {error}"
    row["seconds"] = round(time.perf_counter() - started, 2)
    return row


def wilson(hits: int, of: int) -> tuple[float, float]:
    """The 95 % interval of a share."""
    z = 1.959964
    centre, half = hits + z * z / 2, z * math.sqrt(hits * (of - hits) / of + z * z / 4)
    return (centre - half) / (of + z * z), (centre + half) / (of + z * z)


def drift_ratio(rows: list[dict]) -> tuple[float, float, float]:
    """Geometric mean over logs of drift extended / calibrated, and its 95 % interval by resampling logs."""
    logs = np.array([math.log(row["drift_extended"] / row["drift_calibrated"]) for row in rows])
    rng = np.random.default_rng(1)
    means = logs[rng.integers(len(logs), size=(RESAMPLES, len(logs)))].mean(axis=1)
    return tuple(float(np.exp(value)) for value in (logs.mean(), np.percentile(means, 2.5), np.percentile(means, 97.5)))


def table(rows: list[dict]) -> str:
    """A Markdown row a fault, and one of all faults."""
    lines = ["| fault | logs | right first | 95 % | in the set | unlisted | wrong | nothing | failed | calibrated % | extended % | ratio | 95 % |",
             "| --- | ---: | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | --- |"]
    faulty = [row for row in rows if BY_NAME[row["fault"]].right]
    for name, chosen in [*((fault.name, [row for row in rows if row["fault"] == fault.name]) for fault in FAULTS), ("all faults", faulty)]:
        if not chosen:
            continue
        counts = [sum(row["outcome"] == outcome for row in chosen) for outcome in OUTCOMES]
        low, high = wilson(counts[0], len(chosen))
        drifted = [row for row in chosen if row.get("drift_extended")]
        right = f"{counts[0]} | {100 * low:.0f} to {100 * high:.0f}" if name != "nothing_built_in" else "– | –"
        cells = f"| `{name}` | {len(chosen)} | {right} | " + " | ".join(str(count) for count in counts[1:])
        if drifted:
            ratio, below, above = drift_ratio(drifted)
            medians = [float(np.median([row[f"drift_{kind}"] for row in drifted])) for kind in ("calibrated", "extended")]
            cells += f" | {medians[0]:.3f} | {medians[1]:.3f} | {ratio:.2f} | {below:.2f} to {above:.2f} |"
        else:
            cells += " | – | – | – | – |"
        lines.append(cells.replace("`all faults`", "all faults"))
    return "\n".join(lines)


def first_causes(rows: list[dict]) -> str:
    """What stood first, with findings of every robot set aside: a Markdown row a fault."""
    lines = ["| fault | right | first causes | first with every robot's own |", "| --- | --- | --- | --- |"]
    for fault in FAULTS:
        chosen = [row for row in rows if row["fault"] == fault.name]
        if chosen:
            cells = []
            for key in ("first", "first_strict"):
                names = [row.get(key) or "nothing" for row in chosen]
                cells.append(", ".join(f"{name} {names.count(name)}" for name in sorted(set(names), key=lambda n: (-names.count(n), n))))
            lines.append(f"| `{fault.name}` | {', '.join(fault.right) or '–'} | {cells[0]} | {cells[1]} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--yair", type=pathlib.Path, help="the command; without it the tables of --out alone are printed")
    parser.add_argument("--logs", type=pathlib.Path, help="a folder of make_logs.py")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="results, a row a log")
    arguments = parser.parse_args()
    results = json.loads(arguments.out.read_text()) if arguments.out.exists() else {"binary_sha256": None, "logs": {}}
    if arguments.yair:
        binary = hashlib.sha256(arguments.yair.read_bytes()).hexdigest()
        if results["binary_sha256"] != binary:
            results = {"binary_sha256": binary, "logs": {}}
        for made in sorted(arguments.logs.glob("*/made.json"), key=lambda path: path.parent.name.rpartition("-")[::-1]):
            name = made.parent.name
            if name in results["logs"]:
                continue
            with tempfile.TemporaryDirectory() as scratch:
                row = judge(str(arguments.yair.resolve()), made.parent, pathlib.Path(scratch))
            results["logs"][name] = row
            print(f"{name}: {row['outcome']} ({row.get('first')}), {row['seconds']:.0f} s", flush=True)
            partial = arguments.out.with_suffix(".partial")
            partial.write_text(json.dumps(results, indent=1) + "\n")
            os.replace(partial, arguments.out)
    rows = list(results["logs"].values())
    print(f"\n{table(rows)}\n\n{first_causes(rows)}")
    print(f"\n{len(rows)} logs, {sum(row['seconds'] for row in rows):.0f} s, binary {results['binary_sha256'][:12]}")


if __name__ == "__main__":
    main()
