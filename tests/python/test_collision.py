import numpy as np
import pytest
from conftest import folded, in_threads, pairs_of, refused

import nbdtree as nbd


def turned(x, angle, shift):
    c, s = np.cos(angle), np.sin(angle)
    return np.ascontiguousarray(x @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + shift, np.float32)


@pytest.fixture(scope="module")
def two_gears(assets):
    """Two gears in contact: positions of both, their faces, and the pairs that intersect."""
    gear = nbd.read_surface(assets / "gear.obj")
    size = np.ptp(gear.X[:, 0])
    xa, xb = turned(gear.X, 0, [0, 0, 0]), turned(gear.X, 0.3, [0.85 * size, 0.01 * size, 0.02 * size])
    pairs = nbd.intersecting_faces(xa, gear.F, xb, gear.F)
    assert len(pairs) > 20
    return gear, xa, xb, pairs_of(pairs)


@pytest.mark.parametrize("bounds", ["exact", "boxes", "auto"])
def test_trees_find_the_same_pairs_in_every_pose(two_gears, bounds):
    gear, xa, xb, pairs = two_gears
    tree = nbd.make_exact_tree(gear.X, gear.F)
    a, b = nbd.PosedTree(tree, bounds), nbd.PosedTree(tree, bounds)
    query = nbd.PairQuery()
    for _ in range(3):
        a.begin_pose(xa)
        b.begin_pose(xb)
        found = query.intersecting(a, b)
        assert found.dtype == np.int32 and pairs_of(found) == pairs
        assert query.counters["face_pairs"] == len(pairs)
        near = pairs_of(query.within(a, b, 0.01))
        assert near > pairs
        assert near <= pairs_of(query.boxes_within(a, b, 0.01))
        b.begin_pose(xb + np.float32([0, 0, 10]))
        assert len(query.intersecting(a, b)) == 0


def test_affine_bounds_are_posed_by_nodes(beam):
    tree = nbd.tree_of_body(beam)
    assert "affine" in tree.bounds
    a, b, exact = nbd.PosedTree(tree, "affine"), nbd.PosedTree(tree, "affine"), nbd.PosedTree(tree, "boxes")
    nodes = beam.X.astype(np.float32)
    other = turned(beam.X, 0.8, [0.05, 0.02, 0.01])
    a.begin_pose_of_nodes(nodes)
    b.begin_pose_of_nodes(other)
    pairs = nbd.PairQuery().intersecting(a, b)
    assert len(pairs) > 10
    surfaces = [beam.surface_positions(x).astype(np.float32) for x in (nodes, other)]
    expected = nbd.intersecting_faces(surfaces[0], beam.F, surfaces[1], beam.F)
    assert np.array_equal(pairs, expected)
    assert exact.bounds == "boxes" and a.chosen == "affine"


def test_closest_points_lie_on_their_faces(two_gears):
    gear, xa, xb, _ = two_gears
    tree = nbd.make_exact_tree(gear.X, gear.F)
    a, b = nbd.PosedTree(tree), nbd.PosedTree(tree)
    a.begin_pose(xa)
    moved = xb + np.float32([0, 0, 10])
    b.begin_pose(moved)
    found = nbd.ClosestQuery().closest(a, b)
    assert found["distance"] == pytest.approx(np.linalg.norm(found["a"] - found["b"]), rel=1e-6)
    vertices = np.linalg.norm(xa[:, None] - moved[None], axis=2)
    assert 9 < found["distance"] <= vertices.min() + 1e-6
    assert nbd.ClosestQuery().closest(a, b, 1.0) is None
    assert nbd.closest_points(xa, gear.F, moved, gear.F)["distance"] == pytest.approx(found["distance"])


def test_many_bodies_touch_where_pairs_do(two_gears):
    gear, xa, xb, pairs = two_gears
    tree = nbd.make_exact_tree(gear.X, gear.F)
    bodies = [nbd.PosedTree(tree) for _ in range(3)]
    for body, x in zip(bodies, (xa, xb, xa + np.float32([100, 0, 0]))):
        body.begin_pose(x)
    [(a, b, found)] = nbd.ManyBodyQuery().intersecting(bodies)
    assert (a, b) == (0, 1) and pairs_of(found) == pairs
    with refused(ValueError, "bodies: one PosedTree is there twice", whole=True):
        nbd.ManyBodyQuery().intersecting([bodies[0], bodies[0]])


def test_a_folded_surface_meets_itself(beam):
    x = beam.surface_X.astype(np.float32)
    tree = nbd.make_exact_tree(x, beam.F)
    posed = nbd.PosedTree(tree)
    posed.begin_pose(x)
    assert len(nbd.SelfQuery().intersecting(posed)) == 0
    posed.begin_pose(folded(x))
    found = nbd.SelfQuery().intersecting(posed)
    assert len(found) > 0 and np.all(found[:, 0] < found[:, 1])
    near = nbd.near_at_rest(x, beam.F, 0.02)
    left = pairs_of(nbd.SelfQuery(near).within(posed, 0.02))
    every = pairs_of(nbd.SelfQuery().within(posed, 0.02))
    assert len(near) > 0 and left == {pair for pair in every if pair not in near}
    with refused(ValueError, "leaves out pairs of a surface of"):
        nbd.SelfQuery(nbd.near_at_rest(x, beam.F[:-1], 0.02)).within(posed, 0.02)


@pytest.mark.parametrize(
    "x, text",
    [
        (lambda x: x.astype(float), "x: is float64 of shape"),
        (lambda x: np.asfortranarray(x), "strided; allowed: float32"),
        (lambda x: x[:-1], "x: is float32 of shape"),
        (lambda x: x.tolist(), "a numpy array, which is referred to"),
        (lambda x: np.where(np.arange(len(x))[:, None] == 5, np.float32(np.nan), x), "not finite"),
    ],
)
def test_arrays_that_would_need_a_copy_are_refused(two_gears, x, text):
    gear, xa, _, _ = two_gears
    posed = nbd.PosedTree(nbd.make_exact_tree(gear.X, gear.F))
    with refused(ValueError, text):
        posed.begin_pose(x(xa))


def test_none_is_no_tree(two_gears):
    for call in (lambda: nbd.PosedTree(None), lambda: nbd.tree_of_body(None), lambda: nbd.load_flat_tree(None)):
        with pytest.raises(TypeError):
            call()


def test_bad_arguments_are_refused(two_gears):
    gear, xa, _, _ = two_gears
    tree = nbd.make_exact_tree(gear.X, gear.F)
    a, b = nbd.PosedTree(tree), nbd.PosedTree(tree)
    for call, kind, text in [
        (lambda: nbd.PosedTree(tree, "nbd"), ValueError, "nbd"),
        (lambda: nbd.PosedTree(tree, "round"), ValueError, "round"),
        (lambda: nbd.PosedTree(tree, "boxes", -1), ValueError, "margin"),
        (lambda: nbd.PairQuery().within(a, b, float("nan")), ValueError, "distance: is nan"),
        (lambda: nbd.PairQuery().within(a, b, -1), ValueError, "distance: is -1"),
        (lambda: nbd.PairQuery().intersecting(a, a), ValueError, "a and b are one PosedTree"),
        (lambda: a.sphere(tree.node_count), IndexError, "node: is"),
        (lambda: a.begin_pose_of_nodes(xa), ValueError, "need affine or auto bounds"),
        (lambda: nbd.ManyBodyQuery().intersecting([a, None]), ValueError, "bodies[1]: is None"),
        (lambda: tree.on_nodes(3, xa), ValueError, "W: is"),
        (lambda: nbd.make_exact_tree(gear.X, gear.F, depth=99), ValueError, "depth"),
    ]:
        with refused(kind, text):
            call()


def test_trees_are_written_and_read(two_gears, tmp_path):
    gear, xa, xb, pairs = two_gears
    nbd.save_flat_tree(tmp_path / "gear.nbd", nbd.make_exact_tree(gear.X, gear.F))
    tree = nbd.load_flat_tree(tmp_path / "gear.nbd")
    assert np.array_equal(tree.faces, gear.F)
    a, b = nbd.PosedTree(tree), nbd.PosedTree(tree)
    a.begin_pose(xa)
    b.begin_pose(xb)
    assert pairs_of(nbd.PairQuery().intersecting(a, b)) == pairs
    assert tree.rest_spheres.shape == (tree.node_count, 4) and tree.node_depths.max() == tree.depth


def test_threads_with_queries_of_their_own_agree(two_gears):
    gear, xa, xb, pairs = two_gears
    tree = nbd.make_exact_tree(gear.X, gear.F)
    wrong = []

    def run():
        a, b, query = nbd.PosedTree(tree), nbd.PosedTree(tree), nbd.PairQuery()
        for _ in range(50):
            a.begin_pose(xa)
            b.begin_pose(xb)
            if pairs_of(query.intersecting(a, b)) != pairs:
                wrong.append(1)

    in_threads(*[run] * 4)
    assert wrong == []
