#!/usr/bin/env python3
"""Runs scenes in several ways and compares the bits of every frame.

    compare_runs.py PROGRAM [--others OTHER_BUILD ...] [--scenes rings pile ...] [--frames 10] [--csv determinism.csv]

Each scene runs on one thread and on two, and with every instruction set of the collision kernels that the processor
has; all frames must have the same bits: exit status 1 if one differs. Programs of --others, built with another compiler
or without optimisation, are compared as well; the table says from which frame on they differ, which is no error: the
compiler may fuse products. Its columns `reference` and `hash` are 16 hex digits over all frames, of the run on one thread
and of the one that is compared with it.

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
SETS = ["plain", "avx2", "avx512"]


def known_scenes():
    return sorted(p.stem for p in SCENES.glob("*.json") if p.stem not in ("scene.schema", "demo"))


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
    parser.add_argument("--others", nargs="*", default=[])
    parser.add_argument("--scenes", nargs="+", choices=known_scenes(), default=known_scenes())
    parser.add_argument("--frames", type=int, default=10)
    parser.add_argument("--csv")
    options = parser.parse_args()

    rows, wrong = [], 0
    for scene in options.scenes:
        reference = hashes(options.program, scene, options.frames, ["--threads", "1"])
        ways = [("two threads", options.program, ["--threads", "2"])]
        ways += [(f"kernels {s}", options.program, ["--threads", "1", "--instructions", s]) for s in SETS]
        ways += [(other, other, ["--threads", "1"]) for other in options.others]
        for name, program, arguments in ways:
            frames = hashes(program, scene, options.frames, arguments)
            place = None if frames is None else first_difference(frames, reference)
            differs = frames is not None and place is not None
            wrong += differs and program == options.program
            rows.append({"scene": scene, "frames": len(reference), "compared": name,
                         "result": "not run" if frames is None else f"differs from frame {place}" if differs else "same bits",
                         "reference": of_all(reference), "hash": "" if frames is None else of_all(frames)})
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
