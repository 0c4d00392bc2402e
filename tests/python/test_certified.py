"""Bounds that hold in every pose."""

import numpy as np
import pytest
from conftest import falling_beams, one_line

import nbdtree as nbd


@pytest.fixture(scope="module")
def certified(beam):
    return nbd.make_exact_tree(beam.surface_X, beam.F, depth=5).with_certified(beam.tets, beam.W)


def bent(beam):
    """A pose far from rest: twisted along x and stretched."""
    x = beam.X * [1.3, 0.8, 1]
    angle = 2 * x[:, 0]
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([x[:, 0], c * x[:, 1] - s * x[:, 2], s * x[:, 1] + c * x[:, 2]], axis=1)


def gradients(beam, x):
    """Deformation gradients of all tetrahedra, [T, 3, 3]."""
    edges = [(y[beam.T[:, 1:]] - y[beam.T[:, :1]]).transpose(0, 2, 1) for y in (x, beam.X)]
    return edges[0] @ np.linalg.inv(edges[1])


def outside(tree, surface):
    """How far the whole surface reaches out of the root's sphere, metres."""
    c, r = tree.sphere(0)
    return np.linalg.norm(surface - c, axis=1).max() - r


def test_regions_bound_the_gradients_of_their_tetrahedra(beam, certified):
    x = bent(beam)
    motion = nbd.SolidMeter(beam.tets, certified).measure(x)
    F, regions = gradients(beam, x.astype(np.float32)), certified.tet_regions
    assert len(motion) == certified.region_count > 10 and set(regions) == set(range(len(motion)))
    apart = np.linalg.norm(F - motion.G[regions], 2, axis=(1, 2))
    assert np.all(apart <= motion.deviation[regions] * (1 + 1e-4) + 1e-5)
    assert np.all(np.linalg.norm(F, 2, axis=(1, 2)) <= motion.stretch[regions] * (1 + 1e-4))
    assert motion.deviation.max() > 0.01


def test_spheres_hold_the_surface_and_are_not_the_exact_ones(beam, certified):
    x = bent(beam)
    surface = beam.surface_positions(x).astype(np.float32)
    measured = nbd.SolidMeter(beam.tets, certified).measure(x)
    norms = np.linalg.norm(gradients(beam, x), 2, axis=(1, 2))
    stretch = [1.001 * norms[certified.tet_regions == region].max() for region in range(len(measured))]
    exact, tree = nbd.PosedTree(certified, "exact"), nbd.PosedTree(certified, "certified")
    exact.begin_pose(surface)
    radii = {}
    for name, motion in [("measured", measured), ("stretch", nbd.RegionMotions(stretch, stretch)), ("none", None)]:
        tree.begin_pose(surface, motion=motion)
        assert outside(tree, surface) <= 0
        radii[name] = tree.sphere(0)[1]
    assert radii["none"] == exact.sphere(0)[1] < radii["measured"] < radii["stretch"]


def test_certified_trees_miss_nothing(beam, certified):
    meter, query = nbd.SolidMeter(beam.tets, certified), nbd.PairQuery()
    poses = [bent(beam), beam.X + [0.05, 0.02, 0.01]]
    surfaces = [beam.surface_positions(x).astype(np.float32) for x in poses]
    found = {}
    for bounds in ("certified", "boxes"):
        trees = [nbd.PosedTree(certified, bounds) for _ in range(2)]
        for tree, surface, x in zip(trees, surfaces, poses):
            tree.begin_pose(surface, motion=meter.measure(x) if bounds == "certified" else None)
        found[bounds] = query.intersecting(*trees)
    assert len(found["boxes"]) > 10 and np.array_equal(found["certified"], found["boxes"])


def test_worlds_know_the_motions_of_their_regions(beam, certified):
    scene = falling_beams(beam, 0.1)
    for body in scene["bodies"]:
        body |= {"tree": certified, "bounds": "certified"}
    world = nbd.World(scene)
    for _ in range(20):
        assert world.step().failure == ""
    motion, meter = world.motion(1), nbd.SolidMeter(beam.tets, certified)
    own = meter.measure(world.positions(1))
    assert np.allclose(motion.stretch, own.stretch, rtol=1e-3) and np.allclose(motion.G, own.G, atol=1e-3)
    tree = nbd.PosedTree(certified, "certified")
    world.begin_pose(1, tree)
    surface = world.surface_positions(1)
    assert outside(tree, surface) <= 1e-6
    other = certified.with_certified(beam.tets, beam.W, splits=0)
    with pytest.raises(ValueError) as error:
        world.begin_pose(1, nbd.PosedTree(other, "certified"))
    assert one_line(error) == "PosedTree: its certified bounds have other regions than the world's"
    assert nbd.World({"bodies": [{"body": beam}]}).motion() is None


def test_nothing_known_is_infinite(beam, certified):
    surface = beam.surface_X.astype(np.float32)
    regions, tree = certified.region_count, nbd.PosedTree(certified, "certified")
    tree.begin_pose(surface, motion=nbd.RegionMotions(np.full(regions, np.inf), np.full(regions, np.inf)))
    assert tree.sphere(0)[1] >= np.linalg.norm(surface - surface.mean(axis=0), axis=1).max() / 2
    assert nbd.SolidMeter(beam.tets, certified).measure(beam.X * np.nan).stretch.min() == np.inf


def test_bad_arguments_are_refused(beam, certified):
    x = beam.surface_X.astype(np.float32)
    posed, plain = nbd.PosedTree(certified, "certified"), nbd.make_exact_tree(beam.surface_X, beam.F)
    ring = nbd.TetMesh(beam.X[:4] + [[0, 0, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0]], [[0, 1, 2, 3]])
    for call, text in [
        (lambda: nbd.RegionMotions([1, 2], [1]), "stretch: has 1 regions, but deviation has 2"),
        (lambda: nbd.RegionMotions([-1], [1]), "deviation: has -1; allowed: at least 0"),
        (lambda: nbd.RegionMotions([1], [np.nan]), "stretch: has nan"),
        (lambda: nbd.RegionMotions([1], [1], np.zeros((1, 9))), "G: has another shape; allowed: "),
        (lambda: nbd.RegionMotions([1], [1], np.zeros((2, 3, 3))), "G: has 2 rows; allowed: 1, one for each region"),
        (lambda: nbd.RegionMotions([1], [1], np.full((1, 3, 3), np.inf)), "G: has a number that is not finite"),
        (lambda: posed.begin_pose(x, motion=nbd.RegionMotions([1], [1])), "motion: has 1 regions; allowed: "),
        (lambda: nbd.PosedTree(plain).begin_pose(x, motion=nbd.RegionMotions([1], [1])), "motion: is for certified bounds"),
        (lambda: nbd.SolidMeter(beam.tets, plain), "tree: has no certified bounds"),
        (lambda: nbd.SolidMeter(ring, certified), ""),
        (lambda: nbd.SolidMeter(beam.tets, certified).measure(beam.X[1:]), "nodes: has 872 rows; allowed: 873"),
        (lambda: plain.with_certified(beam.tets, beam.W, anchors=0), "allowed: 1 to 4096 anchors"),
        (lambda: plain.with_certified(beam.tets, beam.W, splits=9), ""),
        (lambda: plain.with_certified(beam.tets, tuple(beam.W[:2]) + (beam.W[2][:-1],)), "W: "),
        (lambda: nbd.PosedTree(plain, "certified"), "certified"),
    ]:
        with pytest.raises(ValueError) as error:
            call()
        assert text in one_line(error)
    assert plain.region_count == 0 and plain.tet_regions is None
