"""Ctrl-C stops long calls, and what is left can be used. A call that comes to its end first is made again."""

import os
import signal
import threading
import time

import numpy as np
import pytest
from conftest import falling_beams, write_random_poses
from in_a_call import Pressing

import nbdtree as nbd


@pytest.fixture(scope="module")
def fine(assets):
    """A body whose calls take long."""
    return nbd.mesh_file(assets / "beam.obj", nodes=2200)


@pytest.fixture(scope="module")
def long_recording(beam, tmp_path_factory):
    """Many random poses of the beam, in 40 trajectories."""
    path = tmp_path_factory.mktemp("long") / "long.h5"
    write_random_poses(path, beam, 40, 60)
    return path


def stopped(call, after=0.15):
    """Presses Ctrl-C `after` seconds of a call, which must stop. Python's own handler does nothing, so that nothing else ends
    the call."""
    before = signal.signal(signal.SIGINT, lambda *_: None)
    try:
        with Pressing(after, again=True), pytest.raises(nbd.Stopped):
            while True:
                call()
    finally:
        signal.signal(signal.SIGINT, before)


def interrupted(call, after=0.15):
    """Presses Ctrl-C once, which Python's own handler raises."""
    with Pressing(after), pytest.raises(KeyboardInterrupt):
        while True:
            call()


def test_vibration_modes(fine):
    stopped(lambda: nbd.vibration_modes(fine, 1000))
    interrupted(lambda: nbd.vibration_modes(fine, 1000))
    assert nbd.vibration_modes(fine, 2).frequencies[0] > 0


def test_filling_a_surface(assets):
    surface, _ = nbd.make_solid_boundary(nbd.read_surface(assets / "gear.obj"))
    stopped(lambda: nbd.tetrahedralize(surface, nodes=44_000), 0.05)
    # gmsh is as before.
    assert np.array_equal(nbd.tetrahedralize(surface).T, nbd.tetrahedralize(surface).T)
    stopped(lambda: nbd.mesh_file(assets / "gear.obj", nodes=44_000), 0.05)


@pytest.mark.parametrize(
    "call",
    [
        lambda file, data: nbd.evaluate(file, data, margins=[0.01 * i for i in range(1000)]),
        lambda file, data: nbd.calibrate(file, data, miss_rate=1e-4),
        lambda file, data: nbd.measure_coverage(file, data),
        lambda file, data: nbd.check_contact_scenes(file, data, scenes=1_000_000),
    ],
    ids=["evaluate", "calibrate", "measure_coverage", "check_contact_scenes"],
)
def test_calls_that_read_frames(tree_file, long_recording, call):
    stopped(lambda: call(tree_file, long_recording))
    assert nbd.RecordingReader(long_recording).frames == 2400


def test_remap(beam, long_recording, tmp_path):
    stopped(lambda: nbd.remap(long_recording, tmp_path / "r.h5", beam, beam))
    assert [path.name for path in tmp_path.iterdir()] in ([], ["r.h5"])
    assert nbd.remap(long_recording, tmp_path / "r.h5", beam, beam, 1) == 60


def test_training_before_its_networks(beam, long_recording):
    stopped(lambda: nbd.train(beam, long_recording, ["learned_affine"], depth=8))


def test_a_loop_of_steps(beam):
    world = nbd.World(falling_beams(beam))
    interrupted(world.step)
    assert world.step().failure == ""


def test_a_long_step_is_taken_back(fine):
    solver = {"newton_iterations": 100, "newton_tolerance": 1e-12}
    world = nbd.World({"bodies": [{"body": fine}], "time": {"dt": 0.05}, "solver": solver})
    x = world.positions()
    interrupted(world.step)
    done = round(world.time / 0.05)
    assert world.time == pytest.approx(0.05 * done) and np.all(np.isfinite(x))
    report = world.step()
    assert report.failure == "" and world.time == pytest.approx(0.05 * (done + 1))


def test_taken_back_steps_leave_the_bits(beam):
    steps, stepping, tries, stops, done = 40, False, 0, 0, threading.Event()

    def raise_in_a_step(*_):
        nonlocal stepping, tries
        if stepping and tries < 3:  # so that every step comes to its end
            stepping, tries = False, tries + 1
            raise KeyboardInterrupt

    def press():
        while not done.is_set():
            time.sleep(0.002)
            os.kill(os.getpid(), signal.SIGINT)

    undisturbed, world = (nbd.World(falling_beams(beam, 0.13)) for _ in range(2))
    before = signal.signal(signal.SIGINT, raise_in_a_step)
    presses = threading.Thread(target=press)
    presses.start()
    try:
        while steps > 0 or stops < 3:
            try:
                stepping = True
                world.step(0.005)
                stepping, tries, steps = False, 0, steps - 1
            except KeyboardInterrupt:
                stops += 1
    finally:
        done.set()
        presses.join()
        signal.signal(signal.SIGINT, before)
    while undisturbed.time < world.time - 1e-9:  # as many steps; an exception may fall between a step and its count
        undisturbed.step(0.005)
    assert world.time == undisturbed.time and world.time > 0.19
    assert world.positions(1).tobytes() == undisturbed.positions(1).tobytes()


def test_a_handler_that_does_not_raise_lets_steps_go_on(beam):
    world, seen, steps = nbd.World({"bodies": [{"body": beam}]}), [], 0
    before = signal.signal(signal.SIGINT, lambda *_: seen.append(1))
    try:
        with Pressing(again=True):
            while len(seen) < 3 or steps < 50:
                world.step(0.001)
                steps += 1
    finally:
        signal.signal(signal.SIGINT, before)
    assert world.time == pytest.approx(0.001 * steps)


def test_the_handler_of_python_is_there_again(beam):
    nbd.vibration_modes(beam, 2)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(1)
