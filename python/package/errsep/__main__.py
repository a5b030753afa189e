"""The program: ``python -m errsep`` and the command ``errsep`` that comes with the package."""

import signal
import sys

from . import _errsep


def main() -> int:
    """Runs the program with the arguments of this process; returns its exit status."""
    # Ctrl-C ends the program as it does anywhere else; Python's own handler would wait for its end.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _errsep.main(["errsep", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
