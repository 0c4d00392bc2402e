"""`python -m nbdtree`: the program by the package."""

import os
import subprocess
import sys
from pathlib import Path

PACKAGE = os.environ["NBDTREE_PYTHON"]
PROGRAM = Path(os.environ["NBDTREE_PROGRAM"])


def run(*arguments, path):
    environment = dict(os.environ, PYTHONPATH=PACKAGE, PATH=str(path))
    return subprocess.run([sys.executable, "-m", "nbdtree", *arguments], env=environment, capture_output=True, text=True)


def test_runs_the_program_on_the_path_with_all_arguments():
    direct = subprocess.run([PROGRAM, "collide", "--help"], capture_output=True, text=True)
    by_module = run("collide", "--help", path=PROGRAM.parent)
    assert "--within" in by_module.stdout
    assert (by_module.returncode, by_module.stdout) == (0, direct.stdout)


def test_ends_with_the_programs_status():
    result = run("collide", "nowhere.obj", path=PROGRAM.parent)
    assert result.returncode == 2
    assert "error" in result.stderr


def test_says_where_it_looked_for_a_program(tmp_path):
    result = run("--version", path=tmp_path)
    assert result.returncode == 1
    assert result.stderr == "error: there is no program nbdtree in this package or on the PATH\n"
