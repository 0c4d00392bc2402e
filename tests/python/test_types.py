"""The stubs: complete, and true of what is there."""

import ast
import inspect
import pathlib
import subprocess
import sys

import pytest

import nbdtree as nbd

PACKAGE = pathlib.Path(nbd.__file__).parent
STUBS = ast.parse((PACKAGE / "__init__.pyi").read_text())
DEFINITIONS = {node.name: node for node in STUBS.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
TYPED_ONLY = {"ClosestFaces", "CalibrationFacts", "FeaturePairs", "FreeStep", "RecordedReactions", "WorldRecording"}


def names_of(owner):
    """Public names of a class, with constructors and operators of its own."""
    special = {"__init__", "__len__", "__contains__", "__enter__", "__exit__"}
    return {name for name, item in vars(owner).items()
            if not name.startswith("_") or (name in special and inspect.isroutine(item))}


def test_stubs_name_everything_and_nothing_else():
    assert set(DEFINITIONS) - TYPED_ONLY == set(nbd.__all__)
    compared = 0
    for name, node in DEFINITIONS.items():
        if not isinstance(node, ast.ClassDef) or name in TYPED_ONLY | {"Stopped"}:
            continue
        stubbed = {item.target.id if isinstance(item, ast.AnnAssign) else item.name for item in node.body} - {"__eq__"}
        there = names_of(getattr(nbd, name))
        assert stubbed == there if "__init__" in stubbed else stubbed == there - {"__init__"}, name
        compared += len(stubbed)
    assert compared > 100


def test_types_are_known_ones():
    """No type of pybind11 or of C++ alone has come into the stubs, and nothing is an object of any kind."""
    defined = {node.target.id if isinstance(node, ast.AnnAssign) else node.targets[0].id
               for node in STUBS.body if isinstance(node, (ast.AnnAssign, ast.Assign))}
    imported = {name.asname or name.name for node in STUBS.body if isinstance(node, (ast.Import, ast.ImportFrom))
                for name in node.names}
    builtin = {"int", "float", "str", "bool", "list", "dict", "KeyboardInterrupt"}
    used = [node.id for item in DEFINITIONS.values() for node in ast.walk(item)
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)]
    assert used.count("object") == 1  # what a Material is compared with
    assert set(used) - {"object"} <= defined | imported | builtin | set(DEFINITIONS)
    assert {"Array", "Floats", "Doubles", "Indices", "Path", "Weights", "Progress"} <= set(used)


def test_everything_has_a_text():
    for name in nbd.__all__:
        item = getattr(nbd, name)
        assert item.__doc__ and item.__doc__.strip(), name


@pytest.fixture(scope="module")
def mypy(tmp_path_factory):
    """Checks files strictly; returns what mypy says and its status."""
    if subprocess.run([sys.executable, "-c", "import mypy"], capture_output=True).returncode:
        pytest.skip("mypy is not installed")

    def check(*files):
        # matplotlib has types of its own since 3.8.
        run = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--no-warn-unused-ignores", "--no-error-summary",
                              "--cache-dir", tmp_path_factory.getbasetemp(), *files], capture_output=True, text=True,
                             env={"MYPYPATH": str(PACKAGE.parent), "PATH": "/usr/bin:/bin"})
        return run.stdout + run.stderr, run.returncode

    return check


def test_mypy_accepts_the_stubs_and_the_examples(mypy):
    examples = sorted((pathlib.Path(__file__).resolve().parents[2] / "apps" / "python" / "examples").glob("*.py"))
    assert len(examples) == 7
    assert mypy(PACKAGE / "__init__.pyi", *examples) == ("", 0)


def test_mypy_finds_a_wrong_call(mypy, tmp_path):
    """Shows that the stubs are read at all."""
    wrong = tmp_path / "wrong.py"
    wrong.write_text("import nbdtree as nbd\nnbd.World(3).steps()\n")
    told, status = mypy(wrong)
    assert status == 1 and '"World" has no attribute "steps"' in told and "incompatible type" in told
