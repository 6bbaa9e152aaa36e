"""The Rust half of the package."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

__version__: str

def call(
    arguments: Sequence[str | os.PathLike[str]], progress: Callable[[str, int, int], object] | None = None
) -> tuple[int, str | None, list[str], str | None]:
    """Exit code, JSON document, remarks and message of the command with these arguments."""

def datasets_to_compute(
    dirs: Sequence[str | os.PathLike[str]], out: str | os.PathLike[str], calibrate_only: bool
) -> list[Path]:
    """Datasets in or below these folders of which the folder `out` of a fleet keeps no result."""

def main(arguments: Sequence[str]) -> int:
    """Runs the command as a process does and returns its exit code."""

class Columns:
    """A dataset in memory."""

    def __init__(
        self,
        *,
        left_wheel_diameter_m: float,
        right_wheel_diameter_m: float,
        wheel_separation_m: float,
        ticks_per_rev: float | None = None,
        counter_bits: int | None = None,
        name: str | None = None,
        robot_id: str | None = None,
        recorded: str | None = None,
        sigma_xy_m: float | None = None,
        sigma_theta_rad: float | None = None,
    ) -> None: ...
    @staticmethod
    def read(path: str | os.PathLike[str]) -> Columns: ...
    def write(self, path: str | os.PathLike[str], force: bool) -> None: ...
    def check_writable(self) -> None: ...
    def add_run(
        self,
        id: str,
        form: str,
        t_s: NDArray[np.float64],
        first: NDArray[np.float64],
        second: NDArray[np.float64],
    ) -> None: ...
    def add_truth(
        self,
        t_s: NDArray[np.float64],
        x_m: NDArray[np.float64],
        y_m: NDArray[np.float64],
        theta_rad: NDArray[np.float64] | None = None,
        sigma_xy_m: NDArray[np.float64] | None = None,
        sigma_theta_rad: NDArray[np.float64] | None = None,
        covariance: Sequence[NDArray[np.float64]] | None = None,
    ) -> None: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def name(self) -> str | None: ...
    @property
    def robot(self) -> dict[str, float | int | None]: ...
    @property
    def runs(self) -> list[str]: ...
    def odometry(self, run: int) -> dict[str, NDArray[np.float64] | NDArray[np.int64]]: ...
    def truth(self, run: int) -> dict[str, NDArray[np.float64]]: ...
