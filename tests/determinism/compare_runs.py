#!/usr/bin/env python3
"""Runs scenes in several ways and compares the bits of every frame.

    compare_runs.py PROGRAM [--others "clang 16=OTHER_PROGRAM" ...] [--scenes rings pile ...] [--frames 10] [--csv determinism.csv]

Each scene runs on one thread and on two, with every instruction set of the collision kernels that the processor has, and
with the programs of --others, built by another compiler or without optimisation. All frames must have the same bits: exit
status 1 if one differs. The column `hash` is 16 hex digits over all frames.

Exit status 77, for ctest: h5py is not there.
"""

import argparse
import csv
import hashlib
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    import h5py
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

SCENES = Path(__file__).resolve().parents[2] / "assets" / "scenes"
SETS = ["plain", "avx2", "avx512", "neon"]


def known_scenes():
    return sorted(p.stem for p in SCENES.glob("*.json"))


def hashes(program, scene, frames, arguments):
    """A hash of each frame's positions of all bodies; None if the processor lacks the instructions."""
    with tempfile.TemporaryDirectory(prefix="determinism-") as folder:
        run = Path(folder) / "run.h5"
        done = subprocess.run([program, "simulate", SCENES / f"{scene}.json", "-o", run, "--frames", str(frames), "--quiet",
                               *arguments], capture_output=True, text=True)
        if "this CPU does not support these instructions" in done.stderr:
            return None
        if done.returncode != 0:
            raise SystemExit(f"{scene} {' '.join(arguments)}: {done.stderr}")
        with h5py.File(run) as file:
            bodies = [file["trajectories"][name]["positions"] for name in sorted(file["trajectories"])]
            return [hashlib.sha256(b"".join(x[f].tobytes() for x in bodies)).hexdigest() for f in range(len(bodies[0]))]


def of_all(frames):
    """A short hash over those of all frames."""
    return hashlib.sha256("".join(frames).encode()).hexdigest()[:16]


def first_difference(frames, reference):
    if len(frames) != len(reference):
        return 0
    return next((i for i, (a, b) in enumerate(zip(frames, reference)) if a != b), None)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--others", nargs="*", default=[], metavar="NAME=PROGRAM")
    parser.add_argument("--scenes", nargs="+", choices=known_scenes(), default=known_scenes())
    parser.add_argument("--frames", type=int, default=10)
    parser.add_argument("--csv")
    options = parser.parse_args()

    others = [other.split("=", 1) for other in options.others]
    rows, wrong = [], 0
    for scene in options.scenes:
        reference = hashes(options.program, scene, options.frames, ["--threads", "1"])
        ways = [("two threads", options.program, ["--threads", "2"])]
        ways += [(f"kernels {s}", options.program, ["--threads", "1", "--instructions", s]) for s in SETS]
        ways += [(name, other, ["--threads", "1"]) for name, other in others]
        for name, program, arguments in ways:
            frames = hashes(program, scene, options.frames, arguments)
            place = None if frames is None else first_difference(frames, reference)
            wrong += place is not None
            rows.append({"scene": scene, "frames": len(reference), "compared": name,
                         "result": "not run" if frames is None else
                         "same bits" if place is None else f"differs from frame {place}",
                         "hash": "" if frames is None else of_all(frames)})
            print("  ".join(f"{k} {v}" for k, v in rows[-1].items()), flush=True)
        if len(set(reference)) < len(reference):
            raise SystemExit(f"{scene}: nothing moves, so the comparison shows nothing")
    if options.csv:
        with open(options.csv, "w", newline="") as file:
            writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    print(f"{len(rows)} comparisons, {wrong} wrong")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
