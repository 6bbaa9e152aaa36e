"""What the subcommands do, as functions."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from . import rows
from .call import Progress, call
from .dataset import Dataset, folders
from .result import Result, Rows, calibration_file

PathLike = str | os.PathLike[str]
Sessions = Dataset | PathLike
Flag = str | os.PathLike[str]


def _options(**values: Any) -> list[Flag]:
    """Flags by name; True stands for a flag alone, a list for a flag several times."""
    flags: list[Flag] = []
    for name, value in values.items():
        flag = f"--{name.replace('_', '-')}"
        if value is True:
            flags.append(flag)
        elif isinstance(value, list):
            flags += [f"{flag}={item}" for item in value]
        elif value is not None and value is not False:
            flags.append(f"{flag}={value}")
    return flags


def _folder(out: PathLike | None) -> tuple[Path, bool]:
    """Where files go: a temporary folder, which goes with the result, where no other is given."""
    if out is not None:
        return Path(out), False
    return Path(tempfile.mkdtemp(prefix="yair-")), True


@contextmanager
def _removed_on_failure(folder: Path, temporary: bool) -> Iterator[None]:
    try:
        yield
    except BaseException:
        if temporary:
            shutil.rmtree(folder, ignore_errors=True)
        raise


def check(*datasets: Sessions) -> Result:
    """What is wrong with a log before anything is fitted: `ok`, `problems`, `determined`."""
    with folders(datasets) as paths:
        # 1: a problem is an error, which the document tells.
        text, remarks = call(["check", *paths], accepted=(0, 1))
    return _result(text, remarks, rows.problem_rows)


def calibrate(
    *datasets: Sessions,
    method: str = "joint",
    profile: bool = False,
    force: bool = False,
    out: PathLike | None = None,
    progress: Progress | None = None,
) -> Result:
    """The robot's parameters, each ± one standard deviation, from its sessions together.

    `out` is a folder for calibration.toml and report.html.
    """
    folder, temporary = _folder(out)
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "calibration.toml"
    flags = _options(method=method, profile=profile, force=force, out=file, out_dir=folder)
    with _removed_on_failure(folder, temporary), folders(datasets) as paths:
        text, remarks = call(["calibrate", *paths, *flags], progress)
    return _result(text, remarks, rows.parameter_rows, folder, file, temporary)


def evaluate(
    *datasets: Sessions,
    calibration: PathLike | Result | Sequence[PathLike | Result] = (),
    max_drift: float | None = None,
    align: str = "none",
    delta: float | None = None,
    delta_unit: str | None = None,
    all_pairs: bool = False,
    delta_tol: float | None = None,
    out: PathLike | None = None,
    progress: Progress | None = None,
) -> Result:
    """Drift and pose errors of dead reckoning under the nominal values, and under each calibration.

    A calibration is a file, or what `calibrate` or `diagnose` returned. More drift than `max_drift`, in per
    cent, raises `Error`, whose document has the numbers. `out` is a folder for report.html.
    """
    given = [calibration] if isinstance(calibration, Result | str | os.PathLike) else list(calibration)
    folder, temporary = _folder(out)
    flags = _options(
        calibration=[calibration_file(one) for one in given],
        max_drift=max_drift,
        align=align,
        delta=delta,
        delta_unit=delta_unit,
        all_pairs=all_pairs,
        delta_tol=delta_tol,
        out_dir=folder,
    )
    with _removed_on_failure(folder, temporary), folders(datasets) as paths:
        text, remarks = call(["evaluate", *paths, *flags], progress)
    return _result(text, remarks, rows.drift_rows, folder, None, temporary)


def diagnose(
    *datasets: Sessions,
    without: Sequence[str] = (),
    out: PathLike | None = None,
    force: bool = False,
    progress: Progress | None = None,
) -> Result:
    """What the calibrated model gets wrong: causes by name and size, the extended model, the gain.

    `out` is a folder for report.html, findings.json and extended.toml.
    """
    folder, temporary = _folder(out)
    flags = _options(without=list(without), out=folder, force=force)
    with _removed_on_failure(folder, temporary), folders(datasets) as paths:
        text, remarks = call(["diagnose", *paths, *flags], progress)
    extended = folder / "extended.toml"
    return _result(text, remarks, rows.finding_rows, folder, extended if extended.is_file() else None, temporary)


def plan(
    *sources: Sessions,
    room: tuple[float, float] | None = None,
    minutes: float | None = None,
    speed: float | None = None,
    without: Sequence[str] = (),
    out: PathLike | None = None,
    force: bool = False,
    progress: Progress | None = None,
) -> Result:
    """The next experiment, from sessions or from a scenario file. `out` is a folder for it as scenarios."""
    sides = None if room is None else f"{room[0]},{room[1]}"
    flags = _options(room=sides, minutes=minutes, speed=speed, without=list(without), out=out, force=force)
    with folders(sources) as paths:
        text, remarks = call(["plan", *paths, *flags], progress)
    return _result(text, remarks, rows.plan_rows, None if out is None else Path(out))


def correct(
    *datasets: Sessions,
    calibration: PathLike | Result,
    out: PathLike | None = None,
    force: bool = False,
    progress: Progress | None = None,
) -> Result:
    """Corrected poses at every row; `to_pandas()` has them. `out` is a folder for RUN.csv and RUN.tum."""
    folder, temporary = _folder(out)
    flags = _options(calibration=calibration_file(calibration), out=folder, force=force)
    with _removed_on_failure(folder, temporary), folders(datasets) as paths:
        text, remarks = call(["correct", *paths, *flags], progress)
    return _result(text, remarks, rows.pose_tables, folder, None, temporary)


def fleet(
    *dirs: PathLike,
    out: PathLike | None = None,
    jobs: int = 0,
    calibrate_only: bool = False,
    fdr: float | None = None,
    csv: PathLike | None = None,
    progress: Progress | None = None,
) -> Result:
    """Many robots and sessions: drift, parameters, findings, what changed, and whom to service first.

    Folders are searched two levels deep for datasets. `out` keeps what was found for the next call. Datasets
    that fail are in `failed`, and stop no other.
    """
    return _fleet(dirs, out, out, progress, jobs=jobs, calibrate_only=calibrate_only, fdr=fdr, csv=csv)


def _fleet(
    dirs: Sequence[PathLike], kept: PathLike | None, out: PathLike | None, progress: Progress | None, **options: Any
) -> Result:
    """`fleet` whose page goes elsewhere than to what is `kept`."""
    folder, temporary = _folder(out)
    folder.mkdir(parents=True, exist_ok=True)
    flags = _options(out=kept, html=folder / "report.html", **options)
    with _removed_on_failure(folder, temporary):
        # 1: a dataset failed, which the document tells.
        text, remarks = call(["fleet", *dirs, *flags], progress, accepted=(0, 1))
    return _result(text, remarks, rows.robot_rows, folder, None, temporary)


def simulate(
    scenario: PathLike,
    *,
    out: PathLike | None = None,
    seed: int | None = None,
    trial: int = 0,
    point: int | None = None,
    method: str | None = None,
    robot_id: str | None = None,
    recorded: str | None = None,
    force: bool = False,
) -> Dataset:
    """Drives a scenario once. With `out` the dataset is written there, and its hidden truth beside it.

    `robot_id` and `recorded` (RFC 3339) are what `fleet` groups and orders sessions by.
    """
    with tempfile.TemporaryDirectory(prefix="yair-") as temporary:
        target = Path(temporary, Path(scenario).stem) if out is None else Path(out)
        flags = _options(
            out=target,
            seed=seed,
            trial=trial,
            point=point,
            method=method,
            robot_id=robot_id,
            recorded=recorded,
            force=force,
        )
        call(["simulate", scenario, *flags])
        dataset = Dataset.read(target)
    return dataset if out is not None else Dataset(dataset._columns, name=target.name)


def sweep(
    scenario: PathLike,
    *,
    trials: int | None = None,
    precision: float | None = None,
    jobs: int = 0,
    seed: int | None = None,
    shard: str | None = None,
    resume: bool = False,
    out: PathLike | None = None,
    progress: Progress | None = None,
) -> Result | None:
    """Monte-Carlo: bias, spread, coverage and efficiency of every method over a scenario's design.

    Ctrl-C stops it; with `out`, `resume=True` goes on. A shard ("2/4", or "auto" on a cluster) leaves its part
    in `out` for `merge` and returns None.
    """
    flags = _options(trials=trials, precision=precision, jobs=jobs, seed=seed, shard=shard, resume=resume, out=out)
    text, remarks = call(["sweep", scenario, *flags], progress)
    if text is None:
        return None
    return _result(text, remarks, rows.estimator_rows, None if out is None else Path(out))


def merge(*shards: PathLike, out: PathLike) -> Result:
    """The shards of a sweep as one result, that of one machine to the bit."""
    text, remarks = call(["merge", *shards, *_options(out=out)])
    return _result(text, remarks, rows.estimator_rows, Path(out))


def challenge(
    *,
    cases: int | None = None,
    seed: int = 1,
    large: bool = False,
    shard: str | None = None,
    out: PathLike | None = None,
    jobs: int = 0,
    progress: Progress | None = None,
) -> Result | None:
    """The blind benchmark of `diagnose`: random robots with hidden effects, scored against an oracle.

    A shard ("2/4", or "auto" on a cluster) leaves its part in `out` for `merge_challenge` and returns None.
    """
    flags = _options(cases=cases, seed=seed, large=large, shard=shard, out=out, jobs=jobs)
    text, remarks = call(["challenge", *flags], progress)
    return None if text is None else _result(text, remarks, rows.measure_rows)


def merge_challenge(*parts: PathLike) -> Result:
    """The parts of a blind benchmark as one result, that of one machine to the bit."""
    text, remarks = call(["challenge", "--merge", *parts])
    return _result(text, remarks, rows.measure_rows)


def _result(
    text: str | None,
    remarks: list[str],
    of: Rows,
    folder: Path | None = None,
    file: Path | None = None,
    temporary: bool = False,
) -> Result:
    if text is None:
        raise AssertionError("a command that succeeds prints its document")
    return Result(text, remarks, of, folder, file, temporary)
