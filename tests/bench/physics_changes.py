#!/usr/bin/env python3
"""Runs checks of `nbdtree-bench physics --quick`, and tells what differs from a list of those that do not hold.

    physics_changes.py NBDTREE-BENCH LIST.csv CHECK... [--write]

LIST: check, how many of its cases fail, and the largest error. Exit status 1 where a check fails that is not listed, where one became
worse, or where one holds that is listed. --write writes the list anew.
"""
import argparse
import csv
import json
import math
import subprocess
import sys
from pathlib import Path

SLACK = 0.1  # an error may grow by this share, which other processors need


def changes(rows, listed):
    """Lines that tell what differs. rows: of the program's JSON. listed: check -> its row of the list."""
    lines = []
    for row in rows:
        error = math.inf if row["error"] is None else row["error"]
        where = f"{row['check']}: error {error:.3g} at {row['worst']}"
        known = listed.get(row["check"])
        if known is None:
            if not row["held"]:
                lines.append(f"{where}; allowed: {row['allowed']:.3g}")
        elif row["held"]:
            lines.append(f"{row['check']} holds now (error {error:.3g}): strike it from the list")
        elif error > (1 + SLACK) * float(known["error"]):
            lines.append(f"{where}; listed: {known['error']}")
        elif row["failed"] > int(known["failed"]):
            lines.append(f"{row['check']}: {row['failed']} cases fail; listed: {known['failed']}")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("list", type=Path)
    parser.add_argument("checks", nargs="+")
    parser.add_argument("--write", action="store_true", help="write the list anew")
    arguments = parser.parse_args()
    done = subprocess.run([arguments.program, "physics", *arguments.checks, "--quick", "--threads", "2", "--json"], check=True,
                          stdout=subprocess.PIPE, text=True)
    rows = json.loads(done.stdout)["checks"]
    if arguments.write:
        failed = [f"{row['check']},{row['failed']},{math.inf if row['error'] is None else row['error']:.3g}\n" for row in rows if not row["held"]]
        arguments.list.write_text("check,failed,error\n" + "".join(failed))
        return 0
    with arguments.list.open(newline="") as table:
        lines = changes(rows, {row["check"]: row for row in csv.DictReader(table)})
    print("\n".join(lines))
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
