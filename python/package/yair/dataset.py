"""Datasets: from arrays, tables, folders and other people's files."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _yair
from .call import Error, YairWarning, call
from .frames import columns_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    import pandas

    from .result import Result

WHEELS = {
    "ticks": ("left_ticks", "right_ticks"),
    "rad": ("left_rad", "right_rad"),
    "mps": ("left_mps", "right_mps"),
    "twist": ("v_mps", "omega_radps"),
}
"""What two columns of wheels may be, with their names in odometry.csv."""

TRUTH = ("t_s", "x_m", "y_m", "theta_rad", "sigma_xy_m", "sigma_theta_rad")
"""Columns of truth.csv, as `truth=` takes them by order or by name."""

COVARIANCE = ("cov_xx", "cov_xy", "cov_xt", "cov_yy", "cov_yt", "cov_tt")
"""Further columns of truth.csv, which `truth=` takes by name, all six together."""

LARGEST_EXACT = 2.0**53
"""Counts up to here are exact in double precision."""


def _column(name: str, values: ArrayLike) -> NDArray[np.float64]:
    array = np.asarray(values)
    if array.ndim != 1:
        raise Error(f"{name}: it has {array.ndim} dimensions; expected one column")
    try:
        return np.ascontiguousarray(array, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise Error(f"{name}: {error}; expected numbers") from None


def _refuse(row: int, name: str, value: object, expected: str) -> None:
    raise Error(f"{name}: row {row} is {value}; expected {expected}")


def _counts(name: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
    wrong = np.flatnonzero(~(np.isfinite(values) & (values == np.round(values)) & (np.abs(values) <= LARGEST_EXACT)))
    if wrong.size:
        _refuse(
            int(wrong[0]), name, values[wrong[0]], 'a cumulative count; angles and speeds are wheels="rad" and "mps"'
        )
    return values


def _pieces(run: ArrayLike | None, rows: int) -> dict[str, NDArray[np.intp]]:
    """Rows of every run, in the order of their first ones."""
    if run is None:
        return {"000": np.arange(rows)}
    ids = np.asarray(run).astype(str)
    if ids.shape != (rows,):
        raise Error(f"run: it has {ids.size} rows, t has {rows}")
    return {str(name): np.flatnonzero(ids == name) for name in dict.fromkeys(ids.tolist())}


class Dataset:
    """What a robot measured: runs of odometry beside what an outside instrument saw."""

    def __init__(self, columns: _yair.Columns, path: Path | None = None, name: str | None = None) -> None:
        self._columns, self.path, self._name = columns, path, name

    @classmethod
    def from_arrays(
        cls,
        t: ArrayLike,
        left: ArrayLike,
        right: ArrayLike,
        *,
        truth: Mapping[str, ArrayLike] | Sequence[ArrayLike] | pandas.DataFrame,
        wheel_diameter_m: float | tuple[float, float],
        wheel_separation_m: float,
        ticks_per_rev: float | None = None,
        counter_bits: int | None = None,
        wheels: str = "ticks",
        run: ArrayLike | None = None,
        sigma_xy_m: float | None = None,
        sigma_theta_rad: float | None = None,
        name: str = "arrays",
        robot_id: str | None = None,
        recorded: str | None = None,
    ) -> Dataset:
        """A dataset from columns.

        `left` and `right` are cumulative counts (`wheels="ticks"`), cumulative angles ("rad"), speeds of the
        contacts ("mps"), or forward speed and yaw rate ("twist"). `truth` has t, x, y and, where it was
        measured, the heading, each in its order or by the names of truth.csv, covariances of rows (`cov_xx` to
        `cov_tt`) included; NaN = not measured, and of a row without x and y the heading alone was. `run` names
        the run of every row; the truth then has a column `run` too. The sigmas are the instrument's, one
        standard deviation; without them they are estimated. `robot_id` and `recorded` (RFC 3339) are what
        `fleet` groups and orders sessions by.
        """
        if wheels not in WHEELS:
            raise Error(f'wheels: "{wheels}" is none of {", ".join(WHEELS)}')
        both = wheel_diameter_m if isinstance(wheel_diameter_m, tuple) else (wheel_diameter_m, wheel_diameter_m)
        try:
            columns = _yair.Columns(
                left_wheel_diameter_m=both[0],
                right_wheel_diameter_m=both[1],
                wheel_separation_m=wheel_separation_m,
                ticks_per_rev=ticks_per_rev,
                counter_bits=counter_bits,
                name=name,
                robot_id=robot_id,
                recorded=recorded,
                sigma_xy_m=sigma_xy_m,
                sigma_theta_rad=sigma_theta_rad,
            )
        except ValueError as error:
            raise Error(str(error)) from None
        t_s = _column("t", t)
        sides = [_column("left", left), _column("right", right)]
        for side, values in zip(("left", "right"), sides, strict=True):
            if values.size != t_s.size:
                raise Error(f"{side}: it has {values.size} rows, t has {t_s.size}")
            if wheels == "ticks":
                _counts(side, values)
        seen, seen_run = _truth(truth)
        if run is not None and seen_run is None:
            raise Error("truth: runs were given, and so it needs a column run, by name")
        seen_pieces = _pieces(seen_run, seen["t_s"].size) if run is not None else None
        pieces = _pieces(run, t_s.size)
        for unknown in [name for name in seen_pieces or {} if name not in pieces]:
            raise Error(f'truth: it has a run "{unknown}" of which there is no odometry')
        for id, rows in pieces.items():
            columns.add_run(id, wheels, t_s[rows], sides[0][rows], sides[1][rows])
            of = slice(None) if seen_pieces is None else seen_pieces.get(id, np.zeros(0, dtype=np.intp))
            rows_of = {key: values[of] for key, values in seen.items()}
            covariance = [rows_of.pop(key) for key in COVARIANCE if key in rows_of]
            try:
                columns.add_truth(**rows_of, covariance=covariance or None)
            except ValueError as error:
                raise Error(f'run "{id}": {error}') from None
        try:
            columns.check_writable()
        except ValueError as error:
            # The words of the writer, which was not asked for.
            raise Error(str(error).removesuffix("; nothing was written")) from None
        return cls(columns)

    @classmethod
    def from_frames(
        cls,
        odometry: pandas.DataFrame,
        truth: pandas.DataFrame | None = None,
        *,
        displacement: pandas.DataFrame | None = None,
        points: pandas.DataFrame | None = None,
        wheel_reference: pandas.DataFrame | None = None,
        revisit: pandas.DataFrame | None = None,
        distance: pandas.DataFrame | None = None,
        wall: pandas.DataFrame | None = None,
        gyro: pandas.DataFrame | None = None,
        runs: pandas.DataFrame | None = None,
        marks: Mapping[str, tuple[float, float]] | None = None,
        wheel_diameter_m: float | tuple[float, float],
        wheel_separation_m: float,
        ticks_per_rev: float | None = None,
        counter_bits: int | None = None,
        sigma_xy_m: float | None = None,
        sigma_theta_rad: float | None = None,
        name: str = "arrays",
        robot_id: str | None = None,
        recorded: str | None = None,
        manifest: Mapping[str, Mapping[str, Any]] | None = None,
    ) -> Dataset:
        """A dataset from tables, each with the columns of the file of its name; messages count lines as there.

        Without a column `run` all tables are of one run. Columns that the format does not know are left out
        with a warning. `runs` has a row a run: `id`, `protocol`, `payload_kg` and whatever `[[run]]` of
        dataset.toml may have. `marks` are the points of the robot that `points` speaks of, (x, y) in metres.
        `manifest` has further keys of dataset.toml by section: `{"gyro": {"scale_sigma": 0.01}}`. The robot is as
        in `from_arrays`.
        """
        both = wheel_diameter_m if isinstance(wheel_diameter_m, tuple) else (wheel_diameter_m, wheel_diameter_m)
        sections: dict[str, dict[str, Any]] = {
            "robot": {
                "id": robot_id,
                "left_wheel_diameter_m": both[0],
                "right_wheel_diameter_m": both[1],
                "wheel_separation_m": wheel_separation_m,
                "ticks_per_rev": ticks_per_rev,
                "counter_bits": counter_bits,
            },
            "truth": {"sigma_xy_m": sigma_xy_m, "sigma_theta_rad": sigma_theta_rad},
        }
        for section, keys in (manifest or {}).items():
            sections[section] = {**sections.get(section, {}), **keys}
        tables = {
            "truth": truth,
            "displacement": displacement,
            "points": points,
            "wheel_reference": wheel_reference,
            "revisit": revisit,
            "distance": distance,
            "wall": wall,
            "gyro": gyro,
        }
        return cls(columns_of(odometry, tables, sections, runs, marks or {}, {"name": name, "recorded": recorded}))

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Dataset:
        """Reads the folder of a dataset."""
        try:
            columns = _yair.Columns.read(path)
        except ValueError as error:
            raise Error(str(error)) from None
        for warning in columns.warnings:
            warnings.warn(warning, YairWarning, stacklevel=2)
        return cls(columns, Path(path))

    @classmethod
    def import_csv(
        cls, *files: str | os.PathLike[str], out: str | os.PathLike[str], force: bool = False, **options: Any
    ) -> Dataset:
        """Any tables of wheels and poses, as `yair import csv`: options are its flags, with _ for -.

        `Dataset.import_csv("log.csv", out="mine", wheel=0.15, base=0.3, ticks_per_rev=4096)`
        """
        flags = [f"--{name.replace('_', '-')}={_text(value)}" for name, value in options.items() if value is not None]
        call(["import", "csv", *files, "--out", out, *flags, *(["--force"] if force else [])])
        return cls.read(out)

    def write(self, path: str | os.PathLike[str], *, force: bool = False) -> Path:
        """Writes the folder of the dataset; `force` replaces a dataset that stands there."""
        try:
            self._columns.write(path, force)
        except ValueError as error:
            raise Error(str(error)) from None
        self.path = Path(path)
        return self.path

    @property
    def name(self) -> str:
        """Its name for people."""
        return self._columns.name or self._name or (self.path.resolve().name if self.path else "dataset")

    @property
    def robot(self) -> dict[str, float | int | None]:
        """The nominal robot, with the keys of dataset.toml."""
        return self._columns.robot

    @property
    def runs(self) -> list[str]:
        """Ids of the runs."""
        return self._columns.runs

    def odometry(self, run: str | int = 0) -> dict[str, NDArray[Any]]:
        """Columns of a run's odometry, by the names of odometry.csv."""
        return dict(self._columns.odometry(self._index(run)))

    def truth(self, run: str | int = 0) -> dict[str, NDArray[np.float64]]:
        """Columns of a run's truth, by the names of truth.csv; NaN = not measured."""
        return self._columns.truth(self._index(run))

    def to_pandas(self) -> pandas.DataFrame:
        """The odometry of all runs as one table, with the columns of odometry.csv."""
        import pandas

        tables = [pandas.DataFrame({"run": run, **self.odometry(run)}) for run in self.runs]
        return pandas.concat(tables, ignore_index=True)

    def __repr__(self) -> str:
        rows = sum(self.odometry(run)["t_s"].size for run in self.runs)
        return f"Dataset({self.name!r}: {len(self.runs)} runs, {rows} odometry rows)"

    def _index(self, run: str | int) -> int:
        if isinstance(run, int):
            return range(len(self.runs))[run]
        try:
            return self.runs.index(run)
        except ValueError:
            raise KeyError(f"run {run!r}: there are {', '.join(self.runs)}") from None

    def check(self, **options: Any) -> Result:
        """As `yair.check`."""
        from . import api

        return api.check(self, **options)

    def calibrate(self, **options: Any) -> Result:
        """As `yair.calibrate`."""
        from . import api

        return api.calibrate(self, **options)

    def evaluate(self, **options: Any) -> Result:
        """As `yair.evaluate`."""
        from . import api

        return api.evaluate(self, **options)

    def diagnose(self, **options: Any) -> Result:
        """As `yair.diagnose`."""
        from . import api

        return api.diagnose(self, **options)

    def plan(self, **options: Any) -> Result:
        """As `yair.plan`."""
        from . import api

        return api.plan(self, **options)

    def correct(self, calibration: str | os.PathLike[str] | Result, **options: Any) -> Result:
        """As `yair.correct`."""
        from . import api

        return api.correct(self, calibration=calibration, **options)


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        return ",".join(f"{key}={column}" for key, column in value.items())
    return ",".join(map(str, value)) if isinstance(value, tuple | list) else str(value)


def _truth(truth: Any) -> tuple[dict[str, NDArray[np.float64]], ArrayLike | None]:
    """Columns of the truth by the names of truth.csv, and the run of every row."""
    if isinstance(truth, Sequence | np.ndarray):
        if not 3 <= len(truth) <= len(TRUTH):
            raise Error(f"truth: it has {len(truth)} columns; expected {', '.join(TRUTH[:4])} in this order")
        named, run = dict(zip(TRUTH, truth, strict=False)), None
    else:
        keys = [str(key) for key in truth]
        known = (*TRUTH, *COVARIANCE)
        unknown = [key for key in keys if key not in (*known, "run")]
        missing = [key for key in TRUTH[:3] if key not in keys]
        if unknown or missing:
            what = f"unknown columns {', '.join(unknown)}" if unknown else f"no column {', '.join(missing)}"
            raise Error(f"truth: {what}; expected {', '.join((*known, 'run'))}, of which the first three are needed")
        without = [key for key in COVARIANCE if key not in keys]
        if 0 < len(without) < len(COVARIANCE):
            raise Error(f"truth: no column {', '.join(without)}; the six columns of a covariance come together")
        named = {key: truth[key] for key in known if key in keys}
        run = truth["run"] if "run" in keys else None
    columns = {key: _column(f"truth {key}", values) for key, values in named.items()}
    for key, values in columns.items():
        if values.size != columns["t_s"].size:
            raise Error(f"truth {key}: it has {values.size} rows, t_s has {columns['t_s'].size}")
    return columns, run


@contextmanager
def folders(datasets: Sequence[Dataset | str | os.PathLike[str]]) -> Iterator[list[Path]]:
    """Folders that hold these datasets; those in memory are written, to the last bit, into a temporary one."""
    if not datasets:
        raise TypeError("no dataset was given")
    with tempfile.TemporaryDirectory(prefix="yair-") as temporary:
        paths: list[Path] = []
        written: dict[int, Path] = {}
        for number, dataset in enumerate(datasets):
            if not isinstance(dataset, Dataset):
                paths.append(Path(dataset))
            elif dataset.path is not None:
                paths.append(dataset.path)
            elif id(dataset) in written:
                # The command refuses a session that is given twice.
                paths.append(written[id(dataset)])
            else:
                # Folders of their own, for sessions may share a name.
                folder = Path(temporary, str(number), "".join(c if c.isalnum() else "-" for c in dataset.name))
                dataset._columns.write(folder, False)
                written[id(dataset)] = folder
                paths.append(folder)
        yield paths
