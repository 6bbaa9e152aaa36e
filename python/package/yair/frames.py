"""Datasets from tables of pandas: written as the format's files and read by the format's reader, so that a
table here means what the file of its name means, to the last bit."""

from __future__ import annotations

import json
import math
import tempfile
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _yair
from .call import Error, YairWarning

if TYPE_CHECKING:
    import pandas

ONE_RUN = "000"
"""The run of tables that name none."""


def columns_of(
    odometry: pandas.DataFrame,
    tables: Mapping[str, pandas.DataFrame | None],
    manifest: dict[str, dict[str, Any]],
    runs: pandas.DataFrame | None,
    marks: Mapping[str, tuple[float, float]],
    general: Mapping[str, Any],
) -> _yair.Columns:
    """The dataset of these tables; `manifest` has sections of dataset.toml, `general` the keys above them."""
    given = {"odometry": odometry, **{name: table for name, table in tables.items() if table is not None}}
    names_runs = "run" in odometry
    ids = list(dict.fromkeys(odometry["run"].astype(str))) if names_runs else [ONE_RUN]
    with tempfile.TemporaryDirectory(prefix="yair-") as temporary:
        folder = Path(temporary, "dataset")
        folder.mkdir()
        for name, table in given.items():
            if names_runs and "run" not in table:
                raise Error(f"{name}: runs were given, and so it needs a column run")
            if not names_runs and "run" in table:
                raise Error(f"{name}: it has a column run, and odometry has none")
            _write(folder / f"{name}.csv", table, names_runs)
        text = _manifest({"format": 1, **general}, manifest, _runs(ids, runs), marks)
        (folder / "dataset.toml").write_text(text, encoding="utf-8")
        try:
            columns = _yair.Columns.read(folder)
        except ValueError as error:
            raise Error(str(error).replace(f"{folder}/", "").replace(str(folder), "dataset")) from None
    for warning in columns.warnings:
        warnings.warn(warning.replace(f"{folder}: ", "").replace(f"{folder}/", ""), YairWarning, stacklevel=3)
    return columns


def _write(file: Path, table: pandas.DataFrame, names_runs: bool) -> None:
    """A table as its file. Numbers of single precision are what they are in double precision."""
    narrow = {name: np.float64 for name in table if table[name].dtype in (np.float16, np.float32)}
    table = table.astype(narrow)
    if not names_runs:
        table = table.assign(run=ONE_RUN)
    if file.stem == "truth" and "theta_rad" not in table:
        table = table.assign(theta_rad=np.nan)
    table.to_csv(file, index=False)


def _runs(ids: list[str], runs: pandas.DataFrame | None) -> list[dict[str, Any]]:
    """What is known of every run as a whole: a row of `runs` each, by its id; empty cells say nothing."""
    known: dict[str, dict[str, Any]] = {id: {} for id in ids}
    if runs is not None:
        if "id" not in runs:
            raise Error(f"runs: no column id among {', '.join(map(str, runs))}")
        for row in runs.to_dict("records"):
            id = str(row.pop("id"))
            if id not in known:
                raise Error(f'runs: it has a run "{id}" of which there is no odometry')
            known[id] = {str(key): value for key, value in row.items() if not _is_empty(value)}
    return [{"id": id, **keys} for id, keys in known.items()]


def _is_empty(value: Any) -> bool:
    return value is None or (isinstance(value, float) and math.isnan(value))


def _manifest(
    general: Mapping[str, Any],
    sections: Mapping[str, Mapping[str, Any]],
    runs: list[dict[str, Any]],
    marks: Mapping[str, tuple[float, float]],
) -> str:
    parts = [_keys(general)]
    parts += [f"[{name}]\n{_keys(keys)}" for name, keys in sections.items()]
    parts += [f"[[run]]\n{_keys(keys)}" for keys in runs]
    parts += [f"[[point]]\n{_keys({'id': id, 'x_m': x_m, 'y_m': y_m})}" for id, (x_m, y_m) in marks.items()]
    return "\n".join(parts)


def _keys(keys: Mapping[str, Any]) -> str:
    return "".join(
        f"{json.dumps(str(key))} = {_value(key, value)}\n" for key, value in keys.items() if value is not None
    )


def _value(key: str, value: Any) -> str:
    """A value as TOML, whose texts and truth values are those of JSON."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool | str | int):
        return json.dumps(value)
    if isinstance(value, float):
        return repr(value)
    raise Error(f"{key}: {value!r} is no text, number or truth value")
