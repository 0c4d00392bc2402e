"""Features that may meet in a step, and how much of a step is free."""

import numpy as np
import pytest
from conftest import in_threads, refused

import nbdtree as nbd


@pytest.fixture(scope="module")
def two(assets):
    """A beam that moves sideways through a part of another, which stands still."""
    beam = nbd.read_surface(assets / "beam.obj")
    size = np.ptp(beam.X, axis=0).max()
    body, obstacle = nbd.MovingBody(beam.X, beam.F), nbd.MovingBody(beam.X, beam.F, role="obstacle")
    begin, end = beam.X + [1.1 * size, 0.017 * size, 0], beam.X + [0.7 * size, 0.031 * size, 0.013 * size]
    body.move(begin, end)
    return beam, size, [body, obstacle], begin, end


def box(begin, end, rows):
    """Boxes of features over the step: rows of vertices [n, k]."""
    at = np.concatenate([begin[rows], end[rows]], axis=1)
    return at.min(axis=1), at.max(axis=1)


def near(a, b, distance):
    """Pairs of two lists of boxes that come within a distance, by brute force."""
    squared = 0
    for axis in range(3):
        (low_a, high_a), (low_b, high_b) = ([end[:, axis] for end in boxes] for boxes in (a, b))
        squared = squared + np.maximum(np.maximum(low_a[:, None] - high_b, low_b - high_a[:, None]), 0) ** 2
    return {tuple(pair) for pair in np.argwhere(squared <= distance**2).tolist()}


def test_candidates_are_those_of_brute_force(two):
    beam, size, bodies, begin, end = two
    distance = 0.0201 * size
    found = nbd.FeatureQuery().candidates(bodies, distance)
    assert set(found) == {"vertex_face", "edge_edge"}
    vertices, edges = np.arange(len(beam.X))[:, None], bodies[0].edges
    assert edges.dtype == np.int32 and len({tuple(sorted(e)) for e in edges.tolist()}) == len(edges)
    assert np.array_equal(bodies[0].F, beam.F)

    def moves(rows):
        return box(begin, end, rows)

    def stays(rows):
        return box(beam.X, beam.X, rows)

    expected = {
        ("vertex_face", 0, 1): near(moves(vertices), stays(beam.F), distance),
        ("vertex_face", 1, 0): near(stays(vertices), moves(beam.F), distance),
        ("edge_edge", 0, 1): near(moves(edges), stays(edges), distance),
    }
    for (kind, a, b), pairs in expected.items():
        rows = found[kind]
        assert rows.dtype == np.int32 and rows.shape[1] == 4
        of_bodies = [tuple(row) for row in rows[(rows[:, 0] == a) & (rows[:, 1] == b), 2:].tolist()]
        assert of_bodies == sorted(pairs) and len(pairs) > 50, kind
    own = found["vertex_face"][found["vertex_face"][:, 1] == found["vertex_face"][:, 0]]
    assert np.all(own[:, 0] == 0)  # the obstacle does not meet itself
    assert not any(v in beam.F[f] for _, _, v, f in own.tolist())


def test_the_free_share_ends_before_faces_meet(two):
    beam, size, bodies, begin, end = two
    assert len(nbd.intersecting_faces(end, beam.F, beam.X, beam.F)) > 0
    query, separation = nbd.FeatureQuery(), 1e-3 * size
    step = query.collision_free_step(bodies, separation)
    assert 0 < step["share"] < 1 and not step["exhausted"]
    kind, a, b, _, _ = step["limit"]
    assert kind in ("vertex_face", "edge_edge") and {a, b} == {0, 1} and step["gap"] > separation
    stopped = bodies[0].at(step["share"])
    assert np.allclose(stopped, begin + step["share"] * (end - begin), rtol=0, atol=1e-12 * size)
    assert separation < nbd.closest_points(stopped, beam.F, beam.X, beam.F)["distance"] < 0.2 * step["gap"]
    assert query.collision_free_step(bodies, separation, left=0.5)["share"] < step["share"]
    other = nbd.MovingBody(beam.X, beam.F)
    other.move(begin, begin + [size, 0, 0])
    free = query.collision_free_step([other, bodies[1]], separation)
    assert free == {"share": 1.0, "limit": None, "gap": 0.0, "exhausted": False}
    other.pose(begin)
    assert np.array_equal(other.at(0.5), begin) and np.array_equal(other.at(1), begin)


@pytest.mark.parametrize(
    "call, text",
    [
        (lambda x, f, b, q: nbd.MovingBody(x, f, "wall"), 'role: is "wall"; allowed: body, obstacle'),
        (lambda x, f, b, q: nbd.MovingBody(x[:3], f), "vertex"),
        (lambda x, f, b, q: nbd.MovingBody(x * np.nan, f), "finite"),
        (lambda x, f, b, q: b.move(x, x[:-1]), "end has"),
        (lambda x, f, b, q: b.at(1.5), "share: is 1.5; allowed: 0 to 1"),
        (lambda x, f, b, q: q.candidates([b], -1), "distance is -1, allowed: finite, 0 or more"),
        (lambda x, f, b, q: q.collision_free_step([b], 0, left=1), "left is 1"),
        (lambda x, f, b, q: q.candidates([b, b], 0), "bodies: one MovingBody is there twice"),
        (lambda x, f, b, q: q.candidates([b, None], 0), "bodies[1]: is None; allowed: a MovingBody"),
    ],
)
def test_what_cannot_be_answered_is_refused(two, call, text):
    beam = two[0]
    body, query = nbd.MovingBody(beam.X, beam.F), nbd.FeatureQuery()
    with refused(ValueError, text):
        call(beam.X, beam.F, body, query)
    assert np.array_equal(body.at(1), beam.X)  # bodies come back from queries that fail


def test_two_threads_do_not_share_a_body(two):
    beam, size, _, begin, end = two
    body, obstacle = nbd.MovingBody(beam.X, beam.F), nbd.MovingBody(beam.X, beam.F, "obstacle")
    body.move(begin, end)
    alone = nbd.FeatureQuery().collision_free_step([body, obstacle], 0)
    answers, refused = [], set()

    def ask():
        query = nbd.FeatureQuery()
        for _ in range(20):
            try:
                answers.append(query.collision_free_step([body, obstacle], 0))
            except RuntimeError as error:
                refused.add(str(error).split(";")[0])

    in_threads(ask, ask)
    assert len(answers) > 0 and all(answer == alone for answer in answers)
    assert refused <= {"MovingBody: is in use by another thread"}
