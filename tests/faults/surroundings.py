#!/usr/bin/env python3
"""Attacks nbdtree from its surroundings and checks that no run is wrong.

    surroundings.py NBDTREE [--only ranks two disk readonly clock locale] [--kills 50] [--seed 1] [--csv FILE]

  ranks     `dataset` runs under mpirun with three ranks. One of them, drawn at random, is killed at a random
            time; every second time mpirun lets the others go on. Then the same command runs again, in turns under mpirun
            and alone, and makes the files of an undisturbed run.
  two       Two runs of one command write one output at the same time. Each ends with status 0, or 1 and one line; at
            least one makes the result, and the folder is that of an undisturbed run.
  disk      The disk becomes full, at sizes from 16 KiB to one that suffices: one line, exit status 1, the older
            file as it was, and nothing left but what the next run continues from. With room, the same command makes the
            files of an undisturbed run.
  readonly  The folder cannot be written: one line and exit status 1; commands that write nothing work as ever.
  clock     Real time jumps by up to two days between its readings. Files, and what --json prints, are those of an
            undisturbed run; what they say of how long the work took is plausible, and so is the progress on a terminal.
  locale    Numbers of the locale have decimal commas: files and what --json prints are those of an undisturbed run.

--kills is the number of runs of each command in `ranks` and `two`, a fifth of it that of `clock`, and, up to 12, that of
sizes in `disk`. `disk` and `readonly` mount small file systems, which needs `unshare`. Attacks that cannot be made here
are skipped, with a message. Columns: runs; disturbed, runs that the attack kept from ending with status 0 (of `two`: of
which one did not); wrong. Exit status 1 if a run is wrong, 77 if all attacks were skipped.
"""

import argparse
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

from commands import COMMANDS, DATASET, EVERY, SIMULATE, TIMEOUT, TRAIN, Checks, add_old, digest, fresh, \
    has_expected_lines, listing, make_all_inputs, run, state
from comparison import comparable
from small_disk import continue_with_own_mounts, has_own_mounts, small_disk
from terminal import run_on_terminal

ATTACKS = ["ranks", "two", "disk", "readonly", "clock", "locale"]
TWICE = [DATASET, TRAIN, SIMULATE, *(c for c in COMMANDS if c.name in ("mesh", "export"))]
PRINTED = ["printed.json", "status.txt"]  # files for what a run printed, and for its exit status and its errors
MPIRUN = ["mpirun", "-n", "3", "--oversubscribe"]
os.environ |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "LC_ALL": "C"}


def ranks_in(folder):
    """Process ids of the ranks of nbdtree that work in a folder."""
    found = []
    for process in Path("/proc").iterdir():
        try:
            if process.name.isdigit() and os.readlink(process / "cwd") == str(folder) and \
                    os.readlink(process / "exe").endswith("/nbdtree"):
                found.append(int(process.name))
        except OSError:
            pass  # ended, or another user's
    return sorted(found)


def wait_until_gone(processes):
    """Waits for processes that were killed: mpirun ends before they do, and while one is there, its files are not
    abandoned."""
    end = time.monotonic() + TIMEOUT
    while any(Path(f"/proc/{process}").exists() for process in processes) and time.monotonic() < end:
        time.sleep(0.01)


class Surroundings(Checks):
    """The attacks, each of which adds rows to the table."""

    def __init__(self, options, inputs):
        super().__init__(options.program)
        self.options, self.inputs = options, inputs
        self.draw = random.Random(options.seed)
        self.usual = {}  # by command: the state of its folder after an undisturbed run, see state_after()

    def start(self, command, folder, launcher=()):
        words = [str(a) for a in [*launcher, *self.arguments(command)]]
        return subprocess.Popen(words, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                text=True, errors="backslashreplace")

    def end_of(self, process, command, what):
        """Waits for the end of a run. Returns it with what it printed."""
        try:
            out, err = process.communicate(timeout=TIMEOUT)
        except subprocess.TimeoutExpired:
            self.report(command, what, f"hangs for {TIMEOUT} s")
            process.terminate()
            out, err = process.communicate()
        return subprocess.CompletedProcess(process.args, process.returncode, out, err)

    @contextmanager
    def row(self, attack, command):
        """Counts the runs of an attack, and how many of them ended with another status than 0."""
        counts, before = {"runs": 0, "disturbed": 0}, len(self.failures)
        def count(status):
            counts["runs"] += 1
            counts["disturbed"] += status != 0
        yield count
        self.add_row(attack=attack, command=command, **counts, wrong=len(self.failures) - before)

    @contextmanager
    def folder(self, command=None):
        folder = fresh(self.inputs)
        try:
            if command:
                add_old(folder, command)
            yield folder
        finally:
            shutil.rmtree(folder)

    def attack_ranks(self):
        for command in [DATASET]:
            reference = self.undisturbed(command, self.inputs)
            with self.folder() as folder:
                seconds, _ = self.kill_rank(MPIRUN, command, folder, None)
            with self.row("ranks", command.name) as count:
                for i in range(self.options.kills):
                    with self.folder(command) as folder:
                        old = digest(folder / command.result)
                        launcher = [*MPIRUN, *(["--enable-recovery"] if i // 2 % 2 else [])]
                        after = self.draw.uniform(0, seconds)
                        _, killed = self.kill_rank(launcher, command, folder, after)
                        what = f"{' '.join(launcher)}, {'a rank' if killed else 'none'} killed after {after:.4f} s"
                        self.check_result(command, what, folder, (reference[command.result], old))
                        self.check_next_run(command, what, folder, reference, MPIRUN if i % 2 else [])
                        count(killed)

    def kill_rank(self, launcher, command, folder, after):
        """Runs a command with three ranks and kills one, so many seconds after all had started; None: kills none.
        Returns for how many seconds they ran, and whether one was killed."""
        killed = False
        process = self.start(command, folder, launcher)
        while process.poll() is None and len(ranks_in(folder)) < 3:
            time.sleep(0.002)
        start = time.monotonic()
        started = ranks_in(folder)
        if after is not None:
            time.sleep(after)
            if ranks := ranks_in(folder):
                try:
                    os.kill(self.draw.choice(ranks), signal.SIGKILL)
                    killed = True
                except ProcessLookupError:
                    pass  # it has ended meanwhile
        done = self.end_of(process, command, " ".join(launcher))
        if done.returncode != 0 and not killed:
            self.report(command, " ".join(launcher), f"exit status {done.returncode}, {done.stderr[-300:]!r}")
        seconds = time.monotonic() - start
        wait_until_gone(started)
        return seconds, killed

    def attack_two(self):
        for command in TWICE:
            start = time.monotonic()
            reference = self.undisturbed(command, self.inputs)
            seconds = time.monotonic() - start
            with self.row("two", command.name) as count:
                for _ in range(self.options.kills):
                    after = self.draw.choice([0, self.draw.uniform(0, seconds)])
                    with self.folder(command) as folder:
                        what = f"twice, the second after {after:.4f} s"
                        first = self.start(command, folder)
                        time.sleep(after)
                        second = self.start(command, folder)
                        both = [self.end_of(first, command, what), self.end_of(second, command, what)]
                        for done in both:
                            if done.returncode not in (0, 1) or not has_expected_lines(done):
                                self.report(command, what, f"exit status {done.returncode} with {done.stderr[-300:]!r}")
                        if all(done.returncode != 0 for done in both):
                            self.report(command, what, f"neither made it: {[done.stderr[-200:] for done in both]}")
                        self.check_state(command, what, state(folder), reference)
                        count(max(done.returncode for done in both))

    def attack_disk(self):
        for command in COMMANDS:
            reference = self.undisturbed(command, self.inputs)
            with self.row("disk", command.name) as count:
                enough = 16 << 10
                while (status := self.run_with_room(command, enough, reference)) != 0 and enough < 1 << 30:
                    count(status)
                    enough *= 4
                sizes = min(12, self.options.kills)
                for i in range(sizes):
                    count(self.run_with_room(command, enough * (i + 1) // sizes, reference))

    def run_with_room(self, command, room, reference):
        with small_disk() as (folder, remount):
            shutil.copytree(self.inputs, folder, dirs_exist_ok=True)
            add_old(folder, command)
            what, before, old = f"{room} bytes free", listing(folder), digest(folder / command.result)
            remount(room)
            done = run(self.arguments(command), folder)
            self.check_end(command, what, done, folder, before, old, reference)
            remount(1 << 30)
            if done.returncode != 0:
                self.check_next_run(command, what, folder, reference)
            return done.returncode

    def attack_readonly(self):
        before = state(self.inputs)
        with self.row("readonly", "all") as count:
            for command in EVERY:
                writes = self.usual_state(command).keys() - set(PRINTED) != before.keys() or command.name == "modes"
                with small_disk() as (folder, remount):
                    shutil.copytree(self.inputs, folder, dirs_exist_ok=True)
                    remount(None)
                    done = run(self.arguments(command), folder)
                    if done.returncode != (1 if writes else 0) or not has_expected_lines(done):
                        self.report(command, "read-only", f"exit status {done.returncode} with {done.stderr[-300:]!r}")
                    self.check_state(command, "read-only", state(folder), before)
                    count(done.returncode)

    def attack_clock(self):
        seeds = range(max(1, self.options.kills // 5))
        self.attack_environments("clock", [self.jumps(seed) for seed in seeds])
        with self.row("clock", "progress") as count:
            for seed in seeds:
                count(self.show_progress(self.jumps(seed)))

    def jumps(self, seed):
        return {"LD_PRELOAD": str(self.options.clock), "NBD_CLOCK_SEED": str(self.options.seed * 1000 + seed)}

    def show_progress(self, environment):
        """Runs a long command on a terminal and checks the times that it shows. Returns its exit status."""
        with self.folder() as folder:
            words = [self.program, *SIMULATE.arguments, "--threads", "1"]
            # The run stays at a frame until the terminal shows it.
            held = {"NBDTREE_AT": "frames|20|wait|shown"}
            status, text, seconds = run_on_terminal(words, folder, environment | held, b" left", folder / "shown")
        shown = re.findall(r"(-?\d+):(\d\d) (left|so far)", text)
        if status != 0 or not shown:
            self.report(SIMULATE, "on a terminal", f"exit status {status}, {text[-300:]!r}")
        # What is left is estimated from frames, the slowest of which may take many times as long as the others.
        if any(not 0 <= 60 * int(m) + int(s) <= (100 * seconds if kind == "left" else seconds + 1) for m, s, kind in shown):
            self.report(SIMULATE, "on a terminal", f"shows {shown} in a run of {seconds:.1f} s")
        return status

    def attack_locale(self):
        with tempfile.TemporaryDirectory(prefix="faults-locale-") as folder:
            made = subprocess.run(["localedef", "-i", "de_DE", "-f", "UTF-8", f"{folder}/de_DE.UTF-8"], capture_output=True)
            german = {"LC_ALL": "de_DE.UTF-8", "LOCPATH": folder}
            if made.returncode > 1 or run(["/usr/bin/printf", "%.1f", "1,5"], folder, german).stdout != "1,5":
                return print(f"skipped locale: localedef makes none with decimal commas {made.stderr[-300:]!r}")
            self.attack_environments("locale", [german])

    def attack_environments(self, attack, environments):
        with self.row(attack, "all") as count:
            for command in EVERY:
                usual = self.usual_state(command)
                for environment in environments:
                    what = " ".join(f"{k}={v}" for k, v in environment.items())
                    self.check_state(command, what, self.state_after(command, environment)[0], usual)
                    count(0)

    def usual_state(self, command):
        """The state after an undisturbed run, which must print one JSON object."""
        if command not in self.usual:
            self.usual[command], printed = self.state_after(command, {})
            try:
                json.loads(printed)
            except ValueError:
                self.report(command, "undisturbed", f"prints no JSON: {printed[:100]!r}")
        return self.usual[command]

    def state_after(self, command, environment):
        """The folder after a run, with what it printed and its exit status in files beside the others; what it printed."""
        with self.folder() as folder:
            done = run(self.arguments(command), folder, environment)
            for name, text in zip(PRINTED, [done.stdout, f"{done.returncode}\n{done.stderr}"]):
                (folder / name).write_text(text)
            return state(folder, comparable), done.stdout


def skipped(attack):
    """Why an attack cannot be made here; None if it can."""
    needs = {"ranks": "mpirun", "disk": "mount", "readonly": "mount", "locale": "localedef"}.get(attack)
    if needs and not shutil.which(needs):
        return f"there is no {needs}"
    if needs == "mount" and not has_own_mounts():
        return "unshare is not permitted"
    if attack == "locale" and not Path("/usr/share/i18n/locales/de_DE").exists():
        return "there is no source of the locale de_DE (Debian: locales)"
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", metavar="NBDTREE", type=Path)
    parser.add_argument("--only", nargs="+", choices=ATTACKS, default=ATTACKS)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--clock", type=Path, help="libjumping_clock.so; default: that of the program's build")
    parser.add_argument("--csv")
    options = parser.parse_args()
    options.clock = (options.clock or options.program.resolve().parents[1] / "tests/faults/libjumping_clock.so").resolve()

    continue_with_own_mounts()

    with tempfile.TemporaryDirectory(prefix="faults-inputs-") as folder:
        inputs = Path(folder)
        make_all_inputs(inputs, options.program)
        attacks = Surroundings(options, inputs)
        for attack in options.only:
            if why := skipped(attack):
                print(f"skipped {attack}: {why}", flush=True)
            else:
                try:
                    getattr(attacks, f"attack_{attack}")()
                except subprocess.TimeoutExpired as hang:
                    attacks.failures.append(hang)
                    print(f"FAILED {attack}: {hang}", flush=True)
    if not attacks.rows:
        sys.exit(77)
    if options.csv:
        attacks.save_rows(options.csv)
    print(f"{sum(row['runs'] for row in attacks.rows)} runs, {len(attacks.failures)} wrong")
    sys.exit(1 if attacks.failures else 0)


if __name__ == "__main__":
    main()
