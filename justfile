# The checks of .ci/run one by one: same names, same commands. `documents` and `challenge` are no checks.

# Everything, as CI runs it
ci:
    .ci/run

# Is the code formatted?
fmt:
    cargo fmt --all --check

# Lints, as errors
lint:
    cargo clippy --workspace --all-targets -- -D warnings

# All tests, examples in the documentation included
test:
    cargo test --workspace

# The paper's experiments, Monte Carlo
sweep:
    cargo run --release -- sweep scenarios/paper.toml

# Is every calibration method as accurate as it was?
accuracy:
    cargo run --release -- sweep scenarios/ci.toml --check baselines/accuracy.json

# The library's documentation, warnings as errors
doc:
    env RUSTDOCFLAGS=-Dwarnings cargo doc --workspace --no-deps

# Do the benches compile?
bench:
    cargo bench --workspace --no-run

# Run the commands of the documents and paste what they print, docs/methods.md's tables of all methods included; generate docs/effects.md
documents:
    env YAIR_UPDATE_DOCS=1 cargo test --test architecture the_documents_show_what_the_commands_print
    env YAIR_UPDATE_DOCS=1 cargo test -p effects --test document

# The blind benchmark of diagnosis against its bars; docs/diagnose.md has its table. It takes a quarter of an hour
challenge:
    cargo run --release -- challenge --cases 2000 --seed 1
