#!/usr/bin/env python3
"""Makes calls of the operating system fail, or ends the process there, one call in turn after the other, in commands of
nbdtree, and checks what is left.

    attack.py --program build/release/apps/nbdtree --library libfailing_calls.so [--commands simulate ...]
              [--calls write ...] [--each 40] [--kills 200] [--seed 1] [--csv faults.csv]

For each command and each kind of call, a first run counts the calls; then each of them fails, or --each of them, evenly
spread, where there are more. After every fault
  - the command has exit status 1 and one line on standard error, or status 0, none, and the results of an undisturbed
    run; warnings do not count;
  - a file that stood under the output's name before is as it was, or is the whole result;
  - no temporary file is left by a command that ended by itself, and nothing but what the next run continues from;
    (where memory runs out in a destructor of nlohmann-json, C++ ends the program by SIGABRT: counted as aborted)
  - the same command (simulate: with --resume) makes the results of an undisturbed run, bit for bit.
--kills ends that many runs of each command at a random time instead. Exit status 1 if anything else happened.
"""

import argparse
import csv
import hashlib
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ASSETS = Path(__file__).resolve().parents[2] / "assets"
TIMEOUT = 120
ACTIONS = {"write": ["once", "from", "half", "kill"]}  # of other calls: once, kill; of allocations: once
OLD = b"an older file under this name\n"


class Command:
    """A command, its result, and what a run that was cut off may leave beside it for the next one."""

    def __init__(self, name, arguments, result, keeps=(), again=(), old=OLD):
        self.name, self.arguments, self.result = name, arguments, result
        self.keeps = keeps  # names, a folder with a slash at the end
        self.again = list(again)  # what is added to the arguments of the next run
        self.old = old  # what stands under the result's name before; None: what the inputs have there, if anything


COMMANDS = [
    Command("mesh", ["mesh", ASSETS / "ring.obj", "-o", "made.h5"], "made.h5"),
    Command("modes", ["modes", "body.h5", "-m", "12"], "body.h5", old=None),
    Command("dataset", ["dataset", "body.h5", "-o", "made.h5", "--trajectories", "2", "--frames", "2"], "made.h5",
            ["made.shards/"], old=None),
    Command("train", ["train", "body.h5", "poses.h5", "-o", "made.h5", "--depth", "3", "--bounds",
                      "nbd,learned_spheres", "--epochs", "2"], "made.h5", ["made.h5.checkpoint"]),
    Command("simulate", ["simulate", "scene.json", "-o", "made.h5", "--frames", "3"], "made.h5", ["made.h5.journal"],
            ["--resume"]),
    Command("export", ["export", "tree.h5", "--flat", "-o", "made.nbd"], "made.nbd"),
    Command("view", ["view", "poses.h5:0", "--body", "body.h5", "-o", "made.html"], "made.html"),
]


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


class Attack:
    def __init__(self, options):
        self.options = options
        self.rows = []
        self.failures = []

    def arguments(self, command):
        return [Path(self.options.program).resolve(), *command.arguments, "--quiet", "--threads", "1"]

    def fresh(self, inputs):
        """A folder with the inputs alone."""
        return Path(shutil.copytree(inputs, tempfile.mkdtemp(prefix="faults-"), dirs_exist_ok=True))

    def fresh_with_old(self, inputs, command):
        """A folder with the inputs and with an older file under the name of the command's result."""
        folder = self.fresh(inputs)
        if command.old is not None:
            (folder / command.result).write_bytes(command.old)
        return folder

    def report(self, command, what, message):
        self.failures.append(f"{command.name}, {what}: {message}")
        print(f"FAILED {self.failures[-1]}", flush=True)

    def check_fault(self, command, what, inputs, reference, environment, killed):
        """Runs the command with a fault, checks what is left, and runs it again without. Returns its exit status."""
        folder = self.fresh_with_old(inputs, command)
        result = folder / command.result
        try:
            before, old = listing(folder), digest(result)
            try:
                done = run(self.arguments(command), folder, environment)
            except subprocess.TimeoutExpired:
                self.report(command, what, f"hangs for {TIMEOUT} s")
                return None
            if killed and done.returncode == 0:
                return 0  # it ended before
            aborted = what.startswith("allocate") and done.returncode == -signal.SIGABRT
            if not killed and not aborted and done.returncode not in (0, 1):
                self.report(command, what, f"exit status {done.returncode}; {done.stderr[-300:]!r}")
            if not killed and done.returncode in (0, 1) and not has_expected_lines(done):
                self.report(command, what, f"exit status {done.returncode} with {done.stderr[-300:]!r}")
            found = digest(result)
            if done.returncode == 0 and found != reference:
                self.report(command, what, "exit status 0 without the result")
            if done.returncode != 0 and found not in (reference, old):
                self.report(command, what, "the file under the output's name is neither the old one nor the result")
            left = {name for name in listing(folder) - before - {command.result} if not kept(name, command)}
            if left and not killed and not aborted:
                self.report(command, what, f"left {sorted(left)}; {done.stderr[-200:]!r}")
            if done.returncode != 0:
                self.check_next_run(command, what, folder, reference)
            return done.returncode
        finally:
            shutil.rmtree(folder)

    def check_next_run(self, command, what, folder, reference):
        journal = any((folder / k).exists() for k in command.keeps)
        again = run(self.arguments(command) + (command.again if journal else []), folder)
        if again.returncode != 0:
            self.report(command, what, f"the next run failed: {again.stderr[-300:]!r}")
        elif digest(folder / command.result) != reference:
            self.report(command, what, "the next run made another result")
        elif any(name.endswith(".tmp") for name in listing(folder)):
            self.report(command, what, f"the next run left {[n for n in listing(folder) if n.endswith('.tmp')]}")

    def count(self, command, inputs, call):
        folder = self.fresh(inputs)
        try:
            done = run(self.arguments(command), folder, self.fault(call, 0, "once", folder / "count.txt"))
            if done.returncode != 0:
                raise RuntimeError(f"{command.name} fails by itself: {done.stderr}")
            return int((folder / "count.txt").read_text())
        finally:
            shutil.rmtree(folder)

    def fault(self, call, number, action, count=None):
        setting = {"LD_PRELOAD": str(Path(self.options.library).resolve()), "NBD_FAULT_CALL": call,
                   "NBD_FAULT_AT": str(number), "NBD_FAULT_ACTION": action}
        return setting | ({"NBD_FAULT_COUNT": str(count)} if count else {})

    def attack_calls(self, command, inputs, reference):
        for call in self.options.calls:
            calls = self.count(command, inputs, call)
            most = min(calls, self.options.each)
            numbers = sorted({1 + i * (calls - 1) // max(1, most - 1) for i in range(most)})
            for action in ["once"] if call == "allocate" else ACTIONS.get(call, ["once", "kill"]):
                before = len(self.failures)
                statuses = [self.check_fault(command, f"{call} {number} of {calls}, {action}", inputs, reference,
                                             self.fault(call, number, action), action == "kill")
                            for number in numbers]
                self.add_row(command, f"{call}, {action}", calls, statuses, before)

    def attack_times(self, command, inputs, reference):
        folder = self.fresh(inputs)
        start = time.monotonic()
        run(self.arguments(command), folder)
        duration = time.monotonic() - start
        shutil.rmtree(folder)
        draw = random.Random(f"{self.options.seed} {command.name}")
        before = len(self.failures)
        statuses = [self.kill_after(command, draw.uniform(0, duration), inputs, reference)
                    for _ in range(self.options.kills)]
        self.add_row(command, "killed at a random time", len(statuses), statuses, before)

    def kill_after(self, command, seconds, inputs, reference):
        folder = self.fresh_with_old(inputs, command)
        what, old = f"killed after {seconds:.4f} s", digest(folder / command.result)
        try:
            with subprocess.Popen([str(a) for a in self.arguments(command)], cwd=folder, stdin=subprocess.DEVNULL,
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
                time.sleep(seconds)
                process.kill()
                status = process.wait()
            if digest(folder / command.result) not in (reference, old):
                self.report(command, what, "the file under the output's name is neither the old one nor the result")
            if status != 0:
                self.check_next_run(command, what, folder, reference)
            return status
        finally:
            shutil.rmtree(folder)

    def add_row(self, command, fault, calls, statuses, failures_before):
        failed = len(self.failures) - failures_before
        row = {"command": command.name, "fault": fault, "calls": calls, "faults": len(statuses),
               "ended_with_1": statuses.count(1), "ended_with_0": statuses.count(0),
               "aborted": statuses.count(-signal.SIGABRT), "wrong": failed}
        self.rows.append(row)
        print("  ".join(f"{k} {v}" for k, v in row.items()), flush=True)


def make_inputs(folder, program):
    """A body, poses, a tree and a scene, small enough for some thousand runs."""
    def make(*arguments):
        done = run([Path(program).resolve(), *arguments, "--quiet"], folder)
        if done.returncode != 0:
            raise SystemExit(done.stderr)

    make("mesh", ASSETS / "block.mesh", "-o", "body.h5")
    make("modes", "body.h5", "-m", "8")
    make("dataset", "body.h5", "-o", "poses.h5", "--trajectories", "10", "--frames", "30")
    make("train", "body.h5", "poses.h5", "-o", "tree.h5", "--depth", "3", "--bounds", "learned_spheres")
    (folder / "scene.json").write_text(
        '{"bodies": [{"body": "body.h5", "transform": {"translate": [0, 0, 0.3]}},'
        ' {"body": "body.h5", "transform": {"translate": [0, 0.02, 0.55]}}],'
        ' "obstacles": [{"plane": {"normal": [0, 0, 1]}}]}')


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--library", required=True)
    parser.add_argument("--commands", nargs="+", choices=[c.name for c in COMMANDS], default=[c.name for c in COMMANDS])
    calls = ["open", "read", "write", "sync", "truncate", "rename", "mkdir", "map", "allocate"]
    parser.add_argument("--calls", nargs="*", choices=calls, default=calls)
    parser.add_argument("--each", type=int, default=40, help="at most so many faults of each kind of call")
    parser.add_argument("--kills", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--csv")
    attack = Attack(options := parser.parse_args())

    with tempfile.TemporaryDirectory(prefix="faults-inputs-") as folder:
        inputs = Path(folder)
        make_inputs(inputs, options.program)
        for command in (c for c in COMMANDS if c.name in options.commands):
            undisturbed = attack.fresh(inputs)
            done = run(attack.arguments(command), undisturbed)
            if done.returncode != 0:
                raise SystemExit(f"{command.name} fails without a fault: {done.stderr}")
            reference = digest(undisturbed / command.result)
            shutil.rmtree(undisturbed)
            attack.attack_calls(command, inputs, reference)
            if options.kills:
                attack.attack_times(command, inputs, reference)

    if options.csv:
        with open(options.csv, "w", newline="") as file:
            writer = csv.DictWriter(file, attack.rows[0].keys(), lineterminator="\n")
            writer.writeheader()
            writer.writerows(attack.rows)
    faults = sum(row["faults"] for row in attack.rows)
    print(f"{faults} faults, {len(attack.failures)} wrong")
    sys.exit(1 if attack.failures or faults == 0 else 0)


if __name__ == "__main__":
    main()
