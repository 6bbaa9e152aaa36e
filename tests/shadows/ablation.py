"""What each rule is worth: how often it decides, and what the same logs come to without it (docs/ablation.md).

    python ablation.py --logs DIR... --yair PATH --replay PATH [--rules RULE...] [--most N] [--every N] [--work DIR]

DIR holds logs with an answer.json each, as `replay` draws them. One run of every log counts the decisions of each rule. Then
each rule is switched off by itself on at most N of the logs in which it decided, and `replay` compares the two builds there.
A rule that never decided is not run. Results are kept in the working folder by the digest of the executable.
"""

import argparse
import hashlib
import json
import math
import os
import random
import re
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from drawn_logs import diagnose

# The same logs whenever a rule is asked again.
SEED = 66


def decisions(yair, log, work):
    """How often each rule decided in a log."""
    name = hashlib.sha256(str(log.resolve()).encode()).hexdigest()[:16]
    kept = work / "decisions" / f"{name}.json"
    if not kept.exists():
        kept.parent.mkdir(parents=True, exist_ok=True)
        settings = kept.with_suffix(".toml")
        settings.write_text(f'decisions = "{kept}.new"\n')
        diagnose(yair, log, "--settings", str(settings))
        settings.unlink()
        written = Path(f"{kept}.new")
        written.rename(kept) if written.exists() else kept.write_text("{}")
    return json.loads(kept.read_text())


def without_rule(arguments, rule, logs, work):
    """The table of `replay` on some logs, with a rule and without it."""
    kept = work / "without" / f"{rule}.json"
    if not kept.exists():
        corpus = work / "corpora" / rule
        corpus.mkdir(parents=True, exist_ok=True)
        for log in logs:
            link = corpus / f"{log.parent.name}-{log.name}"
            if not link.is_symlink():
                link.symlink_to(log.resolve())
        settings = work / f"{rule}.toml"
        settings.write_text(f'off = ["{rule}"]\n')
        command = [arguments.replay, arguments.yair, f"{arguments.yair} --settings {settings}", "--corpus", str(corpus)]
        command += ["--cases", "0", "--robots", "0", "--mixed", "0", "--store", str(work / "store"), "--json"]
        ran = subprocess.run(command, capture_output=True, check=False)
        if ran.returncode != 0:
            return None
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_bytes(ran.stdout)
    return json.loads(kept.read_text())


def purposes():
    """What each rule is for, by its name, from the sources."""
    found, said = {}, []
    for line in (Path(__file__).parents[2] / "crates/rules/src/lib.rs").read_text().splitlines():
        line = line.strip()
        if line.startswith("/// "):
            said.append(line.removeprefix("/// "))
        elif re.fullmatch(r"[A-Z]\w+,", line):
            found[re.sub(r"(?<!^)(?=[A-Z])", "_", line.rstrip(",")).lower()] = " ".join(said)
            said = []
        else:
            said = []
    return found


def moved(table):
    """The measures that differ without a rule: with and without it, logs better and worse with it, p."""
    said = []
    for row in table["all"]:
        if row["measure"] == "seconds":
            low, high = row["difference"]
            if low > 0 or high < 0:
                said.append(f"time × {math.exp(low):.2f} to {math.exp(high):.2f}")
        elif sum(row["discordant"]) > 0 and row["measure"] not in ("rms_z", "gain", "drift"):
            before, after = (f"{100 * value:.0f}" for value in row["pooled"])
            counts = " : ".join(str(count) for count in row["discordant"])
            said.append(f"{row['measure']} {before} → {after} % of {row['logs']} ({counts}, p {row['p_value']:.2f})")
        elif row["p_value"] < 0.05 and row["measure"] != "gain":
            said.append(f"{row['measure']} {row['pooled'][0]:.2f} → {row['pooled'][1]:.2f} (p {row['p_value']:.3f})")
    return "; ".join(said) or "nothing"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=Path, nargs="+", required=True)
    parser.add_argument("--yair", required=True)
    parser.add_argument("--replay", required=True)
    parser.add_argument("--rules", nargs="*")
    parser.add_argument("--most", type=int, default=150, help="logs of a rule at the most")
    parser.add_argument("--every", type=int, default=1, help="take every so many-th log of a folder")
    parser.add_argument("--work", type=Path, default=Path("target/ablation"))
    arguments = parser.parse_args()
    digest = hashlib.sha256(Path(arguments.yair).read_bytes()).hexdigest()[:12]
    work = (arguments.work / digest).resolve()
    logs = [
        log
        for folder in arguments.logs
        for log in sorted(file.parent for file in folder.glob("*/answer.json"))[:: arguments.every]
    ]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        counts = list(pool.map(lambda log: decisions(arguments.yair, log, work), logs))
    deciding = {}
    for log, of_rules in zip(logs, counts):
        for rule in of_rules:
            deciding.setdefault(rule, []).append(log)
    print(f"{len(logs)} logs")
    tables = {}
    for rule, its_logs in sorted(deciding.items(), key=lambda item: len(item[1])):
        print(f"{rule}: decides in {len(its_logs)} ({100 * len(its_logs) / len(logs):.1f} %)", flush=True)
    for rule in sorted(deciding, key=lambda rule: len(deciding[rule])) if arguments.rules is None else arguments.rules:
        its_logs = deciding.get(rule, [])
        if not its_logs:
            continue
        print(f"without {rule}, {min(arguments.most, len(its_logs))} of its {len(its_logs)} logs:")
        chosen = random.Random(SEED).sample(its_logs, min(arguments.most, len(its_logs)))
        table = without_rule(arguments, rule, chosen, work)
        if table is None:
            print("    replay failed")
            continue
        print("    ", moved(table), flush=True)
        tables[rule] = (min(arguments.most, len(its_logs)), moved(table))
    print("| rule | what it is for | decides in, % | switched off in | moves |")
    print("| --- | --- | ---: | ---: | --- |")
    for rule, what in purposes().items():
        share = 100 * len(deciding.get(rule, [])) / len(logs)
        asked, moves = tables.get(rule, ("–", "–"))
        print(f"| `{rule}` | {what} | {share:.1f} | {asked} | {moves} |")


if __name__ == "__main__":
    main()
