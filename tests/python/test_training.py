import json

import h5py
import numpy as np
import pytest
from conftest import one_line, refused, same_arrays

import nbdtree as nbd


def test_datasets_are_the_bits_of_the_command(command, beam_file, poses, tmp_path):
    out = tmp_path / "poses.h5"
    command("dataset", beam_file, "-o", out, "--trajectories", 12, "--frames", 8, "--seed", 3)
    a, b = nbd.RecordingReader(out), nbd.RecordingReader(poses)
    assert len(a.trajectories) == 12
    for i, (s, t) in enumerate(zip(a.trajectories, b.trajectories)):
        assert (s.id, s.frames, s.recipe, s.body_hash) == (t.id, t.frames, t.recipe, t.body_hash)
        assert a.read(i).tobytes() == b.read(i).tobytes()


def test_trees_are_the_bits_of_the_command(command, beam_file, poses, tree_file, tmp_path):
    out, ours = tmp_path / "command.h5", tmp_path / "python.h5"
    command("train", beam_file, poses, "-o", out, "--bounds", "learned_affine", "--depth", 5)
    nbd.save_tree(ours, tree_file)
    assert same_arrays(out, ours)


def test_frames_are_read_as_they_are_stored(poses):
    reader = nbd.RecordingReader(poses)
    trajectory = reader.trajectories[2]
    with h5py.File(poses) as file:
        stored = file[f"trajectories/{trajectory.id:06}/positions"][:]
    x = reader.read(2)
    assert x.dtype == np.float32 and np.array_equal(x, stored)
    assert np.array_equal(reader.read(2, 3, 2), stored[3:5])
    assert np.all(np.diff(reader.times(2)) > 0) and len(reader.times(2)) == trajectory.frames
    assert len(reader.facts(2)["contacts"]) == trajectory.frames
    assert json.loads(trajectory.recipe)["kind"]
    for call in (lambda: reader.read(99), lambda: reader.read(2, 6, 3), lambda: reader.read(2, -1)):
        with pytest.raises(IndexError) as error:
            call()
        one_line(error)


def test_a_trained_tree_hardly_misses(beam, poses, tree_file):
    assert tree_file.facts["body_hash"] == beam.hash
    assert {"learned_affine", "affine"} <= set(tree_file.tree.bounds)
    stated = tree_file.tree.calibrations["learned_affine"]
    assert stated["miss_rate"] == 1e-3 and len(stated["margins"]) > 10
    rows = nbd.evaluate(tree_file, poses, ["exact", "learned_affine"], [0.0])
    learned = [row for row in rows if row.bound == "learned_affine"]
    assert learned and {row.depth for row in learned} == {0, 1, 2}
    assert all(row.nodes_missing == 0 for row in rows if row.bound == "exact")
    assert all(row.radius_error < 1 for row in learned)


def test_bounds_without_calibration_need_a_margin(beam, poses):
    tree = nbd.train(beam, poses, ["learned_affine"], depth=3, calibration=0).tree
    with pytest.raises(ValueError, match='"learned_affine" bounds are not calibrated.*run `nbdtree calibrate`'):
        nbd.PosedTree(tree, "learned_affine")
    assert nbd.PosedTree(tree, "learned_affine", margin=0).bounds == "learned_affine"
    assert nbd.PosedTree(tree, "auto").bounds == "auto"


def test_a_calibration_is_of_a_new_file(beam, poses):
    file = nbd.train(beam, poses, ["learned_affine"], depth=4, calibration=0.4)
    tree, before = file.tree, file.tree.calibrations["learned_affine"]["margins"]
    file = nbd.calibrate(file, poses, miss_rate=0.05)
    assert np.array_equal(tree.calibrations["learned_affine"]["margins"], before)
    with pytest.raises(ValueError):
        nbd.calibrate(file, poses, confidence=0.9999)
    assert file.tree.calibrations["learned_affine"]["miss_rate"] == 0.05


def test_progress_is_told_and_its_errors_are_raised(beam, poses, tmp_path):
    told = []
    nbd.make_dataset(beam, tmp_path / "p.h5", trajectories=2, frames=2, progress=lambda *what: told.append(what))
    assert told[-1] == ("trajectories", 2, 2)

    def refuse(what, done, total):
        raise LookupError(what)

    def open_file(what, done, total):
        nbd.dataset_manifest(poses)

    with refused(RuntimeError, "progress: must not call functions that read or write files of nbdtree", whole=True):
        nbd.train(beam, poses, ["learned_affine"], depth=4, progress=open_file)
    with pytest.raises(LookupError):
        nbd.train(beam, poses, ["learned_affine"], depth=4, progress=refuse)
    with pytest.raises(LookupError):
        nbd.make_dataset(beam, tmp_path / "q.h5", trajectories=3, frames=2, progress=refuse)
    nbd.make_dataset(beam, tmp_path / "q.h5", trajectories=3, frames=2)
    assert nbd.RecordingReader(tmp_path / "q.h5").frames == 6
    assert "\nall                   3 " in (tmp_path / "q.shards" / "README.md").read_text()


def test_recordings_are_written_frame_by_frame(tmp_path):
    path = tmp_path / "own.h5"
    x = np.random.default_rng(1).normal(size=(4, 7, 3))
    with nbd.RecordingWriter(path) as writer:
        handle = writer.begin_trajectory(7, 0, recipe="{}")
        for time, frame in enumerate(x):
            assert not path.exists()
            writer.add_frame(handle, time, frame)
        writer.end_trajectory(handle, facts={"contacts": [0, 1, 2, 3]})
    reader = nbd.RecordingReader(path)
    assert np.array_equal(reader.read(0), x.astype(np.float32))
    assert list(reader.facts(0)["contacts"]) == [0, 1, 2, 3]
    with refused(RuntimeError, "RecordingWriter: is closed", whole=True):
        writer.finish()


def test_bad_arguments_are_refused(beam, poses, tree_file, tmp_path):
    for call, text in [
        (lambda: nbd.train(beam, poses, ["affine"]), "affine"),
        (lambda: nbd.train(beam, poses, network="deep"), 'network: is "deep"'),
        (lambda: nbd.train(beam, poses, ["nbd"], depth=4), "modes"),
        (lambda: nbd.train(beam, poses, ["learned_affine"], progress=3), "progress: is not callable"),
        (lambda: nbd.evaluate(tree_file, poses, ["exact"], [-1.0]), "margin"),
        (lambda: nbd.make_dataset(beam, tmp_path / "x.h5", trajectories=0), "trajectories"),
        (lambda: nbd.make_dataset(beam, tmp_path / "x.h5", recipe={"strenth": 1}), "strenth"),
        (lambda: nbd.make_dataset(beam, tmp_path / "x.h5", held_out=2), "held_out"),
        (lambda: nbd.make_dataset(beam, tmp_path / "x.h5", strength=1e9), "strength"),
        (lambda: nbd.make_dataset(beam, tmp_path / "x.h5", recipe=5), "recipe: is"),
    ]:
        with refused(ValueError, text):
            call()
    assert list(tmp_path.iterdir()) == []
