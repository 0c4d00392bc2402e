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


def test_candidates_name_bodies_and_their_features(two):
    beam, size, bodies, begin, end = two
    distance = 0.0201 * size
    found = nbd.FeatureQuery().candidates(bodies, distance)
    edges = bodies[0].edges
    assert edges.dtype == np.int32 and len({tuple(sorted(e)) for e in edges.tolist()}) == len(edges)
    assert np.array_equal(bodies[0].F, beam.F)
    features = {"vertex_face": (np.arange(len(beam.X))[:, None], beam.F), "edge_edge": (edges, edges)}
    assert set(found) == set(features)

    def box(body, vertices):
        """Over the step."""
        at = np.concatenate([x[vertices] for x in ((begin, end) if body == 0 else (beam.X,))])
        return at.min(axis=0), at.max(axis=0)

    for kind, (of_a, of_b) in features.items():
        rows = found[kind]
        between = rows[rows[:, 0] != rows[:, 1]]
        assert rows.dtype == np.int32 and rows.shape[1] == 4 and len(between) > 50
        for body_a, body_b, a, b in between[::7].tolist():
            (low_a, high_a), (low_b, high_b) = box(body_a, of_a[a]), box(body_b, of_b[b])
            assert np.linalg.norm(np.maximum(np.maximum(low_a - high_b, low_b - high_a), 0)) <= (1 + 1e-9) * distance, kind
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
