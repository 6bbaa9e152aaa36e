"""Campaigns, blind benchmarks and fleets on a Ray cluster: the same core on every worker, the same bytes.

Work is cut into tasks that are functions of what they are given: a shard of a sweep, a part of the blind
benchmark, one dataset of a fleet. Inputs and results travel through Ray's object store, so that no folder is
shared; every worker has this package in the same version. A task that lost its worker is computed again and
gives the same bytes. Ray is imported by the first call: `pip install yair[cluster]`.
"""

from __future__ import annotations

import os
import socket
import tempfile
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from . import _yair, api
from .call import Error, Progress, YairWarning
from .result import Result

PathLike = str | os.PathLike[str]
Task = tuple[str, tuple[Any, ...]]

RETRIES = 3
"""Times that a task which lost its worker is computed again: as many as Ray itself takes by default."""

PATIENCE_S = 3600.0
"""Longest time in which no task ends, seconds: shards that one computes for longer are cut too coarsely."""

CONNECT_S = 10.0
"""Longest time until somebody at a cluster's address answers, seconds: that of a slow network, by far."""

LOOK_S = 0.5
"""Time between two looks at what has ended, seconds; Ctrl-C is heard then."""

TASKS_A_SLOT = 2
"""Tasks at Ray for each that can run: one runs and one waits, so that inputs do not fill the object store."""


class Answer(NamedTuple):
    """What a task gives back: files by name, what it warned of, or why it failed."""

    version: str
    files: dict[str, bytes]
    warned: list[str]
    failure: tuple[str, int] | None


def sweep(
    scenario: PathLike,
    shards: int,
    out: PathLike,
    address: str | None = None,
    *,
    trials: int | None = None,
    precision: float | None = None,
    seed: int | None = None,
    cpus: int = 1,
    retries: int = RETRIES,
    patience_s: float = PATIENCE_S,
    progress: Progress | None = None,
) -> Result:
    """`yair.sweep` in so many shards on a cluster, merged into `out`: the bytes of one machine.

    `address` is that of a running cluster; None is what `ray.init` takes it for: the cluster of RAY_ADDRESS or
    of this machine, else one of this machine that lasts for the call. Each shard takes `cpus` threads. `progress`
    counts shards.
    """
    text = Path(scenario).read_bytes()
    _at_least_one("shards", shards)
    options = {"trials": trials, "precision": precision, "seed": seed, "jobs": cpus}
    numbers = range(1, shards + 1)
    tasks = [(f"shard {k}/{shards}", (text, Path(scenario).name, f"{k}/{shards}", options)) for k in numbers]
    with tempfile.TemporaryDirectory(prefix="yair-") as kept:
        parts = _Folders(Path(kept))
        with _cluster(address, cpus, retries, patience_s) as farm:
            farm.run(_sweep_shard, tasks, parts.add, _counting("shards", shards, progress))
        return api.merge(*parts.all, out=out)


def challenge(
    cases: int,
    shards: int,
    address: str | None = None,
    *,
    seed: int = 1,
    large: bool = False,
    cpus: int = 1,
    retries: int = RETRIES,
    patience_s: float = PATIENCE_S,
    progress: Progress | None = None,
) -> Result:
    """`yair.challenge`, the blind benchmark, in so many parts on a cluster: the bytes of one machine.

    `address`, `cpus` and `progress` are as of `sweep`.
    """
    _at_least_one("shards", shards)
    options = {"cases": cases, "seed": seed, "large": large, "jobs": cpus}
    tasks = [(f"part {k}/{shards}", (f"{k}/{shards}", options)) for k in range(1, shards + 1)]
    with tempfile.TemporaryDirectory(prefix="yair-") as kept:
        parts = _Folders(Path(kept))
        with _cluster(address, cpus, retries, patience_s) as farm:
            farm.run(_challenge_part, tasks, parts.add, _counting("parts", shards, progress))
        return api.merge_challenge(*parts.all)


def fleet(
    datasets: PathLike | Sequence[PathLike],
    what: str = "diagnose",
    out: PathLike | None = None,
    address: str | None = None,
    *,
    fdr: float | None = None,
    csv: PathLike | None = None,
    shared: bool = False,
    cpus: int = 1,
    retries: int = RETRIES,
    patience_s: float = PATIENCE_S,
    progress: Progress | None = None,
) -> Result:
    """`yair.fleet` with every dataset on some worker; then one call here over what they found.

    `datasets` are folders as `yair.fleet` takes them; `what` is "diagnose" or "calibrate". Datasets of which
    `out` keeps a result are not sent. With `shared` workers read the folders themselves, by absolute paths;
    else the files travel. `address`, `cpus` and `progress` (which counts datasets) are as of `sweep`. A dataset
    that fails at its worker is tried once more here, and stands in `failed` with its reason.
    """
    if what not in ("diagnose", "calibrate"):
        raise Error(f'what: "{what}" is none of diagnose, calibrate')
    dirs = [datasets] if isinstance(datasets, str | os.PathLike) else list(datasets)
    calibrate_only = what == "calibrate"
    with tempfile.TemporaryDirectory(prefix="yair-") as temporary:
        kept = Path(temporary, "kept") if out is None else Path(out)
        try:
            todo = _yair.datasets_to_compute(dirs, kept, calibrate_only)
        except ValueError as error:
            raise Error(str(error)) from None
        if todo:
            # Read when their turn comes: all files of a fleet at once would fill the memory.
            given = ((path, path.resolve() if shared else _files(path)) for path in todo)
            tasks = ((str(path), (path.name, files, calibrate_only, cpus)) for path, files in given)
            with _cluster(address, cpus, retries, patience_s) as farm:
                keep = _Sessions(kept / "sessions").add
                farm.run(_fleet_session, tasks, keep, _counting("datasets", len(todo), progress))
        # The page stands beside what is kept, or in a temporary folder that goes with the result.
        return api._fleet(dirs, kept, out, None, calibrate_only=calibrate_only, fdr=fdr, csv=csv)


def _sweep_shard(text: bytes, name: str, shard: str, options: dict[str, Any]) -> dict[str, bytes]:
    with tempfile.TemporaryDirectory(prefix="yair-") as folder:
        scenario, out = Path(folder, name), Path(folder, "shard")
        scenario.write_bytes(text)
        api.sweep(scenario, shard=shard, out=out, **options)
        return _contents(out)


def _challenge_part(shard: str, options: dict[str, Any]) -> dict[str, bytes]:
    with tempfile.TemporaryDirectory(prefix="yair-") as folder:
        api.challenge(shard=shard, out=folder, **options)
        return _contents(Path(folder))


def _fleet_session(name: str, given: Path | dict[str, bytes], calibrate_only: bool, cpus: int) -> dict[str, bytes]:
    with tempfile.TemporaryDirectory(prefix="yair-") as folder:
        dataset, kept = Path(folder, "in", name), Path(folder, "kept")
        if isinstance(given, dict):
            dataset.mkdir(parents=True)
            for file, content in given.items():
                (dataset / file).write_bytes(content)
        else:
            dataset = given
        with warnings.catch_warnings():
            # The last call says the same of the folders as they are called there.
            warnings.simplefilter("ignore", YairWarning)
            api.fleet(dataset, out=kept, calibrate_only=calibrate_only, jobs=cpus)
        return _contents(kept / "sessions")


def _contents(folder: Path) -> dict[str, bytes]:
    """The JSON files of a folder, which are all that a later call reads of it."""
    return {path.name: path.read_bytes() for path in sorted(folder.glob("*.json"))}


def _files(dataset: Path) -> dict[str, bytes]:
    """The files of a dataset by name: what is hashed of it, and no more."""
    files = sorted(path for path in dataset.iterdir() if path.suffix in (".toml", ".csv") and path.is_file())
    return {path.name: path.read_bytes() for path in files}


class _Folders:
    """Answers as folders, in which a merge finds them."""

    def __init__(self, into: Path) -> None:
        self.all: list[Path] = []
        self._into = into

    def add(self, files: dict[str, bytes]) -> None:
        folder = self._into / str(len(self.all))
        folder.mkdir()
        for name, content in files.items():
            (folder / name).write_bytes(content)
        self.all.append(folder)


class _Sessions:
    """Answers as the results that a fleet keeps, each written in one piece."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def add(self, files: dict[str, bytes]) -> None:
        self._folder.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            part = self._folder / f"{name}.part"
            part.write_bytes(content)
            part.replace(self._folder / name)


def _at_least_one(name: str, value: int) -> None:
    if value < 1:
        raise Error(f"{name} = {value}; expected 1 or more")


def _counting(what: str, total: int, progress: Progress | None) -> Callable[[int], None]:
    def count(done: int) -> None:
        if progress:
            progress(what, done, total)

    return count


def _answer(work: Callable[..., dict[str, bytes]], arguments: tuple[Any, ...]) -> Answer:
    """On a worker: the work, with its warnings and its failure as data, which travel whatever Ray wraps."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", YairWarning)
        try:
            files, failure = work(*arguments), None
        except Error as error:
            files, failure = {}, (str(error), error.exit_code)
    warned = [str(warning.message) for warning in caught if issubclass(warning.category, YairWarning)]
    return Answer(_yair.__version__, files, warned, failure)


def _ray() -> Any:
    # Asked for before Ray is imported, which reads it then: nothing is reported to anybody.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    # The processors of a task are counted by `cpus`; Ray says at length what it will do of GPUs one day.
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    try:
        import ray
    except ImportError:
        raise Error("Ray is not installed here; pip install yair[cluster]") from None
    return ray


@contextmanager
def _cluster(address: str | None, cpus: int, retries: int, patience_s: float) -> Iterator[_Farm]:
    """A cluster for one call. One that the call began ends with it; a connection that was there stays."""
    _at_least_one("cpus", cpus)
    ray = _ray()
    began = not ray.is_initialized()
    if began:
        _refuse_unreachable(address)
        try:
            ray.init(address=address, log_to_driver=False, logging_level="ERROR")
        except (ConnectionError, RuntimeError, ValueError, ray.exceptions.RayError) as error:
            raise Error(f"no Ray cluster answers at {address or 'this machine'}: {_line(error)}") from None
    elif address not in (None, "auto", ray.get_runtime_context().gcs_address):
        here = ray.get_runtime_context().gcs_address
        raise Error(f"this process is connected to the cluster {here}; call ray.shutdown() before {address} is used")
    try:
        yield _Farm(ray, cpus, retries, patience_s)
    finally:
        if began:
            ray.shutdown()


class _Farm:
    """Tasks on a cluster."""

    def __init__(self, ray: Any, cpus: int, retries: int, patience_s: float) -> None:
        self._ray, self._cpus, self._retries, self._patience_s = ray, cpus, retries, patience_s

    def run(
        self,
        work: Callable[..., dict[str, bytes]],
        tasks: Iterable[Task],
        keep: Callable[[dict[str, bytes]], None],
        count: Callable[[int], None],
    ) -> None:
        """Has every task's files kept, in whatever order they end."""
        ray = self._ray
        # Lost work is begun anew below, where it is counted and told.
        remote = ray.remote(num_cpus=self._cpus, max_retries=0)(_answer)
        lost = (
            ray.exceptions.WorkerCrashedError,
            ray.exceptions.NodeDiedError,
            ray.exceptions.LocalRayletDiedError,
            ray.exceptions.ObjectLostError,
            ray.exceptions.OutOfMemoryError,
        )
        waiting, done, tries = iter(tasks), 0, dict[str, int]()
        running: dict[Any, Task] = {}
        last = time.monotonic()
        try:
            while True:
                slots = self._slots()
                while len(running) < slots:
                    following = next(waiting, None)
                    if following is None:
                        break
                    running[remote.remote(work, following[1])] = following
                if not running:
                    return
                ended, _ = ray.wait(list(running), num_returns=1, timeout=LOOK_S)
                if not ended and time.monotonic() - last > self._patience_s:
                    raise Error(self._why_no_end(running, done))
                for reference in ended:
                    name, arguments = running.pop(reference)
                    try:
                        answer = ray.get(reference, timeout=self._patience_s)
                    except lost as error:
                        tries[name] = tries.get(name, 0) + 1
                        if tries[name] > self._retries:
                            raise Error(f"{name}: its worker was lost {tries[name]} times: {_line(error)}") from None
                        warnings.warn(
                            f"{name}: its worker was lost ({type(error).__name__}); it is computed again "
                            f"({tries[name]} of at most {self._retries})",
                            YairWarning,
                            stacklevel=3,
                        )
                        running[remote.remote(work, arguments)] = (name, arguments)
                        continue
                    except ray.exceptions.RayError as error:
                        raise Error(f"{name}: {_line(error)}") from None
                    self._judge(name, answer)
                    keep(answer.files)
                    done, last = done + 1, time.monotonic()
                    count(done)
        finally:
            for reference in running:
                ray.cancel(reference, force=True)

    def _slots(self) -> int:
        """Tasks that Ray is given at a time."""
        processors = self._ray.cluster_resources().get("CPU", 0.0)
        return max(1, int(processors // self._cpus)) * TASKS_A_SLOT

    def _judge(self, name: str, answer: Answer) -> None:
        if answer.version != _yair.__version__:
            raise Error(
                f"{name}: its worker has yair {answer.version}, this is {_yair.__version__}; install one version on all nodes"
            )
        for warned in answer.warned:
            warnings.warn(f"{name}: {warned}", YairWarning, stacklevel=4)
        if answer.failure:
            raise Error(f"{name}: {answer.failure[0]}", answer.failure[1])

    def _why_no_end(self, running: dict[Any, Task], done: int) -> str:
        alive = [node["Resources"].get("CPU", 0.0) for node in self._ray.nodes() if node["Alive"]]
        processors = max(alive, default=0.0)
        first = next(iter(running.values()))[0]
        why = (
            f"no task ended in {self._patience_s:g} s; {done} are done, {len(running)} wait or run, {first} among them"
        )
        if processors < self._cpus:
            return (
                f"{why}: each takes {self._cpus} processors, and the largest node has {processors:g}; give fewer cpus"
            )
        return f"{why}; cut the work into more shards, or give a larger patience_s"


def _refuse_unreachable(address: str | None) -> None:
    """Asks whether anybody listens there, since Ray itself would try for minutes."""
    given = address or os.environ.get("RAY_ADDRESS", "")
    host, _, port = given.rpartition(":")
    if "/" in host or not host or not port.isdigit():
        return
    try:
        socket.create_connection((host.strip("[]"), int(port)), CONNECT_S).close()
    except (OSError, OverflowError) as error:
        raise Error(f"no Ray cluster answers at {given}: {error}; ray start --head prints the address") from None


def _line(error: BaseException) -> str:
    """The first line of what Ray says at length."""
    return next((line.strip() for line in str(error).splitlines() if line.strip()), type(error).__name__)
