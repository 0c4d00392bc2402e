"""What must raise, and never crash, hang or stay silent."""

import copy
import pickle
import sys
import threading

import numpy as np
import pytest
from conftest import falling_beams, one_line, output_of, refused

import nbdtree as nbd

CLASSES = sorted(
    (item for item in vars(nbd).values() if isinstance(item, type) and item.__module__ == "nbdtree._nbdtree"
     and not issubclass(item, BaseException)),
    key=lambda item: item.__name__)


def test_all_classes_are_known():
    assert len(CLASSES) >= 26


@pytest.mark.parametrize("made", CLASSES, ids=lambda item: item.__name__)
def test_an_object_made_by_new_alone_raises(made):
    empty = made.__new__(made)
    used = 0
    for name, item in vars(made).items():
        if name.startswith("_") and name not in ("__len__", "__repr__", "__str__", "__enter__", "__contains__"):
            continue  # of Python and of pybind11
        with pytest.raises(TypeError) as error:
            if isinstance(item, property):
                getattr(empty, name)
            else:
                for count in range(8):  # with the right number of arguments
                    try:
                        item.__get__(empty)(*[0] * count)
                    except TypeError as wrong:
                        if "__new__" in str(wrong):
                            raise
        assert one_line(error).startswith("an object was made by __new__() alone")
        used += 1
    assert used > 0


def test_empty_objects_are_refused_as_arguments(beam, poses, tmp_path):
    def empty(made):
        return made.__new__(made)

    for call in (
        lambda: nbd.tree_of_body(empty(nbd.Body)),
        lambda: nbd.save_body(tmp_path / "x", empty(nbd.Body)),
        lambda: nbd.World({"bodies": [{"body": empty(nbd.Body)}]}),
        lambda: nbd.World({"bodies": [{"body": beam, "tree": empty(nbd.CollisionTree)}]}),
        lambda: nbd.PosedTree(empty(nbd.CollisionTree)),
        lambda: nbd.ManyBodyQuery().intersecting([empty(nbd.PosedTree)]),
        lambda: nbd.FeatureQuery().candidates([empty(nbd.MovingBody)], 1.0),
        lambda: nbd.SelfQuery(empty(nbd.FacePairSet)),
        lambda: nbd.evaluate(empty(nbd.TreeFile), poses),
        lambda: beam.with_modes(empty(nbd.Modes)),
        lambda: beam.with_material(empty(nbd.Material)),
        lambda: nbd.Material() == empty(nbd.Material),
    ):
        with refused(TypeError, "__new__() alone"):
            call()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "call, text",
    [
        (lambda b: nbd.PairQuery().within(1, 2, "a"),
         "within(): was called with (1, 2, 'a'); allowed: within(a: PosedTree, b: PosedTree, distance: float)"),
        (lambda b: nbd.subdivide(nbd.TriMesh(b.surface_X, b.F), levels=2**40),
         "subdivide(): was called with (TriMesh, levels=1099511627776); allowed: subdivide(surface: TriMesh, "),
        (lambda b: nbd.PosedTree(), "PosedTree(): was called with (); allowed: PosedTree(tree: CollisionTree, "),
        (lambda b: nbd.Material("soft"), "Material(): was called with ('soft'); allowed: Material(young: float = "),
        (lambda b: nbd.World.step(b), "step(): was called with (); allowed: step(dt: Optional[float] = None)"),
        (lambda b: nbd.make_body("x" * 100, b), "make_body(): was called with (str, Body); allowed: make_body(name: str"),
        (lambda b: nbd.Body.hash.fget(3), "property: was called with (3); allowed: (arg0: Body)"),
        (lambda b: b.surface_positions(), "surface_positions(): was called with (); allowed: surface_positions(x: "),
    ],
)
def test_wrong_types_are_told_in_one_line(beam, call, text):
    with refused(TypeError, text):
        call(beam)


def test_objects_of_memory_are_not_copied_or_pickled(beam, tree_file):
    world = nbd.World({"bodies": [{"body": beam}]})
    for item in (beam, world, tree_file, tree_file.tree, nbd.PosedTree(tree_file.tree), nbd.PairQuery(),
                 nbd.MovingBody(beam.surface_X, beam.F)):
        for action in (copy.copy, copy.deepcopy, pickle.dumps):
            with refused(TypeError, "cannot pickle"):
                action(item)


def test_a_pose_of_a_world_ends_with_its_next_step(beam):
    world = nbd.World(falling_beams(beam))
    tree = nbd.tree_of_body(beam)
    a, b = nbd.PosedTree(tree), nbd.PosedTree(tree, "affine")
    queries = [
        lambda: nbd.PairQuery().within(a, b, 1.0), lambda: nbd.SelfQuery().intersecting(a),
        lambda: nbd.ClosestQuery().closest(b, a), lambda: nbd.ManyBodyQuery().within([a, b], 1.0),
        lambda: a.whole(), lambda: b.whole(),
    ]
    for move in (world.step, lambda: world.restore(world.snapshot()), world.resolve_start):
        world.begin_pose(0, a)
        world.begin_pose(1, b)
        for query in queries:
            query()
        move()
        for query in queries:
            with refused(RuntimeError, "PosedTree: its world has moved since the pose; call World.begin_pose() again", True):
                query()
    a.begin_pose(beam.surface_X.astype(np.float32))
    nbd.SelfQuery().intersecting(a)


def test_a_pose_of_a_world_is_not_used_beside_its_step(assets):
    body = nbd.mesh_file(assets / "beam.obj", nodes=3000)
    world = nbd.World({"bodies": [{"body": body}]})
    tree = nbd.PosedTree(nbd.tree_of_body(body), "exact")
    refused, steps = set(), []
    thread = threading.Thread(target=lambda: [steps.append(world.step(0.001)) for _ in range(20)])
    world.begin_pose(0, tree)
    thread.start()
    while thread.is_alive():
        try:
            tree.sphere(1)
        except RuntimeError as error:
            refused.add(str(error).split(";")[0])
    thread.join()
    assert len(steps) == 20
    assert "the World of a PosedTree: is in use by another thread" in refused


def test_a_tree_without_a_pose_says_so(tree_file):
    for bounds in tree_file.tree.bounds:
        tree = nbd.PosedTree(tree_file.tree, bounds)
        for call in (lambda: tree.sphere(0), tree.whole):
            with refused(RuntimeError, "PosedTree: has no pose yet; call begin_pose() first", whole=True):
                call()


def test_a_writer_that_is_closed_says_so(tmp_path):
    for end in ("finish", "abandon"):
        writer = nbd.RecordingWriter(tmp_path / end)
        handle = writer.begin_trajectory(3, 0)
        writer.add_frame(handle, 0, np.zeros((3, 3)))
        getattr(writer, end)()
        for call in (writer.finish, writer.abandon, lambda: writer.label("a", "b"), lambda: writer.begin_trajectory(3, 1),
                     lambda: writer.add_frame(handle, 1, np.zeros((3, 3))), lambda: writer.end_trajectory(handle)):
            with pytest.raises((RuntimeError, ValueError)) as error:
                call()
            one_line(error)
    assert [path.name for path in tmp_path.iterdir()] == ["finish"]


def test_a_writer_that_is_forgotten_leaves_nothing(tmp_path):
    writer = nbd.RecordingWriter(tmp_path / "x.h5")
    writer.add_frame(writer.begin_trajectory(3, 0), 0, np.zeros((3, 3)))
    del writer
    assert list(tmp_path.iterdir()) == []


def test_an_exit_in_a_progress_function_ends_the_call(beam, poses):
    def leave(what, done, total):
        sys.exit(7)

    with pytest.raises(SystemExit) as error:
        nbd.train(beam, poses, ["learned_affine"], depth=3, progress=leave)
    assert error.value.code == 7


def test_a_progress_function_may_compute(beam, tmp_path):
    world, modes = nbd.World({"bodies": [{"body": beam}]}), []

    def work(what, done, total):
        world.step(0.01)
        modes.append(nbd.vibration_modes(beam, 1).frequencies[0])

    nbd.make_dataset(beam, tmp_path / "d.h5", trajectories=3, frames=2, progress=work)
    assert len(modes) >= 3 and len(set(modes)) == 1 and world.time == pytest.approx(0.01 * len(modes))


def test_another_interpreter_is_refused():
    pytest.importorskip("_xxsubinterpreters")
    print_of = output_of("""
        import sys, nbdtree, _xxsubinterpreters as interpreters
        other = interpreters.create()
        try:
            interpreters.run_string(other, f"import sys; sys.path[:] = {sys.path}; import nbdtree")
        except interpreters.RunFailedError as error:
            print(error)
        print(nbdtree.thread_count() > 0)
    """)
    assert "nbdtree: works in the main interpreter only" in print_of and print_of.endswith("True\n")


def test_a_forked_process_works(beam_file, poses):
    assert output_of("""
        import os, sys, nbdtree as nbd
        body = nbd.load_body(sys.argv[1])
        nbd.vibration_modes(body, 4)
        child = os.fork()
        world = nbd.World({"bodies": [{"body": body}]})
        world.step(0.01)
        nbd.vibration_modes(body, 4)
        frames = nbd.RecordingReader(sys.argv[2]).read(0)
        if child == 0:
            os._exit(0 if world.time == 0.01 and frames.size > 0 else 1)
        print(os.waitpid(child, 0)[1])
    """, beam_file, poses) == "0\n"


def test_a_process_forked_beside_a_call_ends(beam_file):
    assert output_of("""
        import os, sys, threading, nbdtree as nbd
        from in_a_call import wait_for_a_call
        body = nbd.load_body(sys.argv[1])
        call = threading.Thread(target=lambda: nbd.vibration_modes(body, 200))
        call.start()
        wait_for_a_call()
        child = os.fork()
        if child == 0:
            sys.exit(0)
        print(os.waitpid(child, 0)[1])
        call.join()
    """, beam_file).endswith("0\n")


def test_a_process_forked_beside_a_call_that_holds_files_is_told_so(beam_file, poses, tmp_path):
    assert output_of("""
        import os, sys, threading, nbdtree as nbd
        body, path = nbd.load_body(sys.argv[1]), sys.argv[2]
        holds, forked = threading.Event(), threading.Event()
        def told(what, done, total):
            holds.set()
            forked.wait()
        call = threading.Thread(target=lambda: nbd.make_dataset(body, path, trajectories=2, frames=4, progress=told))
        call.start()
        holds.wait()
        child = os.fork()
        if child == 0:
            try:
                nbd.load_body(sys.argv[1])
            except RuntimeError as error:
                os._exit(7 if "when this process was forked" in str(error) else 8)
            os._exit(9)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
        forked.set()
        call.join()
    """, beam_file, tmp_path / "made.h5") == "7\n"


def test_the_end_of_the_interpreter_finds_everything_alive(beam_file):
    assert output_of("""
        import atexit, builtins, sys, nbdtree as nbd
        body = nbd.load_body(sys.argv[1])
        world, tree = nbd.World({"bodies": [{"body": body}]}), nbd.PosedTree(nbd.tree_of_body(body))
        world.begin_pose(0, tree)
        builtins.kept = (world, tree, world.positions())
        atexit.register(lambda: print(tree.whole()[0].shape))
    """, beam_file) == "(3,)\n"
