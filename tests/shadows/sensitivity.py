"""What half and double of each setting change in the diagnoses of drawn logs (docs/ablation.md).

    python sensitivity.py --logs DIR... --yair PATH [--settings NAME...] [--most N] [--work DIR]

DIR holds logs with an answer.json each, as `replay` draws them. The settings are the fields of `rules::settings!` whose
comment says that no record says what they were tuned on, or those that are named (room.subject.field). A log counts
  names      where the findings have other names, in their order;
  geometry   where they have the same, and a length of the calibration moves by more than a tenth of its standard deviation;
  next       where these are the same, and the next drive differs.
The right first names of logs with one cause, and the nulls with a finding, are counted before and after.
"""

import argparse
import hashlib
import json
import os
import random
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from drawn_logs import answer_of, diagnose

# The same logs whenever a setting is asked again.
SEED = 66
CRATES = Path(__file__).parents[2] / "crates"


def settings():
    """The fields of all rooms: name, expression of the default, comment."""
    for crate in ("preflight", "estimation", "dataset", "effects", "diagnose"):
        sources = list((CRATES / crate / "src").glob("settings.rs")) + list((CRATES / crate / "src/settings").glob("*.rs"))
        texts = [source.read_text() for source in sources]
        rooms = dict(found[::-1] for text in texts for found in re.findall(r"^    (\w+): (?:\w+::)*(\w+) as \w+,", text, re.M))
        for text in texts:
            for block in re.findall(r"rules::settings! \{\n    (\w+)\n(.*?)\n\}", text, re.S):
                subject, fields = rooms[block[0]], block[1]
                pattern = r"((?:    ///[^\n]*\n)+)    (\w+): ([^=]+?) =\s+(.*?),(?=\n    //|\Z)"
                for comment, field, kind, default in re.findall(pattern, fields, re.S):
                    yield f"{crate}.{subject}.{field}", kind, default, " ".join(comment.replace("///", "").split())


def scaled(kind, default, factor):
    """The TOML of a setting by a factor; None where it is no number, or stays what it is."""
    text = re.sub(r"(?<=[\d.])_(?=\d)", "", default)
    text = re.sub(r"\b(?:\w+::)*PI\b", "3.141592653589793", text)
    text = re.sub(r"\b(?:\w+::)*FRAC_PI_2\b", "1.5707963267948966", text)
    if not re.fullmatch(r"[\d.eE+\-*/()\[\], ]+", text):
        return None
    value = eval(text)  # arithmetic of literals alone
    if isinstance(value, list) and any(isinstance(of, (list, tuple)) for of in value):
        return None
    values = value if isinstance(value, list) else [value]
    if "f64" in kind:
        new = [float(of) * factor for of in values]
    else:
        new = [max(int(of * factor), 1) if of else 0 for of in values]
    if new == values:
        return None
    return json.dumps(new if isinstance(value, list) else new[0])


def outcome(yair, log, *words):
    """What a diagnosis says, as far as it is compared."""
    ran = diagnose(yair, log, *words)
    if ran.returncode not in (0, 1) or not ran.stdout:
        return {"refused": ran.returncode}
    said = json.loads(ran.stdout)
    names = [finding["names"] for finding in said["findings"]]
    method = (said.get("calibration") or {}).get("methods", [{}])[0]
    lengths = {name: (of.get("value"), of.get("sigma")) for name, of in (method.get("parameters") or {}).items()}
    return {"names": names, "lengths": lengths, "next": said.get("next_experiment")}


def kind_of_change(before, after):
    if before.get("refused") != after.get("refused") or before.get("names") != after.get("names"):
        return "names"
    for name, (value, sigma) in before.get("lengths", {}).items():
        new = after["lengths"].get(name, (None, None))
        if new[0] is None or (sigma and abs(new[0] - value) > 0.1 * sigma) or (sigma and abs(new[1] / sigma - 1) > 0.1):
            return "geometry"
    return "next" if before.get("next") != after.get("next") else None


def score(log, said):
    """1 where a sound robot has no finding, or the one cause comes first; None where neither is asked."""
    answer = answer_of(log)
    names = said.get("names", [])
    if answer["question"] == "null":
        return float(not names)
    if len(answer["causes"]) == 1 and not answer.get("without"):
        return float(bool(names) and names[0][0] in answer["causes"][0]["right"])
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=Path, nargs="+", required=True)
    parser.add_argument("--yair", required=True)
    parser.add_argument("--settings", nargs="*")
    parser.add_argument("--most", type=int, default=48)
    parser.add_argument("--work", type=Path, default=Path("target/sensitivity"))
    arguments = parser.parse_args()
    digest = hashlib.sha256(Path(arguments.yair).read_bytes()).hexdigest()[:12]
    work = (arguments.work / digest).resolve()
    work.mkdir(parents=True, exist_ok=True)
    logs = [file.parent for folder in arguments.logs for file in sorted(folder.glob("*/answer.json"))]
    logs = random.Random(SEED).sample(logs, min(arguments.most, len(logs)))
    kept = work / f"outcomes-{len(logs)}.json"
    known = json.loads(kept.read_text()) if kept.exists() else {}
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        before = known.setdefault("", None) or list(pool.map(lambda log: outcome(arguments.yair, log), logs))
        known[""] = before
        print("| setting | times | names | geometry | next | better : worse |\n| --- | ---: | ---: | ---: | ---: | --- |")
        for name, kind, default, comment in settings():
            asked = name in arguments.settings if arguments.settings else "no record" in comment
            for factor in (0.5, 2.0) if asked else ():
                value = scaled(kind, default, factor)
                if value is None:
                    continue
                crate, subject, field = name.split(".")
                file = work / f"{name}-{factor}.toml"
                file.write_text(f"[{crate}.{subject}]\n{field} = {value}\n")
                key = f"{name} {value}"
                if key not in known:
                    call = lambda log: outcome(arguments.yair, log, "--settings", str(file))
                    known[key] = list(pool.map(call, logs))
                    kept.write_text(json.dumps(known))
                after = [json.loads(json.dumps(said)) for said in known[key]]
                changes = [kind_of_change(*pair) for pair in zip(json.loads(json.dumps(before)), after)]
                scores = [(score(log, old), score(log, new)) for log, old, new in zip(logs, before, after)]
                better, worse = (sum(1 for old, new in scores if old is not None and sign * (new - old) > 0) for sign in (1, -1))
                counts = " | ".join(str(changes.count(of)) for of in ("names", "geometry", "next"))
                print(f"| `{name}` | {factor} | {counts} | {better} : {worse} |", flush=True)


if __name__ == "__main__":
    main()
