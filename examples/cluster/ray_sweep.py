"""One campaign on a Ray cluster: every task computes a shard, this process merges them.

    python examples/cluster/ray_sweep.py scenarios/paper.toml 16 merged [ADDRESS]

ADDRESS is that of a running cluster (`ray start --head` prints it); without it Ray takes that of RAY_ADDRESS, or
one of this machine. Every node has this package (`pip install yair[cluster]`); no folder is shared.
"""

import sys

import yair


def main() -> None:
    """Shows how many shards are done, and the table."""
    scenario, shards, out, *address = sys.argv[1:]

    def progress(what: str, done: int, total: int) -> None:
        print(f"{done} of {total} {what}", file=sys.stderr)

    found = yair.cluster.sweep(scenario, int(shards), out, *address, progress=progress)
    print(found.json)


if __name__ == "__main__":
    main()
