#!/usr/bin/env python3
"""Holds the list of faults against the code and against the table of what the tests notice.

    mutants_test.py PROJECT
"""
import csv
import re
import sys
import tomllib
import unittest
from pathlib import Path

PROJECT = Path(sys.argv.pop(1)).resolve()
MUTANTS = tomllib.loads((PROJECT / "tests" / "mutation" / "mutants.toml").read_text())["mutant"]


class Mutants(unittest.TestCase):
    def test_each_has_its_text_in_the_code_once(self):
        self.assertGreater(len(MUTANTS), 100)
        for mutant in MUTANTS:
            with self.subTest(mutant["what"]):
                self.assertEqual((PROJECT / mutant["file"]).read_text().count(mutant["from"]), 1)
                self.assertNotEqual(mutant["from"], mutant["to"])

    def test_each_names_programs_that_are_built(self):
        built = set()
        for path in (PROJECT / "tests").rglob("CMakeLists.txt"):
            built |= set(re.findall(r"\b(?:nbd_test|add_executable)\((\w+)", path.read_text()))
        named = {name for mutant in MUTANTS for name in mutant["tests"]}
        self.assertLessEqual(named, built)

    def test_each_has_a_row_in_the_table(self):
        with (PROJECT / "apps" / "results" / "mutants.csv").open(newline="") as file:
            rows = {(row["area"], row["fault"], row["file"]): row["outcome"] for row in csv.DictReader(file)}
        self.assertEqual(set(rows), {(mutant["area"], mutant["what"], mutant["file"]) for mutant in MUTANTS})
        for mutant in MUTANTS:
            outcome = rows[mutant["area"], mutant["what"], mutant["file"]]
            self.assertEqual(outcome, "no fault" if "reason" in mutant else "noticed", mutant["what"])


if __name__ == "__main__":
    unittest.main()
