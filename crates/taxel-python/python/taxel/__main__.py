"""``python -m taxel``: the program ``taxel`` of the PATH; the package has none of its own."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

INSTALL = """error: the program taxel is not on the PATH
help: in a checkout: cargo install --path crates/taxel-cli"""


def main() -> None:
    """Becomes the program ``taxel`` with the arguments of this process."""
    program = shutil.which("taxel")
    if program is None:
        sys.exit(INSTALL)
    arguments = [program, *sys.argv[1:]]
    if os.name == "posix":
        os.execv(program, arguments)
    sys.exit(subprocess.call(arguments))


if __name__ == "__main__":
    main()
