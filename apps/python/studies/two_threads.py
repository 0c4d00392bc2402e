"""Times two threads of Python that step a world each, against one that steps them one after the other.

    python3 two_threads.py [two_threads.csv]

Prints medians of nine runs in turns, for one and for all threads within a call, and the least ratio that is possible: if all
cores were busy all the time with the work that one thread does.
"""

import pathlib
import platform
import statistics
import sys
import threading
import time

import nbdtree as nbd

ASSETS = pathlib.Path(__file__).resolve().parents[3] / "assets"
STEPS, RUNS = 40, 9

gear = nbd.mesh_file(ASSETS / "gear.obj", nodes=3000)


def make_worlds() -> list[nbd.World]:
    bodies = [{"body": gear, "transform": {"translate": [0, 0, 0.3 + b]}} for b in range(2)]
    return [nbd.World({"bodies": bodies, "obstacles": [{"plane": {}}]}) for _ in range(2)]


def step(world: nbd.World) -> None:
    for _ in range(STEPS):
        world.step(0.005)


def in_turn() -> float:
    worlds = make_worlds()
    begin = time.perf_counter()
    for world in worlds:
        step(world)
    return time.perf_counter() - begin


def at_once() -> float:
    threads = [threading.Thread(target=step, args=(world,)) for world in make_worlds()]
    begin = time.perf_counter()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return time.perf_counter() - begin


cores = nbd.thread_count()
rows = ["threads in a call,one after the other (s),at once (s),ratio,least possible ratio"]
work = None  # seconds of one core
for count in sorted({1, cores}):
    nbd.set_thread_count(count)
    times = [(in_turn(), at_once()) for _ in range(RUNS)]
    ratio = statistics.median(b / a for a, b in times)
    medians = [statistics.median(column) for column in zip(*times)]
    work = work or medians[0]
    rows.append(f"{count},{medians[0]:.3f},{medians[1]:.3f},{ratio:.2f},{work / min(2 * count, cores) / medians[0]:.2f}")
print(f"{cores} cores, {platform.machine()}")
print("\n".join(rows))
if len(sys.argv) > 1:
    pathlib.Path(sys.argv[1]).write_text("\n".join(rows) + "\n")
