"""The stubs: complete, and true of what is there."""

import inspect
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

import nbdtree as nbd

PACKAGE = pathlib.Path(nbd.__file__).parent
STUBS = (PACKAGE / "__init__.pyi").read_text()


def names_of(owner):
    """Public names of the package or of a class of it, with constructors and operators of its own."""
    special = {"__init__", "__len__", "__contains__", "__enter__", "__exit__"}
    return {name for name in vars(owner) if not name.startswith("_") or name in special}


def test_stubs_name_everything_and_nothing_else():
    of_module = set(re.findall(r"^(?:def|class) (\w+)", STUBS, re.M))
    typed_only = {"ClosestFaces", "CalibrationFacts", "FeaturePairs", "FreeStep", "WorldRecording"}
    assert of_module - typed_only == set(nbd.__all__)
    compared = 0
    for text in re.split(r"^class ", STUBS, flags=re.M)[1:]:
        name = re.match(r"\w+", text)[0]
        if name in typed_only | {"Stopped"}:
            continue
        body = text.split("\n\n")[0]
        stubbed = set(re.findall(r"^    (?:def )?(\w+)[:(]", body, re.M)) - {"__eq__"}
        there = names_of(getattr(nbd, name))
        if "__init__" not in stubbed:
            there.discard("__init__")
        assert stubbed == there, name
        compared += len(stubbed)
    assert compared > 100


def test_parameters_have_the_names_of_the_stubs():
    checked = 0
    for name, parameters in re.findall(r"^def (\w+)\((.*?)\) ->", STUBS, re.M | re.S):
        function = getattr(nbd, name)
        if not inspect.isbuiltin(function):
            continue
        stubbed = re.findall(r"(\w+): ", parameters)
        there = re.findall(r"(\w+): ", function.__doc__.split(") ->")[0].split("(", 1)[1])
        assert stubbed == there, name
        checked += 1
    assert checked > 20


def test_everything_has_a_text():
    for name in nbd.__all__:
        item = getattr(nbd, name)
        assert item.__doc__ and item.__doc__.strip(), name


def test_mypy_accepts_the_stubs_and_the_examples(tmp_path):
    if not shutil.which("mypy") and subprocess.run([sys.executable, "-c", "import mypy"]).returncode:
        pytest.skip("mypy is not installed")
    examples = sorted((pathlib.Path(__file__).resolve().parents[2] / "apps" / "python" / "examples").glob("*.py"))
    assert len(examples) == 5
    # matplotlib has types of its own since 3.8.
    check = [sys.executable, "-m", "mypy", "--strict", "--no-warn-unused-ignores", "--cache-dir", tmp_path,
             "--no-error-summary"]
    environment = {"MYPYPATH": str(PACKAGE.parent), "PATH": "/usr/bin:/bin"}
    for files in ([PACKAGE / "__init__.pyi"], *([example] for example in examples)):
        run = subprocess.run([*check, *files], capture_output=True, text=True, env=environment)
        assert run.returncode == 0, run.stdout + run.stderr


def test_mypy_finds_a_wrong_call(tmp_path):
    """Shows that the stubs are read at all."""
    if subprocess.run([sys.executable, "-c", "import mypy"], capture_output=True).returncode:
        pytest.skip("mypy is not installed")
    wrong = tmp_path / "wrong.py"
    wrong.write_text("import nbdtree as nbd\nnbd.World(3).steps()\n")
    run = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--cache-dir", tmp_path, wrong], text=True,
                         capture_output=True, env={"MYPYPATH": str(PACKAGE.parent), "PATH": "/usr/bin:/bin"})
    assert run.returncode == 1 and '"World" has no attribute "steps"' in run.stdout and "incompatible type" in run.stdout
