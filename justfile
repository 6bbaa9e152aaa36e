# The steps of .ci/run by name; their commands stand there.

# Every check
ci:
    .ci/run

# Is the code formatted?
fmt:
    .ci/run fmt

# Lints, as errors; benches included
lint:
    .ci/run lint

# All tests, examples in the documentation included
test:
    .ci/run test

# The whole job on a simulated robot
demo:
    .ci/run demo

# The paper's experiments, Monte Carlo
sweep:
    .ci/run sweep

# Is every calibration method as accurate as it was?
accuracy:
    .ci/run accuracy

# Is dead reckoning as fast as it was, beside a plain loop, and trials side by side beside one by one?
speed:
    .ci/run speed

# Does diagnosis raise no more false findings, find as much and name it as rightly as it did?
diagnosis:
    .ci/run diagnosis

# The Python package: its wheel, and its tests against the command; needs Python with venv
python:
    .ci/run python

# The library's documentation, warnings as errors
doc:
    .ci/run doc

# Run the commands of the documents and paste what they print, docs/methods.md's tables of all methods included; generate docs/effects.md
documents:
    .ci/run documents

# The blind benchmark of diagnosis against its bars; docs/diagnosis-benchmark.md has its table. It takes a quarter of an hour
challenge:
    .ci/run challenge

# Sixty logs against what the last accepted build says of them
compared:
    .ci/run compared

# The same logs through two builds, in paired tables: just replay OLD NEW, two revisions or executables; docs/replay.md
replay OLD NEW *WORDS:
    .ci/run replay {{OLD}} {{NEW}} {{WORDS}}

# Store what this build says of the sixty logs of `compared`
replay-baseline:
    .ci/run replay-baseline

# A robot of rigid bodies: drive 300 logs in MuJoCo, diagnose them and score what is said; docs/physics-judge.md
physics:
    .ci/run physics

# What draws its seed from the clock: 140 cases of the blind benchmark that nobody has seen. It prints the seed
fresh-seeds:
    .ci/run fresh-seeds

# Package every crate, unpack it and build it from what is in it
package:
    .ci/run package

# Test the optional features: Parquet files, PNG pictures, bags in SQLite; needs a C compiler
features:
    .ci/run features

# Make the bags of tests/ros2 and evo's numbers of tests/evo anew, and read an exported bag, by the programs of others; needs Python and PyPI
interop:
    .ci/run interop

# Look at the pages of every command in Chromium, with keys, on a telephone's screen, in the dark and in print; needs node
browser:
    .ci/run browser

# Take the documents' screenshots of the pages anew; needs node and Chromium
pictures:
    .ci/run pictures

# Mutated input for every reader, 20 minutes of processor time each; docs/reliability.md has its table
fuzz:
    .ci/run fuzz

# kill -9 and SIGTERM at two hundred and sixty random instants of nine commands; docs/reliability.md has its table
kills:
    .ci/run kills

# Does a test fail when an expression is changed? 100 random mutants of a crate: .ci/run mutants CRATE [SEED]; needs cargo-mutants
mutants:
    .ci/run mutants

# Licences, sources and duplicate versions of the dependencies, and those that nobody uses; needs cargo-deny and cargo-machete
dependencies:
    .ci/run dependencies
