"""What the tests of the package share. They take the package from NBDTREE_PYTHON if that names a folder."""

import contextlib
import os
import pathlib
import sys
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
def beam():
    return nbd.mesh_file(ASSETS / "beam.obj")


@pytest.fixture(scope="session")
def beam_file(beam, tmp_path_factory):
    path = tmp_path_factory.mktemp("beam") / "beam.h5"
    nbd.save_body(path, beam)
    return path


@pytest.fixture(scope="session")
def poses(beam, tmp_path_factory):
    """A small dataset of the beam."""
    path = tmp_path_factory.mktemp("poses") / "poses.h5"
    nbd.make_dataset(beam, path, trajectories=12, frames=24, seed=3)
    return path


@pytest.fixture(scope="session")
def tree_file(beam, poses):
    return nbd.train(beam, poses, ["learned_affine"], depth=5, seed=1)


def one_line(error):
    """The text of an exception, which must be one line."""
    text = str(error.value)
    assert text and "\n" not in text
    return text


@contextlib.contextmanager
def refused(kind, text, whole=False):
    """Expects an exception of one line, which holds the text, or is it."""
    with pytest.raises(kind) as error:
        yield
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


def boxes_of(positions, faces):
    corners = positions[faces]
    return corners.min(axis=1), corners.max(axis=1)


def close_pairs(xa, fa, xb, fb):
    """All pairs of faces whose boxes overlap, by brute force."""
    lo_a, hi_a = boxes_of(xa, fa)
    lo_b, hi_b = boxes_of(xb, fb)
    overlap = np.all((lo_a[:, None] <= hi_b[None]) & (lo_b[None] <= hi_a[:, None]), axis=2)
    return pairs_of(np.argwhere(overlap))
