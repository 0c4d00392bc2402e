"""What the tests of the package share. They take the package from NBDTREE_PYTHON if that names a folder."""

import contextlib
import os
import pathlib
import signal
import subprocess
import sys
import textwrap
import threading

import numpy as np
import pytest

if "NBDTREE_PYTHON" in os.environ:
    sys.path.insert(0, os.environ["NBDTREE_PYTHON"])

import nbdtree as nbd

ASSETS = pathlib.Path(__file__).resolve().parents[2] / "assets"


@pytest.fixture(scope="session")
def assets():
    return ASSETS


@pytest.fixture(scope="session")
def program():
    """The program `nbdtree` of the same build."""
    if "NBDTREE_PROGRAM" not in os.environ:
        pytest.skip("NBDTREE_PROGRAM does not name the program nbdtree")
    return os.environ["NBDTREE_PROGRAM"]


@pytest.fixture(scope="session")
def command(program):
    """Runs a command of the program quietly, to its end."""

    def run(*arguments, cwd=None):
        subprocess.run([program, *map(str, arguments), "--quiet"], cwd=cwd, check=True)

    return run


@pytest.fixture(scope="session")
def beam():
    return nbd.mesh_file(ASSETS / "beam.obj", elements="linear")


@pytest.fixture(scope="session")
def beam_file(beam, tmp_path_factory):
    path = tmp_path_factory.mktemp("beam") / "beam.h5"
    nbd.save_body(path, beam)
    return path


@pytest.fixture(scope="session")
def poses(beam, tmp_path_factory):
    """A small dataset of the beam."""
    path = tmp_path_factory.mktemp("poses") / "poses.h5"
    nbd.make_dataset(beam, path, trajectories=12, frames=8, seed=3)
    return path


def write_random_poses(path, body, trajectories, frames):
    """A recording of a body, each frame of which is stretched along the axes and shaken."""
    random = np.random.default_rng(1)
    with nbd.RecordingWriter(path) as writer:
        for trajectory in range(trajectories):
            handle = writer.begin_trajectory(len(body.X), trajectory, body_hash=body.hash)
            for frame in range(frames):
                x = body.X * random.uniform(0.9, 1.1, 3) + random.normal(scale=1e-3, size=body.X.shape)
                writer.add_frame(handle, frame, x)
            writer.end_trajectory(handle)


@pytest.fixture(scope="session")
def tree_file(beam, poses):
    return nbd.train(beam, poses, ["learned_affine"], depth=5, seed=1)


def one_line(error):
    """The text of an exception, which must be one line."""
    text = str(error.value)
    assert text and "\n" not in text
    return text


def run_python(*arguments, cwd=None, signalled=False):
    """Runs Python with the package in a process of its own; returns what it prints, its errors and its status. arguments:
    of the interpreter. signalled: it prints `ready` and then gets Ctrl-C."""
    paths = [pathlib.Path(nbd.__file__).parents[1], pathlib.Path(__file__).parent]
    process = subprocess.Popen([sys.executable, *map(str, arguments)], cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               text=True, env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, paths))})
    if signalled:
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGINT)
    return *process.communicate(), process.returncode


def output_of(code, *arguments, cwd=None):
    """What Python code prints in a process of its own, which must end well."""
    printed, errors, status = run_python("-c", textwrap.dedent(code), *arguments, cwd=cwd)
    assert status == 0, printed + errors
    return printed


def arrays_of(path):
    """All arrays of a file, by their names."""
    import h5py

    found = {}
    with h5py.File(path) as file:
        file.visititems(lambda name, item: found.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None)
    return found


def same_arrays(one, other):
    """Whether two files hold the same arrays, more than ten."""
    a, b = arrays_of(one), arrays_of(other)
    return a.keys() == b.keys() and len(a) > 10 and all(np.array_equal(a[name], b[name]) for name in a)


@contextlib.contextmanager
def refused(kind, text, whole=False):
    """Expects an exception of one line, which holds the text, or is it."""
    with pytest.raises(kind) as error:
        yield error
    assert text == one_line(error) if whole else text in one_line(error), text


def in_threads(*works):
    """Runs functions in threads of their own to their ends."""
    threads = [threading.Thread(target=work) for work in works]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def pairs_of(rows):
    """Rows of an array as a set."""
    return {tuple(row) for row in rows.tolist()}


def folded(x):
    """Positions of a beam that is folded in its middle until its halves touch."""
    middle = x[:, 0].mean()
    over = x.copy()
    over[x[:, 0] > middle, 0] = 2 * middle - x[x[:, 0] > middle, 0]
    over[:, 1] += 0.3 * x[:, 0]
    return over


def falling_beams(beam, height=0.3):
    """A scene with two beams above a floor."""
    return {
        "bodies": [
            {"body": beam, "name": "lower", "transform": {"translate": [0, 0, height]}},
            {"body": beam, "name": "upper", "transform": {"translate": [0.1, 0.02, 2 * height]}},
        ],
        "obstacles": [{"plane": {"normal": [0, 0, 1]}}],
        "time": {"dt": 0.005, "frames": 10, "steps_per_frame": 2},
    }
