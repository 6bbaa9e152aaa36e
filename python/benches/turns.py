"""Times of several ways of one work, taken in turn, and the median of their ratios with its interval.

In turn, since a machine that others use is slower at one time than at another: a ratio within a turn has
both ways under much the same load.
"""

from __future__ import annotations

import math
import resource
import statistics
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

CONFIDENCE = 0.95


class Times(NamedTuple):
    """Seconds by the clock, and of the processor in this process and in those that it has waited for."""

    wall_s: float
    cpu_s: float


def _cpu_s() -> float:
    used = (resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN))
    return sum(one.ru_utime + one.ru_stime for one in used)


def timed(work: Callable[[], object]) -> Times:
    """What a call takes."""
    wall_s, cpu_s = time.perf_counter(), _cpu_s()
    work()
    return Times(time.perf_counter() - wall_s, _cpu_s() - cpu_s)


def in_turn(ways: Sequence[Callable[[], object]], turns: int) -> list[list[Times]]:
    """A list a turn; every second turn goes through the ways backwards, so that none is always the first."""
    all_turns = []
    for turn in range(turns):
        order = list(range(len(ways)))
        taken = {way: timed(ways[way]) for way in (order if turn % 2 == 0 else reversed(order))}
        all_turns.append([taken[way] for way in order])
        print(f"turn {turn + 1}: " + ", ".join(f"{times.wall_s:.2f} s" for times in all_turns[-1]), flush=True)
    return all_turns


def median_interval(values: Sequence[float]) -> str:
    """The median and the interval between order statistics that holds it with 95 % or, of few values, with what
    the least and the largest hold it (binomial with 1/2)."""
    ordered, count = sorted(values), len(values)

    def held(rank: int) -> float:
        return 1.0 - 2.0 * sum(math.comb(count, k) for k in range(rank)) / 2.0**count

    rank = max((rank for rank in range(1, count // 2 + 1) if held(rank) >= CONFIDENCE), default=1)
    low, high = ordered[rank - 1], ordered[count - rank]
    return f"{statistics.median(ordered):.3f} ({100 * held(rank):.0f} % interval {low:.3f} to {high:.3f})"
