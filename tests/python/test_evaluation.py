"""What bounds cost and miss, and data on its way to another surface: as the commands have it."""

import csv

import pytest
from conftest import refused, same_arrays, write_random_poses

import nbdtree as nbd


@pytest.fixture(scope="module")
def saved(tree_file, tmp_path_factory):
    path = tmp_path_factory.mktemp("saved") / "tree.h5"
    nbd.save_tree(path, tree_file)
    return path


@pytest.fixture(scope="module")
def fine(beam):
    """The beam with a surface of four times the faces."""
    return nbd.make_body("fine", beam.tets, beam.surface, beam.material, levels=1)


@pytest.fixture(scope="module")
def fine_file(fine, tmp_path_factory):
    path = tmp_path_factory.mktemp("fine") / "fine.h5"
    nbd.save_body(path, fine)
    return path


def rows_of(path):
    with open(path) as file:
        return list(csv.DictReader(file))


def same(printed, number):
    return float(printed) == pytest.approx(number, rel=1e-4, abs=1e-4)


def test_coverage_and_contact_scenes_are_those_of_the_command(command, saved, tree_file, poses, tmp_path):
    nodes, contacts = tmp_path / "nodes.csv", tmp_path / "contacts.csv"
    command("coverage", saved, poses, "--csv", nodes, "--contacts", 20, "--contacts-csv", contacts)
    ours, theirs = nbd.measure_coverage(tree_file, poses), rows_of(nodes)
    assert {row.bound for row in ours} == {"learned_affine"}
    assert len(ours) == len(theirs) == 3  # clusters, blocks and leaves
    for a, b in zip(ours, theirs):
        assert (a.bound, a.depth, a.trajectories, a.poses) == (
            b["bound"], int(b["depth"]), int(b["trajectories"]), int(b["poses"]))
        assert a.keeping == int(b["trajectories_keeping"]) and same(b["nodes_missing"], a.nodes_missing)
        assert same(b["keeping_low"], a.keeping_share[0]) and same(b["nodes_missing_high"], a.nodes_missing_mean[1])
        assert same(b["inflation"], a.inflation) and same(b["out_of_range"], a.out_of_range)
        assert (a.miss_rate, a.keeping_share[0] <= a.keeping / a.trajectories <= a.keeping_share[1]) == (1e-3, True)
    ours, theirs = nbd.check_contact_scenes(tree_file, poses, scenes=20), rows_of(contacts)
    assert [(a.bound, a.scenes, a.scenes_missing, a.face_pairs, a.missed) for a in ours] == [
        (b["bound"], int(b["scenes"]), int(b["scenes_missing"]), int(b["face_pairs"]), int(b["missed"])) for b in theirs]
    assert all(row.face_pairs > 0 and row.missed_share[0] <= row.missed / row.face_pairs for row in ours)


def test_bounds_that_never_miss_miss_nothing_in_contact(tree_file, poses):
    rows = nbd.check_contact_scenes(tree_file, poses, ["boxes", "affine"], scenes=10, seed=3)
    assert [(row.bound, row.missed) for row in rows] == [("boxes", 0), ("affine", 0)]
    assert rows[0].face_pairs > 0 and len({row.face_pairs for row in rows}) == 1


def test_transferred_trees_are_the_bits_of_the_command(command, beam, fine, fine_file, tmp_path):
    write_random_poses(tmp_path / "many.h5", beam, 12, 24)
    moving = beam.with_modes(nbd.vibration_modes(beam, 8))
    trained = nbd.train(moving, tmp_path / "many.h5", ["nbd"], depth=3, clusters=32, epochs=2)
    nbd.save_tree(tmp_path / "trained.h5", trained)
    command("transfer", tmp_path / "trained.h5", fine_file, "-o", tmp_path / "command.h5")
    file = nbd.transfer_tree(trained, fine)
    nbd.save_tree(tmp_path / "python.h5", file)
    assert same_arrays(tmp_path / "command.h5", tmp_path / "python.h5")
    assert len(file.tree.faces) == 4 * len(beam.F) and "nbd" in file.tree.calibrations


def test_remapped_recordings_are_the_bits_of_the_command(command, beam, beam_file, fine, fine_file, poses, tmp_path):
    out, ours = tmp_path / "command.h5", tmp_path / "python.h5"
    command("remap", poses, "--from", beam_file, "--to", fine_file, "-o", out, "--trajectories", 3)
    assert nbd.remap(poses, ours, beam, fine, 3) == 3 * 8
    a, b = nbd.RecordingReader(out), nbd.RecordingReader(ours)
    assert len(a.trajectories) == len(b.trajectories) == 3
    for i in range(3):
        assert a.read(i).tobytes() == b.read(i).tobytes() and b.trajectories[i].body_hash == fine.hash
        assert "self_intersections" not in b.facts(i)
    assert a.label("remapped_from_sha256") == b.label("remapped_from_sha256") != ""


def test_a_training_without_networks_leaves_other_files_alone(beam, beam_file, poses, tmp_path):
    other = tmp_path / "mine.h5"
    other.write_bytes(beam_file.read_bytes())
    nbd.train(beam, poses, ["learned_affine"], depth=3, checkpoint=other)
    assert other.read_bytes() == beam_file.read_bytes()


def test_bad_arguments_are_refused(beam, fine, tree_file, poses, assets, tmp_path):
    ring = nbd.mesh_file(assets / "ring.obj")
    for call, kind, text in [
        (lambda: nbd.evaluate(tree_file, poses, ["exact", "affine"]), ValueError, "affine bounds are not those"),
        (lambda: nbd.evaluate(tree_file, poses, ["nbd", "bd"]), ValueError, "the tree has no nbd, bd bounds"),
        (lambda: nbd.evaluate(tree_file, poses, []), ValueError, "bounds"),
        (lambda: nbd.evaluate(tree_file, poses, max_frames=-1), ValueError, "max_frames is -1; allowed: 0 or more"),
        (lambda: nbd.measure_coverage(tree_file, poses, ["nbd"]), ValueError, "nbd bounds of the tree are not calibrated"),
        (lambda: nbd.measure_coverage(tree_file, poses, ["exact"]), ValueError, "exact bounds never miss"),
        (lambda: nbd.measure_coverage(tree_file, poses, []), ValueError, "bounds: is empty"),
        (lambda: nbd.check_contact_scenes(tree_file, poses, ["nbd"]), ValueError, "the tree has no nbd bounds"),
        (lambda: nbd.check_contact_scenes(tree_file, poses, scenes=0), ValueError, "0 contact scenes"),
        (lambda: nbd.remap(poses, tmp_path / "r.h5", beam, ring), RuntimeError, "its tetrahedra are not those of beam"),
        (lambda: nbd.remap(poses, tmp_path / "r.h5", fine, beam), RuntimeError, "was not recorded from fine"),
        (lambda: nbd.remap(poses, poses, beam, fine), RuntimeError, "the command also reads this file"),
        (lambda: nbd.remap(poses, tmp_path / "r.h5", beam, fine, -1), ValueError, "trajectories: is -1"),
    ]:
        with refused(kind, text):
            call()
    assert list(tmp_path.iterdir()) == []
