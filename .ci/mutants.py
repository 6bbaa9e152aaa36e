#!/usr/bin/env python3
"""Changes a random sample of a crate's expressions, one at a time, and asks whether a test fails.

.ci/run mutants CRATE [SEED] [own] [again]

cargo-mutants lists what can be changed. All changes of the sample are compiled together: each changed function holds its body once for each change, behind a
switch that an environment variable sets (mutant schemata: Untch, Offutt & Harrold 1993). What cannot stand behind a switch is compiled alone. The crate's own
tests run first, and one program of tests/ for what they let pass; `own` leaves the program out. `again` asks only what had no failing test the last time, as
long as the crate's sources stay as they were.
"""

import collections
import json
import math
import os
import re
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

PROGRAM = {"kinematics": "methods", "estimation": "methods", "calib": "methods", "diagnose": "diagnosis_numbers"}
# So many are drawn that 80 compile in every crate.
DRAWN = 100
# Asks for memory ahead of time, and changes no result.
LEFT_OUT = "crates/kinematics/src/prefetch.rs"
# Values that cargo-mutants guesses by a constructor do not compile with the workspace's types, and one function has hundreds.
GUESSED = re.compile(r" with .*::(new|from|from_iter)\(")
# Tests that take ten times as long as without a change are stopped, which counts as caught.
MAX_SLOWDOWN, MIN_LIMIT_S = 10, 60
SWITCH = "YAIR_MUTANT"
SWITCH_SOURCE = f'''
static MUTANT: std::sync::LazyLock<u32> = std::sync::LazyLock::new(|| {{
    std::env::var("{SWITCH}").ok().and_then(|number| number.parse().ok()).unwrap_or(0)
}});

/// The change that is switched on; 0 for none.
pub(crate) fn mutant() -> u32 {{
    *MUTANT
}}
'''


def run(*command, **options):
    return subprocess.run(command, check=True, text=True, **options)


def failed(message):
    sys.exit(f"failed: mutants: {message}")


class Tree:
    """A clone of the last commit in which one crate is changed; `program` of tests/ is asked too, if there is one."""

    def __init__(self, root, target, crate, program):
        self.target, self.crate, self.program = target, crate, program
        self.path = target / "tree"
        if not self.path.is_dir():
            run("git", "clone", "--quiet", "--shared", root, self.path)
        run("git", "-C", self.path, "fetch", "--quiet", root, "HEAD")
        run("git", "-C", self.path, "checkout", "--quiet", "--force", "--detach", "FETCH_HEAD")
        self.reset()

    def reset(self):
        run("git", "-C", self.path, "checkout", "--quiet", "--force", ".")
        run("git", "-C", self.path, "clean", "--quiet", "--force", "-d")
        # Lints are for the sources as they are.
        manifest = self.path / "crates" / self.crate / "Cargo.toml"
        manifest.write_text(re.sub(r"(?ms)^\[lints\]\n.*?(?=^\[|\Z)", "", manifest.read_text()))

    def mutants(self):
        """All changes of the crate, in cargo-mutants' order."""
        # A macro declares the methods, and cargo-mutants expands none: lines that the compiler drops name their files to it.
        methods = self.path / "crates/calib/src/methods"
        index = methods / "mod.rs"
        modules = sorted(file.stem for file in methods.iterdir() if file.name != "mod.rs")
        text = index.read_text()
        index.write_text(text + "".join(f"#[cfg(any())]\nmod {module};\n" for module in modules))
        listed = run("cargo", "mutants", "--dir", self.path, "--list", "--json", "--package", self.crate, stdout=subprocess.PIPE).stdout
        index.write_text(text)
        return [mutant for mutant in json.loads(listed) if mutant["file"] != LEFT_OUT and not GUESSED.search(mutant["name"])]

    def executables(self, package, *targets):
        """The test programs of a package, built; or the compiler's errors."""
        command = ["cargo", "test", "--profile", "mutants", f"--config=profile.mutants.package.{self.crate}.opt-level=1"]
        command += ["--package", package, *targets, "--no-run", "--message-format=json"]
        environment = dict(os.environ, CARGO_INCREMENTAL="1", CARGO_TARGET_DIR=str(self.target / "target"))
        built = subprocess.run(command, cwd=self.path, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        messages = [json.loads(line) for line in built.stdout.splitlines() if line.startswith("{")]
        if built.returncode == 0:
            tests = [message for message in messages if message.get("executable") and message["profile"]["test"]]
            return [(message["executable"], Path(message["manifest_path"]).parent) for message in tests], []
        errors = [message["message"] for message in messages if message.get("reason") == "compiler-message"]
        errors = [error for error in errors if error["level"] == "error"]
        return [], errors or [{"spans": [], "message": built.stderr[-2000:], "rendered": built.stderr[-2000:]}]

    def programs(self):
        """Both sets of test programs: the crate's own and that of tests/; or the compiler's errors."""
        own, errors = self.executables(self.crate, "--lib", "--tests")
        beside = []
        if self.program and not errors:
            beside, errors = self.executables("yair", "--test", self.program)
        return (None, errors) if errors else ({"own": own, "program": beside}, [])


def offset_in(text):
    """Where a place of cargo-mutants' stands in a text."""
    starts = [0]
    for line in text.split("\n"):
        starts.append(starts[-1] + len(line) + 1)
    return lambda place: starts[place["line"] - 1] + place["column"] - 1


def changed(text, mutant):
    at = offset_in(text)
    start, end = at(mutant["span"]["start"]), at(mutant["span"]["end"])
    return text[:start] + mutant["replacement"] + text[end:]


def body_start(text, at):
    """Where a function's body begins that is declared at a place."""
    depth = 0
    while True:
        if text.startswith("//", at):
            at = text.index("\n", at)
        elif text.startswith("/*", at):
            at = text.index("*/", at) + 2
            continue
        elif text[at] in "([":
            depth += 1
        elif text[at] in ")]":
            depth -= 1
        elif text[at] == "{" and depth == 0:
            return at
        at += 1


def switched(text, mutants):
    """A file's text with changes behind the switch, by number, and the numbers that found no place."""
    at = offset_in(text)
    functions, unplaced = collections.defaultdict(list), []
    for number, mutant in mutants:
        function = mutant["function"]
        if function is None:
            unplaced.append(number)
        else:
            functions[at(function["span"]["start"]), at(function["span"]["end"])].append((number, mutant))
    pieces, last = [], len(text) + 1
    for (start, end), own in sorted(functions.items(), reverse=True):
        body_at = body_start(text, start)
        spans = [(at(mutant["span"]["start"]), at(mutant["span"]["end"])) for _, mutant in own]
        if end > last or any(first < body_at or behind > end for first, behind in spans):
            unplaced += [number for number, _ in own]
            continue
        head, body = text[start:body_at], text[body_at:end]
        # Arms have one type: an iterator or a closure of a type that is not named becomes a boxed one.
        before = behind = ""
        if hidden := re.search(r"->\s*impl (Iterator<Item = .*>|Fn\w*\(.*\)(?: -> [^+]*?)?)( \+ '\w+)?\s*$", head):
            borrowed = " + '_" if "&" in head[: hidden.start()] else ""
            boxed = f"Box<dyn {hidden[1]}{hidden[2] or borrowed}>"
            head = f"{head[: hidden.start()]}-> {boxed} "
            before, behind = f"{{ let boxed: {boxed} = Box::new(", "); boxed }"
        arms = []
        for (number, mutant), (first, after) in zip(own, spans):
            whole = (first, after) == (body_at, end)
            arm = f"{{ {mutant['replacement']} }}" if whole else text[body_at:first] + mutant["replacement"] + text[after:end]
            arms.append(f"/*M{number}*/ {number} => {before}{arm}{behind}\n")
        head = re.sub(r"\bconst fn\b", "fn", head)
        pieces.append((start, end, f"{head}{{ match crate::mutant() {{\n{''.join(arms)}/*M0*/ _ => {before}{body}{behind}\n}} }}"))
        last = start
    for start, end, piece in pieces:
        text = text[:start] + piece + text[end:]
    return text, unplaced


def blamed(tree, error, mutants):
    """The numbers of the changes that an error of the compiler comes from."""
    if called := re.search(r"cannot call non-const (?:fn|function|method|associated function) `([^`]*)`", error["message"]):
        name = re.sub(r"<[^>]*>", "", called[1]).split("::")[-1]
        return {number for number, mutant in mutants if mutant["function"]["function_name"].split("::")[-1] == name}
    for span in error["spans"]:
        if not span["is_primary"] or not (tree.path / span["file_name"]).is_file():
            continue
        lines = (tree.path / span["file_name"]).read_text().split("\n")
        for line in reversed(lines[: span["line_start"]]):
            if arm := re.search(r"/\*M(\d+)\*/", line):
                return {int(arm[1])} - {0}
    return set()


def behind_switch(tree, sample):
    """Compiles all changes together: the test programs, and the numbers of what has to be compiled alone."""
    together, alone = dict(enumerate(sample, 1)), set()
    while True:
        tree.reset()
        library = tree.path / "crates" / tree.crate / "src/lib.rs"
        files = collections.defaultdict(list)
        for number, mutant in together.items():
            if number not in alone:
                files[mutant["file"]].append((number, mutant))
        for file, mutants in files.items():
            text, unplaced = switched((tree.path / file).read_text(), mutants)
            alone |= set(unplaced)
            (tree.path / file).write_text(text)
        library.write_text(library.read_text() + SWITCH_SOURCE)
        programs, errors = tree.programs()
        if programs:
            return programs, sorted(alone)
        switched_on = [(number, mutant) for number, mutant in together.items() if number not in alone]
        found = set().union(*(blamed(tree, error, switched_on) for error in errors)) - alone
        if not found:
            failed("what the compiler refuses comes from no change:\n" + "\n".join(error["rendered"] for error in errors[:3]))
        alone |= found


def first_failure(tests, number, limits):
    """The first test that fails with a change switched on; `None` where all pass."""
    for executable, folder in tests:
        environment = dict(os.environ, **{SWITCH: str(number)}, RUST_BACKTRACE="0", CARGO_MANIFEST_DIR=str(folder))
        process = subprocess.Popen([executable], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=environment, cwd=folder)
        stopped = threading.Event()
        timer = threading.Timer(limits[executable], lambda: (stopped.set(), process.kill()))
        timer.start()
        failure = None
        for line in process.stdout:
            if result := re.match(r"test (.+?)(?: - .*)? \.\.\. FAILED", line):
                failure = result[1]
                process.kill()
                break
        status = process.wait()
        timer.cancel()
        if failure or status:
            return failure or ("no end" if stopped.is_set() else f"status {status}")
    return None


def limits_of(programs):
    """How long each test program may take, seconds; all of them must pass without a change."""
    limits = {}
    for tests in programs.values():
        for executable, folder in tests:
            started = time.monotonic()
            if failure := first_failure([(executable, folder)], 0, {executable: 3600}):
                failed(f"{failure} fails without a change")
            limits[executable] = max(MIN_LIMIT_S, MAX_SLOWDOWN * (time.monotonic() - started))
    return limits


def drawn(mutants, seed):
    """A random sample by MINSTD (Park and Miller, 1988), each seed a million draws behind the one before."""
    key = pow(16807, 1_000_000 * seed, 2147483647)
    keys = []
    for mutant in mutants:
        key = key * 16807 % 2147483647
        keys.append((key, mutant["name"]))
    chosen = {name for _, name in sorted(keys)[:DRAWN]}
    return [mutant for mutant in mutants if mutant["name"] in chosen]


def share(caught, of):
    """A share with the 95 % interval of Wilson (1927)."""
    z, p = 1.96, caught / of
    middle = (p + z * z / (2 * of)) / (1 + z * z / of)
    half = z / (1 + z * z / of) * math.sqrt(p * (1 - p) / of + z * z / (4 * of * of))
    return f"{caught} of {of} mutants that compile are caught: {100 * p:.1f} % ({100 * (middle - half):.1f} to {100 * (middle + half):.1f} %)"


def main():
    words = sys.argv[1:]
    crate = words[0] if words else ""
    seed = int(next((word for word in words[1:] if word.isdigit()), 1))
    if crate not in PROGRAM:
        failed("which crate: kinematics, estimation, calib or diagnose? Usage: .ci/run mutants CRATE [SEED] [own] [again]")
    if not shutil.which("cargo-mutants"):
        failed("no cargo-mutants; cargo install --locked cargo-mutants")
    root = Path(__file__).resolve().parent.parent
    os.environ.setdefault("YAIR_DATA", str(root.parent / "shared/data"))
    target = Path(os.environ.get("CARGO_TARGET_DIR", root / "target")).resolve() / "mutants"
    target.mkdir(parents=True, exist_ok=True)
    program = None if "own" in words else PROGRAM[crate]
    tree = Tree(root, target, crate, program)
    sample = drawn(tree.mutants(), seed)
    results = target / f"{crate}-{seed}.json"
    before = json.loads(results.read_text()) if "again" in words and results.is_file() else {}
    outcome = {name: result for name, result in before.items() if result}

    programs, alone = behind_switch(tree, sample)
    limits = limits_of(programs)

    def ask(number, programs):
        own = first_failure(programs["own"], number, limits)
        return f"own: {own}" if own else first_failure(programs["program"], number, limits)

    def note(number, name, result):
        outcome[name] = result
        print(f"{number}: {name}: {result or 'MISSED'}", flush=True)
        results.write_text(json.dumps(outcome, indent=1))

    left = [(number, mutant) for number, mutant in enumerate(sample, 1) if mutant["name"] not in outcome]
    for number, mutant in left:
        if number not in alone:
            note(number, mutant["name"], ask(number, programs))
    for number, mutant in left:
        if number not in alone:
            continue
        tree.reset()
        file = tree.path / mutant["file"]
        file.write_text(changed(file.read_text(), mutant))
        single, errors = tree.programs()
        if errors:
            note(number, mutant["name"], "does not compile")
            continue
        limits.update({executable: max(limits.values()) for tests in single.values() for executable, _ in tests})
        note(number, mutant["name"], ask(0, single))

    compiled = {name: test for name, test in outcome.items() if test != "does not compile"}
    by_own = sum(1 for test in compiled.values() if test and test.startswith("own: "))
    print(f"its own tests: {share(by_own, len(compiled))}")
    if program:
        print(f"and --test {program}: {share(sum(1 for test in compiled.values() if test), len(compiled))}")
    print("\n".join(name for name, test in compiled.items() if not test))


if __name__ == "__main__":
    main()
