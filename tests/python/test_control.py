"""What is told from step to step."""

import numpy as np
import pytest
from conftest import refused

import nbdtree as nbd


def everywhere():
    return {"box": {"min": [-9, -9, -9], "max": [9, 9, 9]}}


def test_a_grip_follows_a_function_of_time(beam):
    x = beam.X
    end = {"box": {"min": [-9, -9, -9], "max": [x[:, 0].min() + 0.02, 9, 9]}}
    world = nbd.World({"bodies": [{"body": beam, "pins": [end]}], "gravity": [0, 0, 0]})
    held = np.flatnonzero(world.positions()[:, 0] <= x[:, 0].min() + 0.02)
    start = world.positions()[held].copy()

    def way(t):
        return np.array([0.01 * np.sin(20 * t), 0, 0.1 * t])

    for _ in range(20):
        world.move_grip(0, way(world.time + 0.005))
        assert world.step(0.005).failure == ""
        assert world.positions()[held] == pytest.approx(start + way(world.time), abs=1e-12)
    assert {one.kind for one in world.reactions()} == {"grip"}


def test_errors_of_the_function_are_those_of_the_caller(beam):
    world = nbd.World({"bodies": [{"body": beam, "pins": [everywhere()]}]})
    error = KeyError("mine")

    def way(t):
        if t > 0.025:
            raise error
        return [0, 0, t]

    with pytest.raises(KeyError) as caught:
        for _ in range(10):
            world.move_grip(0, way(world.time + 0.01))
            world.step(0.01)
    assert caught.value is error and world.time == pytest.approx(0.02)


def test_a_motor_a_load_and_a_wind_go_where_they_are_told(beam):
    scene = {
        "bodies": [
            {
                "body": beam,
                "name": "beam",
                "loads": [{"force": [0, 0, 1]}, {"wind": {"velocity": [0, 0, 0], "density": 500}}],
            }
        ],
        "joints": [
            {
                "name": "rail",
                "body": "beam",
                "width": 0.02,
                "slider": {"point": beam.X.mean(axis=0).tolist(), "axis": [0, 0, 1], "motor": [[0, 0]]},
            }
        ],
        "gravity": [0, 0, 0],
    }
    world = nbd.World(scene)
    for step in range(1, 13):
        world.set_joint("rail" if step % 2 else 0, 0.001 * step)
        world.set_load(0, 0.0)
        world.set_wind(1, [step, 0, 0])
        assert world.step(0.005).failure == ""
        assert world.joint_values()[0] == pytest.approx(0.001 * step, abs=5e-4)
    wind = [one for one in world.reactions() if one.kind == "wind"]
    assert len(wind) == 1 and wind[0].name == "loads[1]" and wind[0].force[0] > 0


def test_what_is_not_there_is_refused(beam):
    world = nbd.World({"bodies": [{"body": beam, "pins": [everywhere()], "loads": [{"force": [0, 0, 1]}]}]})
    for call, text in [
        (lambda: world.move_grip(1), "grip 1 is not one of the 1 of"),
        (lambda: world.move_grip(0, (0, 0)), "translation: has not three numbers"),
        (lambda: world.move_grip(0, scale=0), "its scale is not positive"),
        (lambda: world.set_joint(0, 1), "joint 0 is not one of its 0"),
        (lambda: world.set_joint("elbow", 1), 'joint: "elbow" is not in the scene'),
        (lambda: world.set_load(1, 1), "load 1 of"),
        (lambda: world.set_load(0, float("nan")), "the factor of a load is not finite"),
        (lambda: world.set_wind(0, (0, 0, 1)), "is no wind"),
    ]:
        with refused(ValueError, text):
            call()
