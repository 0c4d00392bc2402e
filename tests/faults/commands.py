"""What the attacks of this folder share: commands of nbdtree on small inputs, and checks of what a disturbed run leaves."""

import csv
import hashlib
import os
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path

ASSETS = Path(__file__).resolve().parents[2] / "assets"
TIMEOUT = 1800  # seconds after which a run counts as hanging
OLD = b"an older file under this name\n"
FAILED_RUN = "failed_run.h5"  # of the inputs: all that a run with --resume replaces, besides what it continues


class Command:
    """A command, its result, and what a run that was cut off may leave beside it for the next one."""

    def __init__(self, name, arguments, result, keeps=(), again=(), old=OLD):
        self.name, self.arguments, self.result = name, arguments, result
        self.keeps = keeps  # names, a folder with a slash at the end
        self.again = list(again)  # what is added to the arguments of the next run
        # What stands under the result's name before: bytes, or the name of an input; None: what the inputs have there, if
        # anything.
        self.old = old


COMMANDS = [
    Command("mesh", ["mesh", ASSETS / "beam.obj", "-o", "made.h5", "--elements", "linear"], "made.h5"),
    Command("modes", ["modes", "body.h5", "-m", "12"], "body.h5", old=None),
    Command("dataset", ["dataset", "body.h5", "-o", "made.h5", "--trajectories", "2", "--frames", "2"], "made.h5",
            ["made.shards/"], old=None),
    Command("train", ["train", "body.h5", "poses.h5", "-o", "made.h5", "--depth", "3", "--bounds",
                      "nbd,learned_affine", "--epochs", "2"], "made.h5", ["made.h5.checkpoint"]),
    Command("simulate", ["simulate", "scene.json", "-o", "made.h5", "--frames", "3"], "made.h5", ["made.h5.journal"],
            ["--resume"], old=FAILED_RUN),
    Command("export", ["export", "tree.h5", "--flat", "-o", "made.nbd"], "made.nbd"),
    Command("view", ["view", "poses.h5:0", "--body", "body.h5", "-o", "made.html"], "made.html"),
]

# Commands that work for a while, so that they can be met at it.
DATASET = Command("dataset", ["dataset", "body.h5", "-o", "made.h5", "--trajectories", "6", "--frames", "12",
                              "--per-shard", "2"], "made.h5", ["made.shards/"], old=None)
TRAIN = Command("train", ["train", "body.h5", "poses.h5", "-o", "made.h5", "--depth", "4", "--bounds",
                          "nbd,learned_affine", "--epochs", "60"], "made.h5", ["made.h5.checkpoint"])
SIMULATE = Command("simulate", ["simulate", "scene.json", "-o", "made.h5", "--frames", "40"], "made.h5",
                   ["made.h5.journal"], ["--resume"], old=FAILED_RUN)
# Every command, with all tables that it can write.
EVERY = [Command(line.split()[0], [*line.replace("assets/", f"{ASSETS}/").split(), "--json"], None) for line in [
    "mesh assets/beam.obj -o made.h5 --elements linear", "modes body.h5 -m 12 --csv made.csv",
    "dataset body.h5 -o made.h5 --trajectories 2 --frames 2 --csv made.csv",
    "remap poses.h5 --from body.h5 --to body.h5 -o made.h5",
    "train body.h5 poses.h5 -o made.h5 --depth 3 --epochs 2", "calibrate tree.h5 poses.h5 -o made.h5 --miss-rate 0.01",
    "evaluate nbd.h5 poses.h5 --csv made.csv", "transfer nbd.h5 body.h5 -o made.h5",
    "coverage tree.h5 poses.h5 --contacts 5 --csv made.csv --contacts-csv contacts.csv",
    "simulate scene.json -o made.h5 --frames 3 --csv made.csv --vtu vtu --obj obj --picture made.png",
    "race scene.json --frames 2 --csv made.csv", "validate assets/scenes/rings.json",
    "collide assets/ring.obj assets/gear.obj --within 0.1 --pairs made.csv --view made.html",
    "inspect poses.h5 --check", "export tree.h5 --flat -o made.nbd", "export run.h5 --gltf made.glb",
    "export run.h5 --mdd made.mdd", "view run.h5 -o made.html"]]


def run(arguments, folder, environment=None, timeout=TIMEOUT):
    return subprocess.run([str(a) for a in arguments], cwd=folder, env={**os.environ, **(environment or {})},
                          stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=timeout)


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else None


def listing(folder):
    return {str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()}


def kept(name, command):
    return any(name.startswith(k) if k.endswith("/") else name == k for k in command.keeps)


def has_expected_lines(done):
    """Whether a run said nothing but warnings and, if its exit status is 1, one line of error: no library's messages."""
    lines = [line for line in done.stderr.splitlines() if not line.startswith("nbdtree: warning: ")]
    if done.returncode == 0:
        return not lines
    return len(lines) == 1 and lines[0].startswith("nbdtree: error: ")


def state(folder, content=Path.read_bytes):
    """Digests of all files of a folder by their names. content: reads what is to be the same of a file."""
    return {name: hashlib.sha256(content(folder / name)).hexdigest()
            for name in sorted(listing(folder)) if not name.endswith("/.claims")}  # claims are locks and hold nothing


def fresh(inputs):
    """A folder with the inputs alone."""
    return Path(shutil.copytree(inputs, tempfile.mkdtemp(prefix="faults-"), dirs_exist_ok=True))


def add_old(folder, command):
    """Puts an older file under the name of the command's result."""
    if command.old is not None:
        old = command.old if isinstance(command.old, bytes) else (folder / command.old).read_bytes()
        (folder / command.result).write_bytes(old)


def make_inputs(folder, program):
    """A body, poses, a tree and a scene, small enough for some thousand runs."""
    def make(*arguments):
        done = run([Path(program).resolve(), *arguments, "--quiet"], folder)
        if done.returncode != 0:
            raise SystemExit(done.stderr)

    make("mesh", ASSETS / "block.mesh", "-o", "body.h5")
    make("modes", "body.h5", "-m", "8")
    make("dataset", "body.h5", "-o", "poses.h5", "--trajectories", "10", "--frames", "30")
    make("train", "body.h5", "poses.h5", "-o", "tree.h5", "--depth", "3", "--bounds", "learned_affine")
    (folder / "scene.json").write_text(
        '{"bodies": [{"body": "body.h5", "transform": {"translate": [0, 0, 0.504]}},'
        ' {"body": "body.h5", "transform": {"translate": [0, 0.02, 1.51]}}],'
        ' "obstacles": [{"plane": {"normal": [0, 0, 1]}}]}')
    (folder / "failing.json").write_text('{"bodies": [{"body": "body.h5", "angular_velocity": [0, 0, 1e6]}]}')
    failed = run([Path(program).resolve(), "simulate", "failing.json", "-o", FAILED_RUN, "--quiet"], folder)
    if failed.returncode != 1 or not (folder / FAILED_RUN).exists():
        raise SystemExit(f"a body that spins far too fast does not end a run: {failed.stderr}")


def make_all_inputs(folder, program):
    """Those of make_inputs() and what the other commands of EVERY read: a tree with networks and a run."""
    make_inputs(folder, program)
    for line in ["train body.h5 poses.h5 -o nbd.h5 --depth 3 --epochs 2", "simulate scene.json -o run.h5 --frames 3"]:
        run([Path(program).resolve(), *line.split(), "--quiet"], folder).check_returncode()


class Checks:
    """Checks of runs, which collect what was wrong and the rows of a table."""

    def __init__(self, program):
        self.program = Path(program).resolve()
        self.rows = []
        self.failures = []

    def arguments(self, command):
        return [self.program, *command.arguments, "--quiet", "--threads", "1"]

    def report(self, command, what, message):
        self.failures.append(f"{command.name}, {what}: {message}")
        print(f"FAILED {self.failures[-1]}\n  {shlex.join(str(a) for a in self.arguments(command))}", flush=True)

    def undisturbed(self, command, inputs):
        """The state of the folder after a run without a fault."""
        folder = fresh(inputs)
        try:
            done = run(self.arguments(command), folder)
            if done.returncode != 0:
                raise SystemExit(f"{command.name} fails without a fault: {done.stderr}")
            return state(folder)
        finally:
            shutil.rmtree(folder)

    def check_result(self, command, what, folder, allowed):
        if digest(folder / command.result) not in allowed:
            self.report(command, what, "the file under the output's name is neither the old one nor the result")

    def check_end(self, command, what, done, folder, before, old, reference):
        """Checks a run that ended by itself, with status 0 or 1. before, old: the files and the result's digest before."""
        if done.returncode not in (0, 1) or not has_expected_lines(done):
            self.report(command, what, f"exit status {done.returncode} with {done.stderr[-300:]!r}")
        if done.returncode == 0 and digest(folder / command.result) != reference[command.result]:
            self.report(command, what, "exit status 0 without the result")
        self.check_result(command, what, folder, (reference[command.result], old))
        if left := {n for n in listing(folder) - before - {command.result} if not kept(n, command)}:
            self.report(command, what, f"left {sorted(left)}; {done.stderr[-200:]!r}")

    def check_next_run(self, command, what, folder, reference, launcher=()):
        """Runs the command again, without a fault: the folder must be that of an undisturbed run."""
        journal = any((folder / k).exists() for k in command.keeps)
        again = run([*launcher, *self.arguments(command), *(command.again if journal else [])], folder)
        what = f"{what}; the next run{', ' if launcher else ''}{' '.join(launcher)}"
        if again.returncode != 0:
            self.report(command, what, f"exit status {again.returncode}, {again.stderr[-300:]!r}")
        else:
            self.check_state(command, what, state(folder), reference)

    def check_state(self, command, what, found, reference):
        if differing := sorted(n for n in found.keys() | reference.keys() if found.get(n) != reference.get(n)):
            self.report(command, what, f"left other files than an undisturbed run: {differing}")

    def add_row(self, **row):
        self.rows.append(row)
        print("  ".join(f"{k} {v}" for k, v in row.items()), flush=True)

    def save_rows(self, path):
        with open(path, "w", newline="") as file:
            writer = csv.DictWriter(file, self.rows[0].keys(), lineterminator="\n")
            writer.writeheader()
            writer.writerows(self.rows)
