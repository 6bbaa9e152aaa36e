"""Odometry of differential-drive robots: calibrated, diagnosed, planned for, simulated and benched.

Everything is computed by the core of the command `yair`, in this process; results have the names of the
command's JSON. Lengths are metres, angles radians, times seconds.
"""

from . import cluster
from ._yair import __version__
from .api import (
    calibrate,
    challenge,
    check,
    correct,
    diagnose,
    evaluate,
    fleet,
    merge,
    merge_challenge,
    plan,
    simulate,
    sweep,
)
from .call import Error, YairWarning
from .dataset import Dataset
from .result import Record, Result

__all__ = [
    "Dataset",
    "Error",
    "Record",
    "Result",
    "YairWarning",
    "__version__",
    "calibrate",
    "challenge",
    "check",
    "cluster",
    "correct",
    "diagnose",
    "evaluate",
    "fleet",
    "merge",
    "merge_challenge",
    "plan",
    "simulate",
    "sweep",
]

# Named as they are imported.
for _name in (Dataset, Error, Record, Result, YairWarning):
    _name.__module__ = __name__
del _name
