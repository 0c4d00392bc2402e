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
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from commands import COMMANDS, TIMEOUT, Checks, add_old, digest, fresh, listing, make_inputs, run

ACTIONS = {"write": ["once", "from", "half", "kill"]}  # of other calls: once, kill; of allocations: once


class Attack(Checks):
    def __init__(self, options):
        super().__init__(options.program)
        self.options = options

    def check_fault(self, command, what, inputs, reference, environment, killed):
        """Runs the command with a fault, checks what is left, and runs it again without. Returns its exit status."""
        folder = fresh(inputs)
        try:
            add_old(folder, command)
            before, old = listing(folder), digest(folder / command.result)
            try:
                done = run(self.arguments(command), folder, environment)
            except subprocess.TimeoutExpired:
                self.report(command, what, f"hangs for {TIMEOUT} s")
                return None
            if killed and done.returncode == 0:
                return 0  # it ended before
            aborted = what.startswith("allocate") and done.returncode == -signal.SIGABRT
            if killed or aborted:
                self.check_result(command, what, folder, (reference[command.result], old))
            else:
                self.check_end(command, what, done, folder, before, old, reference)
            if done.returncode != 0:
                self.check_next_run(command, what, folder, reference)
            return done.returncode
        finally:
            shutil.rmtree(folder)

    def count(self, command, inputs, call):
        folder = fresh(inputs)
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
                self.add_fault_row(command, f"{call}, {action}", calls, statuses, before)

    def attack_times(self, command, inputs, reference):
        folder = fresh(inputs)
        start = time.monotonic()
        run(self.arguments(command), folder)
        duration = time.monotonic() - start
        shutil.rmtree(folder)
        draw = random.Random(f"{self.options.seed} {command.name}")
        before = len(self.failures)
        statuses = [self.kill_after(command, draw.uniform(0, duration), inputs, reference)
                    for _ in range(self.options.kills)]
        self.add_fault_row(command, "killed at a random time", len(statuses), statuses, before)

    def kill_after(self, command, seconds, inputs, reference):
        folder = fresh(inputs)
        try:
            add_old(folder, command)
            what, old = f"killed after {seconds:.4f} s", digest(folder / command.result)
            with subprocess.Popen([str(a) for a in self.arguments(command)], cwd=folder, stdin=subprocess.DEVNULL,
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
                time.sleep(seconds)
                process.kill()
                status = process.wait()
            self.check_result(command, what, folder, (reference[command.result], old))
            if status != 0:
                self.check_next_run(command, what, folder, reference)
            return status
        finally:
            shutil.rmtree(folder)

    def add_fault_row(self, command, fault, calls, statuses, failures_before):
        self.add_row(command=command.name, fault=fault, calls=calls, faults=len(statuses), ended_with_1=statuses.count(1),
                     ended_with_0=statuses.count(0), aborted=statuses.count(-signal.SIGABRT),
                     wrong=len(self.failures) - failures_before)


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
            reference = attack.undisturbed(command, inputs)
            attack.attack_calls(command, inputs, reference)
            if options.kills:
                attack.attack_times(command, inputs, reference)

    if options.csv:
        attack.save_rows(options.csv)
    faults = sum(row["faults"] for row in attack.rows)
    print(f"{faults} faults, {len(attack.failures)} wrong")
    sys.exit(1 if attack.failures or faults == 0 else 0)


if __name__ == "__main__":
    main()
