"""Logs that `replay` draws: an answer.json each, and the sessions of the diagnosis in `training`."""

import json
import os
import subprocess


def answer_of(log):
    return json.loads((log / "answer.json").read_text())


def diagnose(yair, log, *words):
    """Diagnoses a log on one thread, without the effects that are not to be named; `words` are further arguments."""
    sessions = sorted(str(folder) for folder in (log / "training").iterdir())
    without = [word for effect in answer_of(log).get("without", []) for word in ("--without", effect)]
    command = [yair, "diagnose", *sessions, *without, "--json", "--quiet", *words]
    return subprocess.run(command, capture_output=True, env={**os.environ, "RAYON_NUM_THREADS": "1"})
