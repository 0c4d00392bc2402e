#!/usr/bin/env python3
"""Runs every command, and every scene of the assets, on four threads with a program that was built under the thread
sanitizer, and looks for data races.

    threads.py NBDTREE [--only COMMAND_OR_SCENE ...] [--frames 2] [--csv races.csv]

Columns: what was run; seconds; races, the reports of the sanitizer; wrong, 1 where the exit status was not 0. Exit status 1
if anything was found. tests/thread_sanitizer builds the program and calls this one.
"""

import argparse
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

from commands import ASSETS, EVERY, Checks, Command, fresh, make_all_inputs, run

HERE = Path(__file__).resolve().parent
# TBB's library is built without the sanitizer. Its templates in our code hand their own fields from thread to thread
# through it, which the sanitizer cannot see; ForkJoin tells it what our code does in order.
OPTIONS = f"suppressions={HERE / 'thread_sanitizer.supp'} exitcode=66 history_size=7"
TIMEOUT = 1800


def scenes(frames):
    """A run of each scene of the assets but the demo's, which needs what the demo makes."""
    names = sorted(p.stem for p in (ASSETS / "scenes").glob("*.json"))
    return [Command(name, ["simulate", ASSETS / "scenes" / f"{name}.json", "-o", "made.h5", "--frames", str(frames)], "made.h5")
            for name in names]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", metavar="NBDTREE", type=Path)
    parser.add_argument("--only", nargs="+", metavar="NAME")
    parser.add_argument("--frames", type=int, default=2)
    parser.add_argument("--csv")
    options = parser.parse_args()
    runs = [c for c in [*EVERY, *scenes(options.frames)] if not options.only or c.name in options.only]

    os.environ["TSAN_OPTIONS"] = OPTIONS
    checks = Checks(options.program)
    with tempfile.TemporaryDirectory(prefix="threads-inputs-") as folder:
        inputs = Path(folder)
        make_all_inputs(inputs, options.program)
        for command in runs:
            begun, copy = time.monotonic(), fresh(inputs)
            done = run([checks.program, *command.arguments, "--quiet", "--threads", "4"], copy, timeout=TIMEOUT)
            shutil.rmtree(copy)
            races = done.stderr.count("WARNING: ThreadSanitizer")
            if races or done.returncode != 0:
                checks.report(command, "on four threads", f"exit status {done.returncode}, {done.stderr[:6000]}")
            checks.add_row(run=command.name, seconds=round(time.monotonic() - begun, 1), races=races,
                           wrong=int(done.returncode != 0))
    if options.csv:
        checks.save_rows(options.csv)
    print(f"{len(checks.rows)} runs, {len(checks.failures)} wrong")
    sys.exit(1 if checks.failures else 0)


if __name__ == "__main__":
    main()
