"""What a second worker gains on Ray, beside what a second thread gains in one process:

    python python/benches/ray_gain.py scenarios/paper.toml TRIALS [TURNS]

docs/scale.md has the figures. Each way computes the same campaign: one thread, two threads, and a cluster of one
and of two nodes with a processor each, on this machine, connection included. Trials are those of a point; take
so many that one thread needs a minute or more.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

os.environ["RAY_USAGE_STATS_ENABLED"] = "0"

import yair
from ray.cluster_utils import Cluster
from turns import in_turn, median_interval

TURNS = 5
SHARDS = 8


def main(scenario: str, trials: int, turns: int) -> None:
    """Prints both gains and their ratio."""
    clusters = []
    documents = set()
    try:
        for count in (1, 2):
            cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "include_dashboard": False})
            clusters.append(cluster)
            for _ in range(count):
                cluster.add_node(num_cpus=1)

        def threads(jobs: int) -> Callable[[], None]:
            def work() -> None:
                found = yair.sweep(scenario, trials=trials, jobs=jobs)
                documents.add(found.json if found else "")

            return work

        def workers(cluster: Cluster) -> Callable[[], None]:
            def work() -> None:
                with tempfile.TemporaryDirectory() as folder:
                    out = Path(folder, "merged")
                    found = yair.cluster.sweep(scenario, SHARDS, out, cluster.address, trials=trials)
                documents.add(found.json)

            return work

        taken = in_turn([threads(1), threads(2), workers(clusters[0]), workers(clusters[1])], turns)
    finally:
        for cluster in clusters:
            cluster.shutdown()
    if len(documents) != 1:
        sys.exit("the four ways give different documents")
    walls = [[times.wall_s for times in turn] for turn in taken]
    of_threads = [one / two for one, two, _, _ in walls]
    of_workers = [one / two for _, _, one, two in walls]
    print(f"gain of a second thread: {median_interval(of_threads)}")
    print(f"gain of a second worker: {median_interval(of_workers)}")
    ratios = [worker / thread for worker, thread in zip(of_workers, of_threads, strict=True)]
    print(f"worker's gain over thread's, {turns} turns: {median_interval(ratios)}")
    print(f"one worker's time over one thread's: {median_interval([ray / one for one, _, ray, _ in walls])}")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else TURNS)
