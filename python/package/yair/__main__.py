"""`python -m yair`: the command line."""

import signal
import sys

from . import _yair


def main() -> int:
    """Runs the command with the arguments of this process and returns its exit code."""
    # Python's handler would wait for the command to end.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _yair.main(["yair", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
