#!/usr/bin/env python3
"""Gives nbdtree a long run, many bodies, many trajectories and a large recording, and checks that memory stays bounded.

    load.py NBDTREE [--only steps pile dataset recording] [--scale 1] [--folder DIR] [--csv load.csv]

  steps      200,000 steps of two boxes of 27 nodes: one turns on the other, which lies on a plane. Steps of
             dt 0.005 s, in 100 frames, without and with --live. Memory grows by 2 MB at most after a tenth of the run;
             all positions are finite, and the boxes are where they were.
  pile       1,000 boxes of 27 nodes fall into a pile between four walls, 40 frames of two steps. Memory is 1 MB a box
             at most, beside 100 MB, and 0.05 MB for `inspect --check`; all positions are finite, none below the plane.
  dataset    2,000 trajectories of a box, two frames each, in shards of 16. `inspect --check` finds them whole. Memory of
             both commands is that of 200 trajectories, 32 MB that HDF5 keeps of names at most, and 16 kB for each further
             trajectory: its recipe, times and counts.
  recording  A recording of 10 GB of a body of 10,000 nodes, 83,000 frames in 40 trajectories, is read by every command
             that reads recordings within 500 MB. It takes as much room in --folder; those that keep frames are told to
             keep 50 or 100 MiB.
             With --scale below 0.1 the body has 216 nodes.

--scale multiplies these numbers of steps, boxes, trajectories and bytes, but not the bounds on memory. All commands run on
one thread. Memory is the peak of the resident set (ru_maxrss), of `steps` VmRSS over the run: libraries count, what the
system caches of files does not. Attacks that need h5py are skipped without it. Columns: size, in what the attack counts;
seconds; mb, of `steps` the growth; allowed_mb; wrong; notes. Exit status 1 if a bound is broken or a run is wrong, 77 if
all attacks were skipped.
"""

import argparse
import csv
import importlib.util
import itertools
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ATTACKS = ["steps", "pile", "dataset", "recording"]
ASSETS = Path(__file__).resolve().parents[2] / "assets"
RECORDINGS = Path(__file__).with_name("recordings.py")
BOX = 0.1  # edge of a box, metres
PLANE = {"plane": {"normal": [0, 0, 1]}}


class Measured:
    """An ended command: its exit status, its seconds, its peak of resident memory in MB, and what it printed."""

    def __init__(self, arguments, folder, watch=None, environment=None):
        """watch: called with the process id, every 20 ms."""
        with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
            start = time.monotonic()
            process = subprocess.Popen([str(a) for a in arguments], cwd=folder, stdin=subprocess.DEVNULL, stdout=out,
                                       stderr=err, env={**os.environ, **(environment or {})})
            while (ended := os.wait4(process.pid, os.WNOHANG))[0] == 0:
                if watch:
                    watch(process.pid)
                time.sleep(0.02)
            self.seconds = time.monotonic() - start
            self.status = process.returncode = os.waitstatus_to_exitcode(ended[1])
            self.mb = ended[2].ru_maxrss / 1000
            out.seek(0)
            err.seek(0)
            self.out, self.err = out.read(), err.read()

    def failure(self):
        return "" if self.status == 0 else f"exit status {self.status}, {self.err[-300:]!r}"


def resident_mb(pid):
    """VmRSS of a process; 0 if it has ended."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1000
    return 0


def length_of(path):
    """0 if there is no such file."""
    try:
        return path.stat().st_size
    except FileNotFoundError:
        return 0


def box_mesh(cells, edge):
    """A box of cells^3 cubes, six tetrahedra each, in Medit's format."""
    side = cells + 1
    nodes = [" ".join(f"{edge * (i / cells - 0.5):.9g}" for i in at) + " 0"
             for at in itertools.product(range(side), repeat=3)]
    tets = []
    for cell in itertools.product(range(cells), repeat=3):
        for order in itertools.permutations(range(3)):
            at, corners = list(cell), []
            for axis in [None, *order]:
                if axis is not None:
                    at[axis] += 1
                corners.append(1 + (at[0] * side + at[1]) * side + at[2])
            if order not in [(0, 1, 2), (1, 2, 0), (2, 0, 1)]:
                corners[:2] = corners[1::-1]  # an odd order mirrors the tetrahedron
            tets.append(" ".join(map(str, corners)) + " 1")
    return "\n".join(["MeshVersionFormatted 2", "Dimension 3", "Vertices", str(len(nodes)), *nodes, "Tetrahedra",
                      str(len(tets)), *tets, "End", ""])


def turning_scene(seconds):
    """A box on a plane between walls, and one on it that is held at its top and turns by 36 degrees a second."""
    top = {"box": {"min": [-BOX, -BOX, 1.98 * BOX], "max": [BOX, BOX, 3 * BOX]}}
    turn = {"axis": [0, 0, 1], "degrees": 36 * seconds}
    return {"bodies": [{"body": "box.h5", "transform": {"translate": [0, 0, 0.5005 * BOX]}},
                       {"body": "box.h5", "transform": {"translate": [0, 0, 1.501 * BOX]},
                        "grips": [{"region": top, "centre": [0, 0, 2 * BOX], "rotate": turn, "duration": seconds}]}],
            "obstacles": [PLANE, *walls(BOX)]}


def walls(distance):
    return [{"plane": {"point": [-distance * n for n in normal], "normal": normal}}
            for normal in ([1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0])]


def pile_scene(count, seed):
    """Boxes in layers, turned at random and without contact, between walls."""
    draw, space = random.Random(seed), 1.75 * BOX
    side = max(1, round(count ** (1 / 3)))
    bodies = []
    for i in range(count):
        at = [i % side - (side - 1) / 2, i // side % side - (side - 1) / 2, i // side ** 2 + 0.55]
        rotate = {"axis": [draw.uniform(-1, 1), draw.uniform(-1, 1), 1], "degrees": draw.uniform(0, 360)}
        bodies.append({"body": "box.h5", "transform": {"translate": [space * x for x in at], "rotate": rotate},
                       "velocity": [0, 0, -1]})
    return {"bodies": bodies, "obstacles": [PLANE, *walls(space * side / 2 + BOX / 2)]}


class Load:
    """The attacks, each of which adds rows to the table."""

    def __init__(self, options, folder):
        self.program, self.folder, self.scale = options.program.resolve(), folder, options.scale
        self.rows = []

    def nbdtree(self, *arguments, watch=None, environment=None):
        return Measured([self.program, *arguments, "--threads", "1", "--json"], self.folder, watch, environment)

    def make(self, *arguments):
        done = self.nbdtree(*arguments)
        if done.status != 0:
            raise SystemExit(done.err)

    def make_box(self):
        (self.folder / "box.mesh").write_text(box_mesh(2, BOX))
        self.make("mesh", "box.mesh", "-o", "box.h5")
        self.make("modes", "box.h5", "-m", "8")

    def scaled(self, number, least):
        return max(least, round(number * self.scale))

    def span(self, recording):
        """See recordings.py."""
        done = subprocess.run([sys.executable, RECORDINGS, "span", recording], cwd=self.folder, check=True,
                              stdout=subprocess.PIPE)
        return json.loads(done.stdout)

    def add_row(self, attack, size, done, allowed_mb, mb=None, wrong="", notes=""):
        """wrong: what is, besides the memory and the exit status."""
        mb = done.mb if mb is None else mb
        found = [done.failure(), wrong, f"{mb:.1f} MB; allowed: {allowed_mb:.1f}" if mb > allowed_mb else ""]
        row = {"attack": attack, "size": size, "seconds": f"{done.seconds:.1f}", "mb": f"{mb:.1f}",
               "allowed_mb": f"{allowed_mb:.1f}", "wrong": "; ".join(w for w in found if w), "notes": notes}
        self.rows.append(row)
        print("  ".join(f"{k} {v}" for k, v in row.items() if v != ""), flush=True)

    def attack_steps(self):
        self.make_box()
        frames, per_frame = 100, self.scaled(2000, 10)
        steps = frames * per_frame
        scene = turning_scene(0.005 * steps) | {"time": {"dt": 0.005, "frames": frames, "steps_per_frame": per_frame}}
        (self.folder / "turning.json").write_text(json.dumps(scene))
        for name, live in [("steps", []), ("steps --live", ["--live", "0"])]:
            resident = {}  # memory at frames at which the run waits to be measured

            def measure(pid):
                for frame in (frames // 10, frames):
                    go_on = self.folder / f"{name} {frame}"
                    if frame not in resident and go_on.with_name(f"{go_on.name}.waits").exists():
                        resident[frame] = resident_mb(pid)
                        go_on.touch()

            at = ";".join(f"frames|{frame}|wait|{name} {frame}" for frame in (frames // 10, frames))
            done = self.nbdtree("simulate", "turning.json", "-o", "turning.h5", *live, watch=measure,
                                environment={"NBDTREE_AT": at})
            tenth, end = resident.get(frames // 10, 0), resident.get(frames, 0)
            wrong, notes = "", f"{tenth:.1f} MB at a tenth, {end:.1f} at the end"
            if done.status == 0:
                wrong = self.wrong_place("turning.h5", frames + 1, [-1.1 * BOX, -1.1 * BOX, -0.05 * BOX],
                                         [1.1 * BOX, 1.1 * BOX, 2.1 * BOX])
                if (touching := json.loads(done.out)["frames_in_contact"]) != frames:
                    wrong = wrong or f"contacts in {touching} frames; allowed: all {frames}"
            self.add_row(name, steps, done, 2, end - tenth, wrong, notes)

    def wrong_place(self, recording, frames, low, high):
        """What is wrong with a recording that should have so many frames, the last of them within a box."""
        found = self.span(recording)
        if not found["finite"]:
            return "positions are not finite"
        if found["frames"] != frames:
            return f"{found['frames']} frames; allowed: {frames}"
        if any(x < least for x, least in zip(found["low"], low)) or any(x > most for x, most in zip(found["high"], high)):
            return f"bodies from {found['low']} to {found['high']}; allowed: {low} to {high}"
        return ""

    def attack_pile(self):
        self.make_box()
        boxes, frames = self.scaled(1000, 8), 40
        scene = pile_scene(boxes, 1) | {"time": {"dt": 0.005, "frames": frames, "steps_per_frame": 2}}
        (self.folder / "pile.json").write_text(json.dumps(scene))
        done = self.nbdtree("simulate", "pile.json", "-o", "pile.h5", "--csv", "pile.csv")
        wrong = notes = ""
        if done.status == 0:
            most = max(obstacle["plane"]["point"][1] for obstacle in scene["obstacles"][1:]) + 0.5 * BOX
            wrong = self.wrong_place("pile.h5", frames + 1, [-most, -most, -0.5 * BOX], [most, most, 100])
            steps = list(csv.DictReader((self.folder / "pile.csv").open()))
            ms = sum(float(v) for step in steps for k, v in step.items()
                     if k in ("update_us", "collision_us", "detect_us", "assemble_us", "solve_us", "rest_us")) / 1000
            result = json.loads(done.out)
            if int(steps[-1]["contacts"]) < boxes:
                wrong = wrong or f"only {steps[-1]['contacts']} contacts"
            notes = f"{ms / len(steps):.0f} ms a step, {steps[-1]['contacts']} contacts at the end, " \
                    f"{result['troubled_steps']} troubled steps"
        self.add_row("pile", boxes, done, 100 + boxes, wrong=wrong, notes=notes)
        self.add_row("pile: inspect --check", boxes, self.nbdtree("inspect", "--check", "pile.h5"), 100 + 0.05 * boxes,
                     notes=f"recording of {length_of(self.folder / 'pile.h5') / 1e6:.0f} MB")

    def attack_dataset(self):
        self.make_box()
        few, many = self.scaled(200, 4), self.scaled(2000, 40)
        for command, arguments in [("dataset", ["dataset", "box.h5", "--frames", "2", "--steps-per-frame", "1"]),
                                   ("inspect --check", ["inspect", "--check"])]:
            allowed = 500
            for count in (few, many):
                more = ["-o", f"{count}.h5", "--trajectories", count] if command == "dataset" else [f"{count}.h5"]
                done = self.nbdtree(*arguments, *more)
                self.add_row(f"dataset: {command}", count, done, allowed)
                allowed = done.mb + 32 + 0.016 * (many - few)

    def attack_recording(self):
        size = self.scaled(10_000_000_000, 0)
        surface = [ASSETS / "beam.obj", "--nodes", "10000"] if self.scale >= 0.1 else [ASSETS / "block.mesh"]
        self.make("mesh", *surface, "-o", "body.h5")
        self.make("mesh", "body.h5", "--subdivide", "1", "-o", "fine.h5")
        self.make("modes", "body.h5", "-m", "8")
        self.make("dataset", "body.h5", "-o", "poses.h5", "--trajectories", "10", "--frames", "26",
                  "--steps-per-frame", "1")
        made = Measured([sys.executable, RECORDINGS, "long", "poses.h5", "long.h5", size], self.folder)
        if made.status != 0:
            raise SystemExit(made.err)
        print(f"made a recording of {(self.folder / 'long.h5').stat().st_size / 1e9:.2f} GB in {made.seconds:.0f} s",
              flush=True)
        self.make("train", "body.h5", "poses.h5", "-o", "tree.h5", "--epochs", "2")
        for line in ["inspect long.h5", "inspect --check long.h5 --body body.h5",
                     "evaluate tree.h5 long.h5 --bounds exact,nbd --margins 0 --max-frames 1000",
                     "evaluate tree.h5 long.h5 --bounds exact,nbd --margins 0",
                     "calibrate tree.h5 long.h5 -o calibrated.h5 --miss-rate 0.01 --memory 50",
                     "coverage tree.h5 long.h5 --contacts 5",
                     "remap long.h5 --from body.h5 --to fine.h5 -o fine_poses.h5 --trajectories 4",
                     "export long.h5:3 --body body.h5 --gltf clip.glb --frames 60",
                     "export long.h5:3 --body body.h5 --mdd clip.mdd",
                     "view long.h5:3:5 --body body.h5 -o pose.html", "view long.h5:3 --body body.h5 -o trajectory.html",
                     "view tree.h5@long.h5:3 -o tree.html",
                     "train body.h5 long.h5 -o long_tree.h5 --depth 3 --epochs 2 --memory 100",
                     "coverage long_tree.h5 long.h5 --contacts 0"]:
            self.add_row(f"recording: {line}", size, self.nbdtree(*line.split()), 500)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", metavar="NBDTREE", type=Path)
    parser.add_argument("--only", nargs="+", choices=ATTACKS, default=ATTACKS)
    parser.add_argument("--scale", type=float, default=1)
    parser.add_argument("--folder", help="for temporary files")
    parser.add_argument("--csv")
    options = parser.parse_args()

    rows = []
    has_h5py = importlib.util.find_spec("h5py") is not None
    for attack in options.only:
        if attack != "dataset" and not has_h5py:
            print(f"skipped {attack}: there is no h5py", flush=True)
            continue
        with tempfile.TemporaryDirectory(prefix="load-", dir=options.folder) as folder:
            load = Load(options, Path(folder))
            getattr(load, f"attack_{attack}")()
            rows += load.rows
    if not rows:
        sys.exit(77)
    if options.csv:
        with open(options.csv, "w", newline="") as file:
            writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    wrong = sum(bool(row["wrong"]) for row in rows)
    print(f"{len(rows)} runs, {wrong} wrong")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
