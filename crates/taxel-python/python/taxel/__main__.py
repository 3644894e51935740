"""The command ``taxel``: ``python -m taxel``."""

from __future__ import annotations

import signal
import sys

from . import _taxel


def main() -> None:
    """Runs the command with the arguments of this process and ends it with the command's code."""
    # The command has handlers of its own; without one Ctrl-C ends it as it ends other programs.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_taxel.command(["taxel", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
