"""Documents as tables: what is a row of which."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .result import Record

if TYPE_CHECKING:
    import pandas


def parameter_rows(document: Record) -> list[dict[str, Any]]:
    """A row a method and parameter."""
    rows = []
    for method in document.methods:
        for name, value in method.get("parameters", {}).items():
            rows.append({"method": method.method, "parameter": name, **value.to_dict()})
        if "error" in method:
            rows.append({"method": method.method, "error": method.error})
    return rows


def drift_rows(document: Record) -> list[dict[str, Any]]:
    """A row a calibration and run."""
    return [{"calibration": of.name, **run.to_dict()} for of in document.calibrations for run in of.runs]


def finding_rows(document: Record) -> list[dict[str, Any]]:
    """A row a finding and parameter."""
    rows = []
    for finding in document.findings:
        head = {"id": finding.id, "probability": finding.probability, "z": finding.z}
        parameters = finding.parameters.items() or [(None, Record({}))]
        rows += [{**head, "parameter": name, **value.to_dict()} for name, value in parameters]
    return rows


def problem_rows(document: Record) -> list[dict[str, Any]]:
    """A row a problem."""
    return [problem.to_dict() for problem in document.problems]


def robot_rows(document: Record) -> list[dict[str, Any]]:
    """A row a robot and parameter of its latest session."""
    return [
        {
            "rank": robot.rank,
            "id": robot.id,
            "parameter": name,
            **value.to_dict(),
            "changed": any(
                change.significant and change.parameter == name and change.to == robot.sessions[-1].dataset
                for change in robot.changes
            ),
            "excess_drift_percent": robot.excess_drift_percent.value,
        }
        for robot in document.robots
        for name, value in robot.parameters.items()
    ]


def plan_rows(document: Record) -> list[dict[str, Any]]:
    """A row an effect and what the next experiment predicts of it."""
    following = document.get("next_experiment") or Record({})
    return [{"id": name, "predicts": value} for name, value in following.get("predicts", {}).items()]


def estimator_rows(document: Record) -> list[dict[str, Any]]:
    """A row a point, method and parameter; the levels of the design are columns."""
    return [
        {"point": number, **point.levels.to_dict(), **estimator.to_dict()}
        for number, point in enumerate(document.points, start=1)
        for estimator in point.estimators
    ]


def measure_rows(document: Record) -> list[dict[str, Any]]:
    """A row a measure of the blind benchmark."""
    return [measure.to_dict() for measure in document.measures]


def pose_tables(document: Record) -> pandas.DataFrame:
    """The corrected poses of all runs, from their files."""
    import pandas

    tables = []
    for dataset in document.datasets:
        for run in dataset.runs:
            with open(run.csv, encoding="utf-8") as file:
                names = file.readline().rstrip("\n").split(",")
                # Not pandas' reader, which rounds.
                poses = np.loadtxt(file, delimiter=",", ndmin=2)
            tables.append(pandas.DataFrame(poses, columns=names))
            tables[-1].insert(0, "run", run.run)
            tables[-1].insert(0, "dataset", dataset.dataset)
    return pandas.concat(tables, ignore_index=True)
