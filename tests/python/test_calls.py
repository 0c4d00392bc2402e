"""Long calls: what Ctrl-C keeps, other threads, the end of the interpreter."""

import os
import signal
import textwrap
import threading
import time

import numpy as np
import pytest
from conftest import output_of, run_python, write_random_poses
from in_a_call import wait_for_a_call

import nbdtree as nbd


def test_ctrl_c_stops_a_dataset_which_then_continues(beam_file, tmp_path):
    call = f"nbd.make_dataset(nbd.load_body({str(beam_file)!r}), 'd.h5', trajectories=300, frames=40, progress=told)"
    output = output_of(
        f"""
        import os, signal, nbdtree as nbd
        seen = []
        def told(what, done, total):
            if done >= 2 and not seen:
                seen.append(done)
                os.kill(os.getpid(), signal.SIGINT)
        try:
            {call}
        except KeyboardInterrupt:
            print("stopped")
        """, cwd=tmp_path)
    assert output == "stopped\n"
    kept = list((tmp_path / "d.shards").glob("*.h5"))
    assert 0 < len(kept) < 300 and not (tmp_path / "d.h5").exists()


def test_ctrl_c_stops_a_training(beam, beam_file, tmp_path):
    write_random_poses(tmp_path / "many.h5", beam, 12, 24)
    output = output_of(
        f"""
        import os, signal, nbdtree as nbd
        body = nbd.load_body({str(beam_file)!r})
        body = body.with_modes(nbd.vibration_modes(body, 16))
        seen = []
        def told(what, done, total):
            if what == "networks" and done >= 1 and not seen:
                seen.append(done)
                os.kill(os.getpid(), signal.SIGINT)
        try:
            nbd.train(body, "many.h5", ["nbd"], modes=16, clusters=20, depth=7, epochs=20,
                      checkpoint="c", progress=told)
        except KeyboardInterrupt:
            print("stopped")
        """, cwd=tmp_path)
    assert output == "stopped\n"
    assert (tmp_path / "c").exists()


def test_a_program_without_a_handler_ends_by_ctrl_c(beam, tmp_path, beam_file):
    code = f"""
    import nbdtree as nbd
    world = nbd.World({{"bodies": [{{"body": nbd.load_body({str(beam_file)!r})}}]}})
    world.step()
    print("ready", flush=True)
    while True: world.step()
    """
    _, errors, status = run_python("-c", textwrap.dedent(code), cwd=tmp_path, signalled=True)
    assert "KeyboardInterrupt" in errors and status != 0


def test_a_daemon_thread_does_not_disturb_the_end(beam_file):
    code = f"""
    import threading, nbdtree as nbd
    stepped = threading.Event()
    world = nbd.World({{"bodies": [{{"body": nbd.load_body({str(beam_file)!r})}}]}})
    def run():
        while True:
            world.step()
            stepped.set()
    threading.Thread(target=run, daemon=True).start()
    stepped.wait()
    print("ends")
    """
    assert output_of(code) == "ends\n"


def test_other_threads_run_during_a_long_call(tree_file, poses):
    """The call would take hours; another thread stops it, after a hundred waits."""
    ticks = 0

    def tick():
        nonlocal ticks
        wait_for_a_call()
        for ticks in range(1, 101):
            time.sleep(0.0001)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=tick)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        nbd.check_contact_scenes(tree_file, poses, scenes=100_000_000)
    thread.join()
    assert ticks == 100


def test_threads_are_limited_and_do_not_change_results(beam):
    count = nbd.thread_count()
    ends = []
    for threads in (1, 2, 4):
        nbd.set_thread_count(threads)
        assert nbd.thread_count() == threads
        world = nbd.World({"bodies": [{"body": beam}]})
        for _ in range(10):
            world.step(0.01)
        ends.append(world.positions().tobytes())
    nbd.set_thread_count(count)
    assert len(set(ends)) == 1
    with pytest.raises(ValueError):
        nbd.set_thread_count(0)


def test_a_tree_of_a_file_keeps_the_file_alive(tree_file, tmp_path):
    nbd.save_tree(tmp_path / "t.h5", tree_file)
    tree = nbd.load_tree(tmp_path / "t.h5").tree
    faces = tree.faces
    del tree
    assert np.array_equal(faces, tree_file.tree.faces)


def test_blas_of_numpy_keeps_its_threads(beam_file):
    code = """
    import ctypes, sys, threading, nbdtree as nbd
    library = ctypes.CDLL("libopenblas.so.0")
    library.openblas_set_num_threads(2)
    body = nbd.load_body(sys.argv[1])
    nbd.vibration_modes(body, 10)
    seen, done = set(), threading.Event()
    def look():
        while not done.is_set(): seen.add(library.openblas_get_num_threads())
    looking = threading.Thread(target=look)
    looking.start()
    while 1 not in seen: nbd.vibration_modes(body, 40)
    done.set()
    looking.join()
    print(library.openblas_get_num_threads())
    """
    printed, errors, _ = run_python("-c", textwrap.dedent(code), beam_file)
    if "cannot open shared object" in errors:
        pytest.skip("BLAS is not OpenBLAS")
    assert printed == "2\n", errors
