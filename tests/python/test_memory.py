"""What is referred to and what is copied: each row of the table of apps/docs/python.md."""

import ctypes
import gc
import pathlib
import re
import sys
import weakref

import numpy as np
import pytest

import nbdtree as nbd

PAGE = pathlib.Path(__file__).resolve().parents[2] / "apps" / "docs" / "python.md"


def address(array):
    return array.__array_interface__["data"][0]


def is_kept_by(owner, array):
    """Whether the memory of an array is that of an object which the array keeps alive, and nothing is copied."""
    return not array.flags.owndata and array.base is owner


class AllocatorInfo(ctypes.Structure):
    """struct mallinfo2 of glibc 2.33."""

    _fields_ = [(name, ctypes.c_size_t) for name in
                ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks", "fordblks", "keepcost")]


def allocated_bytes():
    """What the process has allocated and not freed, of C and C++. Skips the test where glibc cannot tell."""
    ask = getattr(ctypes.CDLL(None), "mallinfo2", None)
    if ask is None:
        pytest.skip("no mallinfo2 in the C library")
    ask.restype = AllocatorInfo
    info = ask()
    return info.uordblks + info.hblkhd


def outlives(make, views):
    """Whether views keep their bits when the name of their owner and much other memory comes and goes."""
    owner = make()
    arrays = [view(owner) for view in views]
    bits = [array.tobytes() for array in arrays]
    del owner
    gc.collect()
    junk = [np.full(max(array.size, 1), -1.0) for array in arrays for _ in range(20)]
    return [array.tobytes() for array in arrays] == bits and len(junk) > 0


def test_the_table_has_no_row_that_is_not_tested():
    table = PAGE.read_text().split("## What is referred to")[1].split("##")[0]
    rows = re.findall(r"^\| (?!---|call)(.*?) \|", table, re.M)
    tested = {name for name in globals() if name.startswith("test_row_")}
    assert len(rows) == len(tested) == 8


def test_row_1_state_of_a_world(beam):
    world = nbd.World({"bodies": [{"body": beam, "transform": {"translate": [0, 0, 0.1]}}], "obstacles": [{"plane": {}}]})
    calls = [world.positions, world.velocities, world.forces, world.contact_forces, world.masses]
    views = [call() for call in calls]
    for call, view in zip(calls, views):
        assert is_kept_by(world, view) and address(call()) == address(view)
        assert view.flags.writeable == (call == world.forces)
    assert len({address(view) for view in views}) == len(views)
    before = views[0].copy()
    world.step(0.01)
    world.restore(world.snapshot())
    assert [address(call()) for call in calls] == [address(view) for view in views]
    assert not np.array_equal(views[0], before)
    assert outlives(lambda: nbd.World({"bodies": [{"body": beam}]}),
                    [nbd.World.positions, nbd.World.velocities, nbd.World.forces, nbd.World.contact_forces,
                     nbd.World.masses])


def test_row_2_arrays_of_objects(beam, tree_file, assets):
    surface = nbd.read_surface(assets / "beam.obj")
    tets = nbd.TetMesh(beam.X, beam.T)
    modes = nbd.vibration_modes(beam, 3)
    moving = beam.with_modes(modes)
    tree = tree_file.tree
    body = nbd.MovingBody(surface.X, surface.F)
    for owner, names in [(surface, "X F"), (body, "F edges"), (tets, "X T"), (beam, "X T surface_X F"), (modes, "U frequencies"),
                         (tree_file, "X"), (tree, "faces")]:
        for name in names.split():
            view = getattr(owner, name)
            assert is_kept_by(owner, view), name
            assert address(view) == address(getattr(owner, name)) and not view.flags.writeable, name
    for owner, name in [(beam, "W"), (tree_file, "W"), (moving, "modes")]:
        for one, other in zip(getattr(owner, name), getattr(owner, name)):
            assert is_kept_by(owner, one) and address(one) == address(other) and not one.flags.writeable
    assert address(beam.tets.X) == address(beam.X) and address(beam.surface.F) == address(beam.F)
    get = [lambda body: body.X, lambda body: body.F, lambda body: body.surface_X, lambda body: body.W[0],
           lambda body: body.tets.T, lambda body: body.surface.X]
    assert outlives(lambda: nbd.mesh_file(assets / "beam.obj"), get)
    assert outlives(lambda: nbd.make_exact_tree(surface.X, surface.F), [lambda tree: tree.faces])


def posed(tree, bounds="boxes"):
    return nbd.PosedTree(tree, bounds)


def test_row_3_poses_refer_to_arrays(beam, tree_file):
    x, nodes = beam.surface_X.astype(np.float32), beam.X.astype(np.float32)
    affine = nbd.tree_of_body(beam)

    def kept(tree, pose, *arguments):
        copies = [a.copy() if isinstance(a, np.ndarray) else a for a in arguments]
        counts = [sys.getrefcount(copy) for copy in copies]
        pose(tree, *copies)
        assert [sys.getrefcount(copy) for copy in copies] == [count + 1 for count in counts]
        alive = [weakref.ref(copy) for copy in copies if isinstance(copy, np.ndarray)]
        del copies
        gc.collect()
        assert all(reference() is not None for reference in alive)
        whole = tree.whole()
        tree.begin_pose(x)  # ends the pose before
        gc.collect()
        assert all(reference() is None for reference in alive)
        return whole

    by_surface = kept(posed(affine), nbd.PosedTree.begin_pose, x)
    by_nodes = kept(posed(affine, "affine"), nbd.PosedTree.begin_pose_of_nodes, nodes)
    assert np.allclose(by_surface[0], by_nodes[0], atol=1e-3)
    kept(posed(affine), nbd.PosedTree.begin_step, x, x + np.float32(0.1))
    # Leaves are made from the caller's memory when a query first needs them, so they show what was changed before.
    mine, still, tree, other = x.copy(), posed(affine), posed(affine), posed(affine)
    still.begin_pose(x)
    tree.begin_pose(mine)
    far = x + np.float32([10, 0, 0])
    other.begin_pose(far)
    mine[:, 0] += np.float32(0.01)
    apart, nearer = (nbd.ClosestQuery().closest(a, other)["distance"] for a in (still, tree))
    assert nearer == pytest.approx(apart - 0.01, rel=1e-4)


def test_row_4_a_pose_of_a_world_refers_to_it(beam):
    world = nbd.World({"bodies": [{"body": beam}]})
    count, tree = sys.getrefcount(world), posed(nbd.tree_of_body(beam), "affine")
    world.begin_pose(0, tree)
    assert sys.getrefcount(world) == count + 1
    whole = tree.whole()
    alive = weakref.ref(world)
    del world
    gc.collect()
    assert alive() is not None
    junk = [np.full((1000, 3), np.nan) for _ in range(100)]
    assert np.array_equal(tree.whole(), whole) and len(junk) == 100
    tree.begin_pose_of_nodes(beam.X.astype(np.float32))
    gc.collect()
    assert alive() is None


def test_row_5_trees_are_shared(beam, tree_file):
    faces = address(tree_file.tree.faces)
    assert address(tree_file.tree.faces) == faces
    body = nbd.make_body("fine", beam.tets, beam.surface, levels=2)
    before = allocated_bytes()
    tree = nbd.tree_of_body(body)
    of_tree = allocated_bytes() - before
    trees = [posed(tree, "affine") for _ in range(10)]
    assert of_tree > tree.faces.nbytes and allocated_bytes() - before < 2 * of_tree
    del tree
    gc.collect()
    assert allocated_bytes() - before > of_tree  # kept alive
    trees[0].begin_pose_of_nodes(body.X.astype(np.float32))
    assert len(nbd.SelfQuery().intersecting(trees[0])) == 0
    trees.clear()
    gc.collect()
    assert allocated_bytes() - before < of_tree / 2


def test_row_6_answers_are_new_arrays(beam, tree_file, poses):
    world = nbd.World({"bodies": [{"body": beam}, {"body": beam, "transform": {"translate": [0, 0, 1]}}]})
    tree, x = tree_file.tree, beam.surface_X.astype(np.float32)
    a, b, query, reader = posed(tree), posed(tree), nbd.PairQuery(), nbd.RecordingReader(poses)
    a.begin_pose(x)
    b.begin_pose(x + np.float32([0.01, 0, 0]))
    body, spheres = nbd.MovingBody(x, beam.F), posed(tree, "exact")
    spheres.begin_pose(x)
    calls = {
        "MovingBody.at": lambda: body.at(0.5),
        "FeatureQuery.candidates": lambda: nbd.FeatureQuery().candidates([body], 0.1)["edge_edge"],
        "PairQuery.intersecting": lambda: query.intersecting(a, b),
        "PairQuery.within": lambda: query.within(a, b, 0.1),
        "PairQuery.boxes_within": lambda: query.boxes_within(a, b, 0.1),
        "SelfQuery.within": lambda: nbd.SelfQuery().within(a, 0.1),
        "ClosestQuery.closest": lambda: nbd.ClosestQuery().closest(a, b)["a"],
        "ManyBodyQuery.within": lambda: nbd.ManyBodyQuery().within([a, b], 0.1)[0][2],
        "intersecting_faces": lambda: nbd.intersecting_faces(x, beam.F, x + np.float32(0.01), beam.F),
        "RecordingReader.read": lambda: reader.read(0), "RecordingReader.times": lambda: reader.times(0),
        "RecordingReader.facts": lambda: reader.facts(0)["contacts"],
        "World.surface_positions": world.surface_positions,
        "Body.surface_positions": lambda: beam.surface_positions(beam.X),
        "TreeFile.surface_positions": lambda: tree_file.surface_positions(beam.X),
        "CollisionTree.rest_spheres": lambda: tree.rest_spheres, "CollisionTree.node_depths": lambda: tree.node_depths,
        "PosedTree.sphere": lambda: spheres.sphere(0)[0],
        "PosedTree.whole": lambda: a.whole()[1],
        "calibrations": lambda: tree.calibrations["learned_affine"]["margins"],
    }
    for name, call in calls.items():
        one, other = call(), call()
        assert one.size > 0 and address(one) != address(other) and not np.shares_memory(one, other), name
        assert np.array_equal(one, other), name
        assert one.flags.writeable, name


def test_row_7_reports_and_rows_are_values(beam):
    world = nbd.World({"bodies": [{"body": beam}]})
    one = world.step(0.01)
    time = one.time
    world.step(0.01)
    snapshot = world.snapshot()
    del world
    gc.collect()
    assert one.time == time == 0.01 and snapshot.time == 0.02


def test_row_8_other_arguments_are_copied(beam, tree_file, tmp_path):
    world = nbd.World({"bodies": [{"body": beam}]})
    X, F, T, nodes = beam.surface_X.copy(), beam.F.copy(), beam.T.copy(), beam.X.copy()
    W = tuple(part.copy() for part in beam.W)
    targets, driven = nodes[:1].copy(), np.zeros(1, np.int32)
    writer = nbd.RecordingWriter(tmp_path / "w.h5")
    handle = writer.begin_trajectory(len(nodes), 0)
    tree, floats = nbd.make_exact_tree(X, F), nodes.astype(np.float32)
    calls = {
        "TriMesh": (lambda: nbd.TriMesh(X, F), X, F), "TetMesh": (lambda: nbd.TetMesh(nodes, T), nodes, T),
        "make_exact_tree": (lambda: nbd.make_exact_tree(X, F), X, F),
        "on_nodes": (lambda: tree.on_nodes(W, nodes), *W, nodes),
        "near_at_rest": (lambda: nbd.near_at_rest(X, F, 0.01), X, F),
        "drive": (lambda: world.drive(driven, targets), driven, targets),
        "add_frame": (lambda: writer.add_frame(handle, 0, floats), floats),
        "surface_positions": (lambda: beam.surface_positions(nodes), nodes),
        "intersecting_faces": (lambda: nbd.intersecting_faces(X, F, X, F), X, F),
    }
    for name, (call, *arguments) in calls.items():
        counts = [sys.getrefcount(argument) for argument in arguments]
        result = call()
        assert [sys.getrefcount(argument) for argument in arguments] == counts, name
        for attribute in ("X", "F", "T", "faces"):
            if hasattr(result, attribute):
                array = getattr(result, attribute)
                assert not any(np.shares_memory(array, argument) for argument in arguments), name
    mesh = nbd.TriMesh(X, F)
    X[:] = 0
    assert np.array_equal(mesh.X, beam.surface_X)
    writer.abandon()
