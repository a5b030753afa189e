"""The program: ``python -m errsep`` and the command ``errsep`` that comes with the package."""

import signal
import sys
import threading

from . import _errsep


def main() -> int:
    """Runs the program with the arguments of this process; returns its exit status."""
    words = ["errsep", *sys.argv[1:]]
    if threading.current_thread() is not threading.main_thread():
        return _errsep.main(words)
    # Ctrl-C ends the program as it does anywhere else; Python's own handler would wait for its end.
    before = signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        return _errsep.main(words)
    finally:
        signal.signal(signal.SIGINT, before)


if __name__ == "__main__":
    sys.exit(main())
