"""Scenes with variables, and datasets of them."""

import json

import numpy as np
import pytest

import nbdtree as nbd


def scene(body="beam.h5"):
    return {
        "variables": [{"name": "speed", "uniform": [1, 2]}, {"name": "way", "direction": [0, 0, 1]}],
        "gravity": [0, 0, 0],
        "bodies": [{"body": body, "velocity": {"var": "way", "times": 0.5},
                    "material": {"rayleigh_mass": 0, "density": {"var": "speed", "times": 1000}}}],
        "time": {"dt": 0.002, "frames": 3, "steps_per_frame": 2},
    }


def test_a_scene_is_drawn(beam_file):
    drawn = nbd.draw_scene(scene(), 4, seed=2, values={"speed": 1.5})
    assert "variables" not in drawn
    [body] = drawn["bodies"]
    assert body["material"]["density"] == 1500
    assert np.linalg.norm(body["velocity"]) == pytest.approx(0.5)
    assert drawn == nbd.draw_scene(scene(), 4, seed=2, values={"speed": 1.5})
    assert drawn != nbd.draw_scene(scene(), 5, seed=2, values={"speed": 1.5})
    world = nbd.World(drawn, beam_file.parent)
    world.step()


def test_a_dataset_of_a_scene(beam_file, beam, command, tmp_path):
    body = nbd.make_scene_dataset(scene(), tmp_path / "d.h5", trajectories=5, seed=3, per_shard=2, folder=beam_file.parent,
                                  hold_out="variables.speed=top:0.4")
    manifest = nbd.dataset_manifest(tmp_path / "d.h5")
    assert sorted(manifest["variables"]) == [0, 1, 2, 3, 4]
    speeds = {i: values["speed"] for i, values in manifest["variables"].items()}
    split = manifest["splits"]["parameter"]
    assert sorted(split["held_out"]) == sorted(sorted(speeds, key=speeds.get)[-2:])
    reader = nbd.RecordingReader(tmp_path / "d.h5")
    first, moved = reader.read(0, 0, 1)[0], reader.read(0, 2, 1)[0]
    way = 0.5 * np.array(manifest["variables"][0]["way"])
    assert np.allclose(moved.mean(0) - first.mean(0), way * 0.008, atol=1e-6)
    assert np.array_equal(body.tets.X, beam.tets.X)

    # The command makes the same poses.
    (beam_file.parent / "beam_scene.json").write_text(json.dumps(scene(beam_file.name)))
    command("dataset", beam_file.parent / "beam_scene.json", "-o", tmp_path / "e.h5", "--trajectories", 5, "--seed", 3)
    other = nbd.RecordingReader(tmp_path / "e.h5")
    for i in range(5):
        assert np.array_equal(reader.read(i, 0, 3), other.read(i, 0, 3))


def test_what_is_wrong_is_one_line(beam_file, tmp_path):
    wrong = scene()
    wrong["variables"][0]["uniform"] = [2, 1]
    with pytest.raises(ValueError, match=r"^variables\[0\]\.uniform: is \[2,1\]; the first must not be above the second$"):
        nbd.draw_scene(wrong)
    with pytest.raises(ValueError, match="^trajectory: is -1; allowed: 0 or more$"):
        nbd.draw_scene(scene(), -1)
    with pytest.raises(ValueError, match='^"speeed" is no variable of the scene; allowed: speed, way$'):
        nbd.draw_scene(scene(), values={"speeed": 1})
    with pytest.raises(ValueError, match='^has no body "x" whose poses could be recorded; allowed: beam$'):
        nbd.make_scene_dataset(scene(), tmp_path / "d.h5", record="x", folder=beam_file.parent)
    with pytest.raises(ValueError, match="^frames: is 0; allowed: 1 to 1000000$"):
        nbd.make_scene_dataset(scene(), tmp_path / "d.h5", frames=0, folder=beam_file.parent)
    with pytest.raises(ValueError, match="^variables: make the scene a template"):
        nbd.World(scene(), beam_file.parent)
