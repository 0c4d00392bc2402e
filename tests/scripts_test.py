#!/usr/bin/env python3
"""Runs every script of the project with --help, which must say what it does and start nothing, and with an option that no
script has, which must be refused.

    scripts_test.py PROJECT
"""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

PROJECT = Path(sys.argv.pop(1)).resolve()
FOLDERS = [".ci", "apps", "assets", "tests"]
# Whose arguments go to a program or which is a test itself.
PASS_ON = {"assets/slurm/dataset.sh", "tests/apps/completion.sh", "tests/scripts_test.py"}
# All that a script may use before it knows what it is asked for: nothing that installs, builds or tests.
NEEDS = ["bash", "env", "python3", "realpath", "sed"]


def scripts():
    found = []
    for folder in FOLDERS:
        for path in sorted((PROJECT / folder).rglob("*")):
            if path.is_file() and os.access(path, os.X_OK) and path.read_bytes()[:2] == b"#!":
                found.append(path)
    return [path for path in found if str(path.relative_to(PROJECT)) not in PASS_ON]


class Scripts(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="nbdtree_scripts_"))
        for program in NEEDS:
            (cls.folder / program).symlink_to(shutil.which(program, path="/usr/bin:/bin"))

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def run_script(self, path, option):
        done = subprocess.run([path, option], cwd=self.folder, stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              env={**os.environ, "PATH": str(self.folder), "PYTHONDONTWRITEBYTECODE": "1"})
        if "ModuleNotFoundError" in done.stderr or done.returncode == 77:
            self.skipTest(done.stderr.splitlines()[-1] if done.stderr else done.stdout)
        return done

    def test_there_are_many(self):
        names = [str(path.relative_to(PROJECT)) for path in scripts()]
        self.assertTrue({"apps/demo", "apps/bootstrap", "tests/run", ".ci/run", "assets/moloch.py"} <= set(names), names)

    def test_help_says_what_it_does_and_starts_nothing(self):
        for path in scripts():
            with self.subTest(path.relative_to(PROJECT)):
                done = self.run_script(path, "--help")
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                self.assertGreater(len(done.stdout.split()), 8)

    def test_an_unknown_option_is_refused_in_one_line(self):
        for path in scripts():
            with self.subTest(path.relative_to(PROJECT)):
                done = self.run_script(path, "--no-such-option")
                self.assertEqual((done.returncode, done.stdout), (2, ""))
                self.assertRegex(done.stderr.splitlines()[-1], "^[a-z_.]+: error: ")


if __name__ == "__main__":
    unittest.main(verbosity=1)
