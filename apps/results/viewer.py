#!/usr/bin/env python3
"""Measures pages of `nbdtree view`: their size, how soon they show, and how far positions are off.

    apps/results/viewer.py NBDTREE SURFACE [--frames 300] [-o FILE.csv] [--picture FILE.png]

Drops SURFACE (in metres, with y up) on a floor, writes a page of the recording, opens it in a headless Chromium without
network, and compares the nodes of every frame with the recording. Needs Debian's chromium-driver, python3-selenium,
python3-h5py and python3-numpy. The seconds are from the start of the page's loading to its second picture.
"""
import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "apps" / "view"))
from browser import Browser


def nbdtree(program, *arguments):
    return subprocess.run([program, *map(str, arguments)], check=True, capture_output=True, text=True).stdout


def scene_of(surface, frames):
    return {
        "bodies": [{"surface": str(surface), "name": surface.stem, "angular_velocity": [2, 0, 0], "material": {"young": 5e4},
                    "transform": {"translate": [0, 0, 0.8], "rotate": {"axis": [1, 0, 0], "degrees": 90}}}],
        "obstacles": [{"plane": {}}],
        "time": {"dt": 0.005, "frames": frames - 1, "steps_per_frame": 2},
    }


def position_error(browser, recording, frames):
    """Largest error of a coordinate: as a share of the side of the box around all frames, and in metres."""
    with h5py.File(recording) as file:
        recorded = file["trajectories/000000/positions"][:].astype(float)
    sides = recorded.max(axis=(0, 1)) - recorded.min(axis=(0, 1))
    share = metres = 0
    for frame in range(frames):
        browser.run("nbdtree.seek(arguments[0])", frame)
        shown = np.array(browser.run("return Array.from(nbdtree.nodes(0))")).reshape(-1, 3)
        error = np.abs(shown - recorded[frame])
        share, metres = max(share, (error / sides).max()), max(metres, error.max())
    return share, metres


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("surface", type=Path)
    parser.add_argument("--frames", type=int, default=300)
    parser.add_argument("-o", "--output", type=Path, help="table to write (CSV)")
    parser.add_argument("--picture", type=Path, help="screenshot to write (PNG)")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="nbdtree_viewer_") as name, Browser() as browser:
        folder = Path(name)
        (folder / "scene.json").write_text(json.dumps(scene_of(arguments.surface.resolve(), arguments.frames)))
        nbdtree(arguments.program, "simulate", folder / "scene.json", "-o", folder / "run.h5", "-q")
        told = json.loads(nbdtree(arguments.program, "view", folder / "run.h5", "-o", folder / "run.html", "--json", "-q"))
        seconds = []
        for _ in range(5):
            browser.open(folder / "run.html")
            seconds.append(browser.run("return nbdtree.shownSeconds"))
        assert browser.complaints() == [] and browser.requests() == []
        nodes = browser.run("return nbdtree.facts.bodies[0].nodeCount")
        share, metres = position_error(browser, folder / "run.h5", told["frames"])
        if arguments.picture:
            browser.run("nbdtree.choose('colour', 'von Mises stress'); nbdtree.seek(60)")
            arguments.picture.write_bytes(browser.screenshot())
        row = {"surface": arguments.surface.stem, "faces": told["faces"], "nodes": nodes, "frames": told["frames"],
               "recording_bytes": (folder / "run.h5").stat().st_size, "page_bytes": told["bytes"],
               "written_s": f"{told['seconds']:.2f}", "shown_s": f"{statistics.median(seconds):.2f}",
               "shown_worst_s": f"{max(seconds):.2f}", "error_of_box": f"{share:.3e}", "allowed_of_box": f"{1 / 65535:.3e}",
               "error_m": f"{metres:.3e}"}
    table = ",".join(row) + "\n" + ",".join(map(str, row.values())) + "\n"
    if arguments.output:
        arguments.output.write_text(table)
    print(table, end="")


if __name__ == "__main__":
    main()
