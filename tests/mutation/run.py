#!/usr/bin/env python3
"""Puts faults into the code, one at a time, and says which of them the tests notice.

    tests/mutation/run.py [--folder build/mutation] [--csv FILE] [--areas bounds queries ...] [--only TEXT] [--again]

The faults are those of mutants.toml beside this file. The folder gets a clone of the last commit, which is built and
whose tests must pass; then each fault is put in, the programs that should notice it are built again and run until a
test fails, and the fault is taken out. With --again, rows of the table whose fault was noticed stay as they are, and
the others are tried again. NBD_CMAKE_OPTIONS adds options for CMake. Exit status 1 if a fault without a
reason stays unnoticed, or does not compile.
"""

import argparse
import csv
import os
import re
import shlex
import subprocess
import sys
import time
import tomllib
from pathlib import Path

HERE = Path(__file__).resolve().parent
PROJECT = HERE.parents[1]
COLUMNS = ["area", "fault", "file", "outcome", "test", "seconds"]


def run(command, timeout=None, **options):
    """The exit status and the output of a command; None for the status where it runs past the timeout."""
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                              timeout=timeout, check=False, **options)
        return done.returncode, done.stdout
    except subprocess.TimeoutExpired as expired:
        output = expired.stdout or ""
        return None, output if isinstance(output, str) else output.decode(errors="replace")


def must(command, **options):
    status, output = run(command, **options)
    if status != 0:
        sys.exit(f"error: {' '.join(map(str, command))} failed:\n{output[-4000:]}")
    return output


class Copy:
    """A clone of the project and its build."""

    def __init__(self, folder):
        self.source = folder / "source"
        self.build = self.source / "build" / "release"
        if not (self.source / ".git").exists():
            must(["git", "clone", "--quiet", PROJECT, self.source])
        must(["git", "-C", self.source, "fetch", "--quiet", PROJECT, "HEAD"])
        must(["git", "-C", self.source, "reset", "--quiet", "--hard", "FETCH_HEAD"])
        options = shlex.split(os.environ.get("NBD_CMAKE_OPTIONS", ""))
        must(["cmake", "--preset", "release", "-Wno-dev", *options], cwd=self.source)

    def make(self, programs):
        status, output = run(["cmake", "--build", self.build, "--target", *programs])
        return status == 0, output

    def program(self, name):
        return next(path for path in self.build.glob(f"tests/**/{name}") if path.is_file())

    def notice(self, name, timeout):
        """The test of a program that fails, or what else happens to it; None where all tests pass."""
        program = self.program(name)
        status, output = run([program, "--gtest_fail_fast", "--gtest_brief=1"], timeout=timeout, cwd=program.parent)
        if status == 0:
            return None
        failed = re.search(r"^\[  FAILED  \] ([^ (,]+)", output, re.MULTILINE)
        if failed:
            return failed[1]
        return f"{name} takes more than {timeout:.0f} s" if status is None else f"{name} ends with status {status}"


def read_mutants(chosen):
    mutants = tomllib.loads((HERE / "mutants.toml").read_text())["mutant"]
    return [m for m in mutants if (not chosen.areas or m["area"] in chosen.areas) and chosen.only in m["what"]]


def noticed_before(chosen):
    """The rows of the table whose faults were noticed, by fault."""
    if not chosen.again:
        return {}
    with chosen.csv.open(newline="") as file:
        return {row[1]: row for row in csv.reader(file) if row[3] == "noticed"}


def try_mutant(copy, mutant, timeouts):
    """What becomes of a fault, and the test that notices it."""
    path = copy.source / mutant["file"]
    text = path.read_text()
    if text.count(mutant["from"]) != 1:
        return "not in the code once", ""
    path.write_text(text.replace(mutant["from"], mutant["to"]))
    try:
        built, _ = copy.make(mutant["tests"])
        if not built:
            return "does not compile", ""
        for name in mutant["tests"]:
            if test := copy.notice(name, timeouts[name]):
                return "noticed", test
        return ("no fault" if "reason" in mutant else "survives"), mutant.get("reason", "")
    finally:
        path.write_text(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, default=PROJECT / "build" / "mutation", help="where the clone lies")
    parser.add_argument("--csv", type=Path, help="the table to write")
    parser.add_argument("--areas", nargs="+", help="the areas to put faults into; all where not given")
    parser.add_argument("--only", default="", help="a part of the text of the faults to put in")
    parser.add_argument("--again", action="store_true", help="try only what the table of --csv does not call noticed")
    chosen = parser.parse_args()
    mutants = read_mutants(chosen)
    known = noticed_before(chosen)
    if not mutants:
        sys.exit("error: no fault is of these areas and has this text")

    copy = Copy(chosen.folder)
    timeouts = {}
    programs = sorted({name for mutant in mutants if mutant["what"] not in known for name in mutant["tests"]})
    built, output = copy.make(programs)
    if not built:
        sys.exit(f"error: the code without a fault does not build:\n{output[-4000:]}")
    for name in programs:
        begin = time.monotonic()
        if test := copy.notice(name, 1800):
            sys.exit(f"error: {test} fails without a fault")
        timeouts[name] = 60 + 5 * (time.monotonic() - begin)

    rows = []
    for mutant in mutants:
        if mutant["what"] in known:
            rows.append(known[mutant["what"]])
            continue
        begin = time.monotonic()
        outcome, test = try_mutant(copy, mutant, timeouts)
        rows.append([mutant["area"], mutant["what"], mutant["file"], outcome, test, f"{time.monotonic() - begin:.0f}"])
        print(f"{len(rows)} of {len(mutants)}: {mutant['area']}: {mutant['what']}: {outcome} {test}", flush=True)
    if chosen.csv:
        partial = chosen.csv.with_name(chosen.csv.name + ".partial")
        with partial.open("w", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows])
        partial.rename(chosen.csv)
    outcomes = [row[3] for row in rows]
    for outcome in sorted(set(outcomes)):
        print(f"{outcome}: {outcomes.count(outcome)}")
    return any(outcome not in ("noticed", "no fault") for outcome in outcomes)


if __name__ == "__main__":
    sys.exit(main())
