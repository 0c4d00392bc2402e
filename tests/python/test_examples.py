"""The examples run, and print what their texts promise."""

import pathlib
import re

import pytest
from conftest import run_python

import nbdtree as nbd

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "apps" / "python" / "examples"


def run(name, *arguments, cwd):
    printed, errors, status = run_python(EXAMPLES / name, *arguments, cwd=cwd)
    assert status == 0, printed + errors
    return printed


def numbers(pattern, text):
    match = re.search(pattern, text)
    assert match, text
    return [float(number) for number in match.groups()]


def test_there_is_a_test_for_each_example():
    tested = {name for name in globals() if re.match(r"test_\d_", name)}
    assert {f"test_{path.stem}" for path in EXAMPLES.glob("*.py")} == tested


def test_1_drop_two_bodies(tmp_path):
    pytest.importorskip("matplotlib")
    before, after = numbers(r"at the start ([\d.]+) J, at the end ([\d.]+) J", run("1_drop_two_bodies.py", cwd=tmp_path))
    assert 0 < after < 0.5 * before
    assert (tmp_path / "energy.png").read_bytes()[1:4] == b"PNG"


def test_2_collide_two_meshes(tmp_path):
    [touching] = numbers(r"touch in (\d+) of 60", run("2_collide_two_meshes.py", cwd=tmp_path))
    assert touching > 10


def test_3_train_a_tree(tmp_path):
    missed, touching = numbers(r"missed (\d+) of (\d+) intersecting", run("3_train_a_tree.py", "out", cwd=tmp_path))
    assert touching > 1000 and missed <= 0.01 * touching
    assert nbd.load_tree(tmp_path / "out" / "tree.h5").tree.bounds


def test_4_gripper(tmp_path):
    text = run("4_gripper.py", cwd=tmp_path)
    [height] = numbers(r"the block is ([\d.]+) cm above the floor", text)
    [rests] = numbers(r"the block lies (-?[\d.]+) mm above", text)
    assert height > 15 and rests < 10
    assert nbd.RecordingReader(tmp_path / "gripper.h5").frames == 3 * 800


def test_5_own_simulator(tmp_path):
    missed, near = numbers(r"missed (\d+) of (\d+) near", run("5_own_simulator.py", cwd=tmp_path))
    assert near > 500 and missed <= 0.01 * near


def test_6_finger(tmp_path):
    text = run("6_finger.py", cwd=tmp_path)
    rows = [[float(number) for number in line.split(", ")] for line in text.splitlines()[1:]]
    assert [row[0] for row in rows] == [0, 20, 40, 60]
    assert rows[0][1] == pytest.approx(0, abs=0.05) and 1 < rows[-1][1] < 1.3
    assert rows[0][2] == 0 and rows[-1][2] > 0.02


def test_7_template(tmp_path):
    text = run("7_template.py", cwd=tmp_path)
    assert numbers(r"grasps.h5: (\d+) frames .* in (\d+) trajectories", text) == [24, 2]
    [pressed] = numbers(r"pressed with ([\d.]+) N", text)
    assert pressed > 0.2
