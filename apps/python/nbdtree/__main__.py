"""`python -m nbdtree ARGUMENTS`, and the command of the wheel: runs the program nbdtree."""

import os
import pathlib
import shutil
import sys


def main() -> None:
    beside = pathlib.Path(__file__).resolve().parent / "bin" / "nbdtree"  # in the wheel and in the archive
    program = str(beside) if beside.exists() else shutil.which("nbdtree")
    if program is None:
        sys.exit("error: there is no program nbdtree in this package or on the PATH")
    os.execv(program, ["nbdtree", *sys.argv[1:]])


if __name__ == "__main__":
    main()
