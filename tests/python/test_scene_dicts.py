"""Scenes as dictionaries: what they may hold beside what JSON has, and what is told where they may not."""

import numpy as np
import pytest

import nbdtree as nbd


def scene_of(body, **changes):
    return {"bodies": [{"body": body, "transform": {"translate": [0, 0, 1]}, **changes}]}


def test_arrays_numbers_and_tuples_are_taken(beam):
    world = nbd.World(
        scene_of(beam, velocity=np.array([0, 0, -1.0]), transform={"translate": (0, np.float32(0.5), np.int64(2))}),
    )
    assert world.positions()[:, 2].min() > 1
    assert np.allclose(world.velocities(), [0, 0, -1])


@pytest.mark.parametrize("value", [float("nan"), float("inf"), np.float64("-inf")])
def test_numbers_that_are_not_finite_are_told_by_their_key(beam, value):
    with pytest.raises(ValueError, match=r"^bodies\[0\]\.transform\.translate\[1\]: is (nan|inf|-inf); allowed: finite numbers$"):
        nbd.World(scene_of(beam, transform={"translate": [0, value, 0]}))


def test_what_holds_itself_and_bytes_are_told(beam):
    endless = {}
    endless["contact"] = endless
    with pytest.raises(ValueError, match=r"^contact: holds lists and dictionaries in each other; allowed: at most 100 levels$"):
        nbd.World({**scene_of(beam), "contact": endless})
    with pytest.raises(ValueError, match=r"^bodies\[0\]\.velocity: is of the type bytes; allowed: "):
        nbd.World(scene_of(beam, velocity=b"abc"))


def test_what_json_has_not_is_told_by_its_key(beam):
    with pytest.raises(ValueError, match=r"^bodies\[0\]\.velocity: is of the type complex; allowed: "):
        nbd.World(scene_of(beam, velocity=1j))
    with pytest.raises(ValueError, match=r"^bodies\[0\]\.material: has the key 3; allowed: texts$"):
        nbd.World(scene_of(beam, material={3: 4}))
