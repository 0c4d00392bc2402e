import json

import h5py
import numpy as np
import pytest
from conftest import falling_beams, in_threads, refused

import nbdtree as nbd


def test_two_bodies_fall_and_touch(beam):
    world = nbd.World(falling_beams(beam, 0.2))
    assert world.names == ["lower", "upper"] and len(world) == 2
    contacts, distances = 0, []
    for _ in range(60):
        report = world.step()
        assert report.failure == ""
        contacts += report.contacts
        distances.append(report.least_distance)
    assert contacts > 0 and 0 < min(distances) < np.inf
    assert world.time == pytest.approx(0.3)
    assert world.positions(0)[:, 2].min() > -0.02
    assert np.abs(world.contact_forces(0)).max() > 0
    assert world.intersecting_faces() == []
    assert 0 < len(world.within(0, 1, 0.02)) < len(world.within(0, 1, 0.1))


def test_views_show_every_step_and_cannot_be_written(beam):
    world = nbd.World({"bodies": [{"body": beam}]})
    x, v = world.positions(), world.velocities()
    first = x.copy()
    for _ in range(5):
        world.step(0.01)
    assert np.array_equal(x, world.positions()) and not np.array_equal(x, first)
    assert np.all(v[:, 2] < 0)
    for view in (x, v):
        with pytest.raises(ValueError):
            view[0, 0] = 1


def test_forces_that_are_written_act(beam):
    scene = {"bodies": [{"body": beam}], "gravity": [0, 0, 0]}
    world = nbd.World(scene)
    world.forces()[:] = world.masses()[:, None] * [2.0, 0, 0]
    for _ in range(10):
        world.step(0.01)
    assert world.velocities().mean(axis=0) == pytest.approx([0.2, 0, 0], abs=0.005)


def test_forces_too_large_to_square_fail_the_step(beam):
    world = nbd.World({"bodies": [{"body": beam}]})
    world.forces()[0, 0] = 1e160
    before = world.positions().copy()
    assert "too large" in world.step(0.01).failure
    assert np.array_equal(world.positions(), before)


def test_driven_nodes_carry_the_body(beam):
    world = nbd.World({"bodies": [{"body": beam}], "gravity": [0, 0, 0]})
    x = world.positions()
    end = np.flatnonzero(x[:, 0] < x[:, 0].min() + 1e-6)
    start = x[end].copy()
    for step in range(50):
        world.drive(end, start + [0, 0, 2e-3 * (step + 1)])
        assert world.step(0.01).failure == ""
        assert np.allclose(x[end], start + [0, 0, 2e-3 * (step + 1)], atol=1e-12)
    assert x[:, 2].mean() > 0.02
    world.drive([], np.empty((0, 3)))
    world.step(0.01)


def test_a_moved_obstacle_goes_where_it_is_told(beam):
    top = beam.surface_X[:, 2].max()
    plate = {"plane": {"point": [0, 0, top + 0.001], "normal": [0, 0, -1]}, "centre": [0, 0, top]}
    scene = {"bodies": [{"body": beam}], "gravity": [0, 0, 0], "obstacles": [plate], "time": {"dt": 0.01}}
    told, moved = nbd.World(scene), nbd.World(scene)
    scene["obstacles"][0]["motion"] = [
        {"time": 0, "interpolation": "linear"},
        {"time": 0.2, "translate": [0, 0, -0.02], "rotate": {"axis": [0, 1, 0], "degrees": 2}},
    ]
    by_scene = nbd.World(scene)
    for step in range(20):
        share = (step + 1) / 20
        moved.move_obstacle(0, (0, 0, -0.02 * share), [0, np.radians(2) * share, 0])
        for world in (told, moved, by_scene):
            assert world.step().failure == ""
    assert moved.positions()[:, 2].mean() < told.positions()[:, 2].mean() - 0.005
    assert np.allclose(moved.positions(), by_scene.positions(), atol=1e-6)
    for call, text in [
        (lambda: moved.move_obstacle(1), "obstacle 1 is not one of its 1"),
        (lambda: moved.move_obstacle(0, scale=0), "its scale is not positive"),
        (lambda: moved.move_obstacle(0, (0, 0)), "translation: has not three numbers"),
        (lambda: moved.move_obstacle(0, (0, 0, float("nan"))), "is not finite"),
    ]:
        with refused(ValueError, text):
            call()


def test_a_snapshot_continues_with_the_same_bits(beam):
    world = nbd.World(falling_beams(beam))
    for _ in range(30):
        world.step()
    snapshot = world.snapshot()
    ends = []
    for _ in range(2):
        world.restore(snapshot)
        for _ in range(20):
            world.step()
        ends.append(world.positions(1).tobytes())
    assert snapshot.time == pytest.approx(0.15) and ends[0] == ends[1]


def test_recordings_are_the_bits_of_the_command(command, assets, tmp_path):
    scene = json.loads((assets / "scenes" / "rings.json").read_text())
    scene["time"] = {"dt": 0.005, "frames": 8, "steps_per_frame": 2}
    for body in scene["bodies"]:
        body["surface"] = str(assets / "ring.obj")
    path = tmp_path / "rings.json"
    path.write_text(json.dumps(scene))
    command("simulate", path, "-o", tmp_path / "command.h5")
    for given in (path, scene):
        world = nbd.World(given)
        with nbd.recording(world, tmp_path / "python.h5", scene_file=path) as record:
            record.add_frame()
            for _ in range(world.frames):
                for _ in range(world.steps_per_frame):
                    world.step()
                record.add_frame()
        with h5py.File(tmp_path / "command.h5") as a, h5py.File(tmp_path / "python.h5") as b:
            assert a.attrs["scene_file"] == b.attrs["scene_file"]
            for body in ("000000", "000001"):
                x, y = (f["trajectories"][body]["positions"][:] for f in (a, b))
                assert x.shape[0] == 9 and x.tobytes() == y.tobytes()
                assert a["trajectories"][body].attrs["body_sha256"] == b["trajectories"][body].attrs["body_sha256"]


def test_a_recording_opens_in_the_viewer(command, assets, tmp_path):
    world = nbd.World(assets / "scenes" / "rings.json")
    with nbd.recording(world, tmp_path / "run.h5", scene_file=assets / "scenes" / "rings.json") as record:
        for _ in range(3):
            record.add_frame()
            world.step()
    command("view", tmp_path / "run.h5", "-o", tmp_path / "run.html")
    assert (tmp_path / "run.html").stat().st_size > 500_000


def test_an_exception_removes_the_recording(beam, tmp_path):
    world = nbd.World({"bodies": [{"body": beam}]})
    with pytest.raises(KeyError), nbd.recording(world, tmp_path / "run.h5") as record:
        record.add_frame()
        raise KeyError
    assert list(tmp_path.iterdir()) == []


def test_two_threads_step_two_worlds(beam):
    worlds = [nbd.World(falling_beams(beam)) for _ in range(3)]

    def run(world):
        for _ in range(20):
            world.step()

    in_threads(lambda: run(worlds[0]), lambda: run(worlds[1]))
    run(worlds[2])
    assert len({world.positions(1).tobytes() for world in worlds}) == 1


def test_one_world_in_two_threads_is_refused(beam):
    world = nbd.World(falling_beams(beam))
    refused = []

    def run():
        for _ in range(200):
            try:
                world.step()
            except RuntimeError as error:
                refused.append(str(error))
            if refused:
                return

    in_threads(run, run)
    assert len(refused) == 1 and refused[0].startswith("World: is in use by another thread")


@pytest.mark.parametrize(
    "scene, kind, text",
    [
        ({"bodies": []}, ValueError, "bodies"),
        ({"bodies": [{"body": "none.h5"}]}, RuntimeError, "none.h5"),
        ({"bodies": [{"body": "none.h5", "nme": "a"}]}, ValueError, 'unknown key "nme"'),
        ({"bodies": [3]}, ValueError, "bodies[0]"),
        ({"bodies": [{"body": "none.h5"}], "time": {"dt": -1}}, ValueError, "time.dt"),
    ],
)
def test_a_bad_scene_is_refused_with_one_line(scene, kind, text):
    with refused(kind, text):
        nbd.World(scene)


def test_bad_arguments_are_refused(beam):
    world = nbd.World({"bodies": [{"body": beam}]})
    world.drive([], [])
    n = len(beam.surface_X)
    other = nbd.make_exact_tree(beam.surface_X, beam.F).on_nodes(
        (np.ones(n), np.full(n, 9999), np.arange(n + 1)), np.random.default_rng(1).random((10000, 3))
    )
    for call, kind, text in [
        (lambda: world.positions(1), IndexError, "body: is 1; allowed: 0..0"),
        (lambda: world.step(-1), ValueError, "dt is -1"),
        (lambda: world.within(0, 0), ValueError, "a and b are one body"),
        (lambda: world.drive([0, 0], np.zeros((2, 3))), ValueError, "named twice"),
        (lambda: world.drive([0], np.zeros((2, 3))), ValueError, "targets"),
        (lambda: nbd.World(5), ValueError, "scene: is <class 'int'>; allowed: a path"),
        (lambda: world.begin_pose(0, nbd.PosedTree(other, "affine")), ValueError, "other weights"),
        (lambda: world.drive([0.5], np.zeros((1, 3))), ValueError, "nodes: is float64"),
    ]:
        with refused(kind, text):
            call()


def overlapping_beams(beam, **contact):
    return {
        "bodies": [{"body": beam}, {"body": beam, "transform": {"translate": [0.02, 0.01, 0.03]}}],
        "contact": contact,
    }


def test_a_scene_stays_as_it_was_given(beam):
    scene = falling_beams(beam)
    bodies = scene["bodies"]
    first, second = nbd.World(scene), nbd.World(scene)
    assert scene["bodies"] is bodies and all(body["body"] is beam for body in bodies) and len(first) == len(second) == 2


def test_bodies_are_moved_apart_on_call(beam):
    world = nbd.World(overlapping_beams(beam))
    for call in (world.check_start, world.step):
        with refused(ValueError, "intersect"):
            call()
    assert len(world.intersecting_faces()) > 0 and world.start_moves == []
    before = [world.positions(b).copy() for b in range(2)]
    moves = world.resolve_start()
    assert {body for body, _ in moves} == {0, 1}
    for body, by in moves:
        assert by.shape == (3,) and np.linalg.norm(by) > 0
        assert np.allclose(world.positions(body) - before[body], by, atol=1e-12)
    assert world.intersecting_faces() == [] and world.resolve_start() == []
    world.check_start()
    assert world.step(0.001).failure == "" and world.intersecting_faces() == []


def test_a_scene_that_moves_bodies_apart_tells_it(beam):
    world = nbd.World(overlapping_beams(beam, resolve_start=True))
    called = nbd.World(overlapping_beams(beam))
    assert len(world.start_moves) == 2
    for (a, by), (b, same) in zip(world.start_moves, called.resolve_start()):
        assert a == b and np.array_equal(by, same)


def test_bodies_that_are_held_cannot_be_moved_apart(beam):
    scene = overlapping_beams(beam)
    for body in scene["bodies"]:
        body["grips"] = [{"region": {"box": {"min": [-9, -9, -9], "max": [9, 9, 9]}}}]
    world = nbd.World(scene)
    with refused(ValueError, "cannot be moved apart"):
        world.resolve_start()


def test_reactions_hold_what_is_pinned_and_pressed(beam):
    bodies = [
        {"body": beam, "name": "held", "pins": [{"box": {"min": [-9, -9, -9], "max": [-0.45, 9, 9]}}]},
        {"body": beam, "name": "free", "transform": {"translate": [0, 3, 0.3]}},
    ]
    floor = {"name": "floor", "plane": {"point": [0, 0, -9]}}
    bodies[1]["transform"]["translate"][2] = -8.6
    world = nbd.World({"bodies": bodies, "obstacles": [floor]})
    assert world.reactions() == []
    g = np.array([0, 0, -9.81])
    momentum = [world.masses(b) @ world.velocities(b) for b in (0, 1)]
    impulse = [np.zeros(3), np.zeros(3)]
    kinds = set()
    for _ in range(80):
        assert world.step(0.005).failure == ""
        for b in (0, 1):
            drag = 0.1 * world.masses(b) @ world.velocities(b)  # damping by mass
            impulse[b] += 0.005 * (world.masses(b).sum() * g - drag)
        for r in world.reactions():
            impulse[r.body] += 0.005 * r.force
            kinds.add((r.kind, r.name, r.body))
    assert ("grip", "pins[0]", 0) in kinds and ("obstacle", "floor", 1) in kinds
    for b in (0, 1):
        change = world.masses(b) @ world.velocities(b) - momentum[b]
        scale = 0.4 * 9.81 * world.masses(b).sum()
        assert np.abs(change - impulse[b]).max() < 1e-3 * scale


def hollow_cube(path):
    """Writes the surface of a cube of side 3 with a cavity of side 1."""
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    lines = []
    for low, size in ((0, 3), (1, 1)):
        lines += ["v {} {} {}".format(*(low + size * c for c in corner)) for corner in corners]
    for first in (1, 9):
        for a, b, c, d in sides:
            lines += [f"f {first + a} {first + b} {first + c}", f"f {first + a} {first + c} {first + d}"]
    path.write_text("\n".join(lines) + "\n")


def test_cavities_tell_volume_and_pressure(tmp_path):
    hollow_cube(tmp_path / "cube.obj")
    gas = {"gas": {"pressure": 2e5, "ambient": 1e5}, "cavity": 0}
    body = {"surface": str(tmp_path / "cube.obj"), "material": {"young": 1e6}, "loads": [gas]}
    world = nbd.World({"bodies": [body], "gravity": [0, 0, 0]})
    (cavity,) = world.cavities()
    assert (cavity.body, cavity.number) == (0, 0)
    assert cavity.volume == pytest.approx(1) and cavity.pressure == pytest.approx(1e5)
    assert "0 of body 0" in repr(cavity)
    for _ in range(20):
        assert world.step(0.01).failure == ""
    (cavity,), (told,) = world.cavities(), world.reactions()
    assert cavity.volume > 1.01
    assert (cavity.pressure + 1e5) * cavity.volume == pytest.approx(2e5, rel=1e-6)
    assert (told.kind, told.name, told.number) == ("cavity", "cavity 0", 0)
    assert (told.pressure, told.volume) == (cavity.pressure, cavity.volume)
    assert not told.force.any()
    del body["loads"][0]["cavity"]
    with refused(ValueError, "loads[0].cavity: is missing"):
        nbd.World({"bodies": [body]})


def test_rules_for_pairs(beam):
    world = nbd.World(falling_beams(beam, 0.2))
    world.set_pair(0, 1, meet=False)
    world.set_pair(0, obstacle=0, friction=0.2)
    kinds = set()
    for _ in range(60):
        assert world.step().failure == ""
        kinds |= {r.kind for r in world.reactions()}
    assert kinds == {"obstacle"}
    with refused(ValueError, "one of other and obstacle"):
        world.set_pair(0)
    with refused(ValueError, "obstacle 7"):
        world.set_pair(0, obstacle=7)
    with refused(ValueError, "friction is -1"):
        world.set_pair(0, 0, friction=-1)
    with refused(IndexError, "body: is 2"):
        world.set_pair(0, 2)


def test_loads_and_gravity_follow_their_keyframes(beam):
    push = {"force": [0, 3, 0], "factor": [[0, 0], [0.1, 1], [0.2, 0]]}
    gravity = [{"time": 0, "value": [0, 0, 0]}, {"time": 0.1, "value": [0, 0, -2]}, {"time": 0.2, "value": [0, 0, 0]}]
    still = {"rayleigh_mass": 0}
    world = nbd.World({"bodies": [{"body": beam, "loads": [push], "material": still}], "gravity": gravity})
    for _ in range(60):
        assert world.step(0.005).failure == ""
    momentum = world.masses() @ world.velocities()
    assert momentum == pytest.approx([0, 0.3, -0.2 * world.masses().sum()], abs=1e-6)
    with refused(ValueError, "loads[0].force: must be three numbers"):
        nbd.World({"bodies": [{"body": beam, "loads": [{"force": 3}]}]})


def test_static_scenes_come_to_balance(beam):
    held = {"body": beam, "name": "shelf", "pins": [{"box": {"min": [-9, -9, -9], "max": [-0.45, 9, 9]}}]}
    world = nbd.World({"bodies": [held], "time": {"static": {"increments": 4}}})
    assert (world.dt, world.frames, world.steps_per_frame) == (0.25, 4, 1)
    weight = 9.81 * world.masses().sum()
    for share in (0.25, 0.5, 0.75, 1):
        report = world.step()
        assert report.failure == "" and report.imbalance <= 1e-6
        assert world.time == pytest.approx(share)
        assert world.reactions()[0].force[2] == pytest.approx(share * weight, rel=1e-5)
    assert np.all(world.velocities() == 0)
    falling = nbd.World({"bodies": [{"body": beam, "name": "loose"}], "time": {"static": {}}})
    assert "nothing holds bodies[0] (loose)" in falling.step().failure
    with refused(ValueError, "time.dt: must not be beside \"static\""):
        nbd.World({"bodies": [held], "time": {"static": {}, "dt": 0.1}})


def test_recordings_hold_the_reactions_of_each_step(command, assets, tmp_path):
    scene = {
        "bodies": [
            {"surface": str(assets / "beam.obj"), "name": "held", "pins": [{"box": {"min": [-9, -9, -9], "max": [-0.45, 9, 9]}}]},
            {"surface": str(assets / "beam.obj"), "name": "free", "transform": {"translate": [0, 3, -8.93]}},
        ],
        "obstacles": [{"name": "floor", "plane": {"point": [0, 0, -9]}}],
        "time": {"dt": 0.01, "frames": 4, "steps_per_frame": 2},
    }
    (tmp_path / "scene.json").write_text(json.dumps(scene))
    command("simulate", "scene.json", "-o", "run.h5", cwd=tmp_path)
    rows = nbd.RecordingReader(tmp_path / "run.h5").reactions()
    world = nbd.World(tmp_path / "scene.json")
    told = []
    for step in range(8):
        world.step(0.01)
        told += [(1 + step // 2, world.time, r.body, r.kind, r.name, r.force, r.torque, r.point) for r in world.reactions()]
    assert len(told) > 8 and {row[3] for row in told} == {"grip", "obstacle"}
    assert rows["frame"].tolist() == [row[0] for row in told]
    assert rows["body"].tolist() == [row[2] for row in told]
    assert rows["kind"] == [row[3] for row in told] and rows["by"] == [row[4] for row in told]
    for name, place in (("time", 1), ("force", 5), ("torque", 6), ("point", 7)):
        assert np.array_equal(rows[name], np.array([row[place] for row in told])), name
    assert not rows["pressure"].any() and not rows["volume"].any()
    with nbd.recording(world, tmp_path / "other.h5") as file:
        file.add_frame()
    none = nbd.RecordingReader(tmp_path / "other.h5").reactions()
    assert none["force"].shape == (0, 3) and none["kind"] == []
