#!/usr/bin/env python3
"""Runs the commands of nbdtree with arguments drawn at random, most of them wrong, and checks how they end.

    arguments.py NBDTREE [--runs 2000] [--first 0] [--seed 1] [--seconds 3]

Most lines are one that works, to which options are added and in which a word may be another. The names of options and
what they take are read from --help; values are of the right kind, at its limits, or foreign: other numbers, words, paths,
files of every kind. Each run has a new folder with copies of the files that it may name. It must end with exit status 0
and no line on standard error, or with 1 or 2 and one line that begins with "nbdtree: error:"; warnings do not count. A run
that takes longer than --seconds is stopped as by Ctrl-C, if need be twice, and may also end with status 130. No run may
leave a temporary file. Prints the command lines of runs where anything else happens, and ends with exit status 1.
Run N of a seed is always the same: --first N --runs 1 repeats it.
"""
import argparse
import random
import re
import resource
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

HERE = Path(__file__).resolve().parent
ASSETS = HERE.parents[1] / "assets"
PATIENCE = 600  # seconds that a run may take after Ctrl-C to complete what it has begun, and to end after a second one
MOST_MEMORY, MOST_IN_A_FILE = 6 << 30, 1 << 30  # bytes
NOT_DRAWN = ["--help", "--version", "--live", "--keep-live"]  # the first two do nothing else, the others open a port
SMALL_NUMBERS = ["0", "1", "-1", "2", "3", "7", "16"]
NUMBERS = ["64", "1000", "0.5", "1e-9", "1e9", "1e308", "1e309", "-0", "nan", "inf", "-inf", "0x10", "010", "4294967295",
           "4294967296", "9223372036854775807", "-9223372036854775808", "18446744073709551616", "1,2", "1:2", ""]
WORDS = ["", " ", "-", "--", "---", "all", "none", "true", "exact", "boxes,boxes", "é", "\u202e", "a" * 300, "%s%n", "{}", "*", "\n",
         ",", "0:0", "x=", "=x", "..", ".", "/dev/null", "/dev/full", "/proc/self/mem", "missing/folder/file", "a/../b.h5", "http://x"]
LINES = ["mesh assets/ring.obj -o out.h5", "mesh corpus/msh/four.msh -o out.h5", "modes body.h5 -m 4",
         "dataset body.h5 -o out.h5 --trajectories 2 --frames 2", "remap poses.h5 --from body.h5 --to body.h5 -o out.h5",
         "train body.h5 poses.h5 -o out.h5 --depth 3", "calibrate tree.h5 poses.h5 -o out.h5", "evaluate tree.h5 poses.h5",
         "transfer tree.h5 body.h5 -o out.h5", "export tree.h5 --flat -o out.nbd",
         "export run.h5 --gltf out.glb", "coverage tree.h5 poses.h5", "simulate assets/scenes/rings.json -o out.h5 --frames 2",
         "race assets/scenes/rings.json --frames 2", "validate assets/scenes/rings.json", "collide assets/ring.obj assets/gear.obj",
         "inspect poses.h5 --check", "view run.h5 -o out.html", "view poses.h5:0 --body body.h5 -o out.html"]
OUTPUTS = ["out.h5", "out.nbd", "out.html", "out.csv", "folder"]
OUTPUT_OF = {words[0]: words[words.index("-o") + 1] for words in map(str.split, LINES) if "-o" in words}  # by command


def help_of(program, *command):
    return subprocess.run([program, *command, "--help"], check=True, capture_output=True, text=True).stdout


def options_in(text):
    """Options of a help text, also of its groups: name, the kind that it takes or "", its choices or ""."""
    found = re.findall(r"^(?:  |    )(?:-\w,)?(--[\w-]+)(?: (INT|UINT|FLOAT|TEXT|BOOLEAN)(?::\{([^}]*)\})?)?", text, re.M)
    return [option for option in found if option[0] not in NOT_DRAWN]


class Command:
    """A command: its options, those of every command once, its own five times; its number of positional arguments."""

    def __init__(self, program, name):
        text = help_of(program, name)
        self.name = name
        positionals = re.search(r"^Positionals:\n(.*?)^Options:", text, re.M | re.S)
        self.positionals = len(re.findall(r"^  \S", positionals[1], re.M)) if positionals else 0
        self.options = 5 * options_in(text) + options_in(help_of(program))
        self.has_output = "-o,--output " in text


def commands_of(program):
    names = re.findall(r"^  (\w+) ", help_of(program).split("Subcommands:")[1], re.M)
    return {name: Command(program, name) for name in names}


class Draw:
    """Draws a command line. commands: by their names."""

    def __init__(self, commands, files, seed):
        self.commands, self.files, self.random = commands, files, random.Random(seed)

    def value(self, kind, choices):
        r = self.random
        if choices and r.random() < 0.8:
            return r.choice(choices.split(","))
        if kind in ("INT", "UINT", "FLOAT") and r.random() < 0.85:
            return r.choice(SMALL_NUMBERS if r.random() < 0.5 else SMALL_NUMBERS + NUMBERS)
        return r.choice(self.files) if r.random() < 0.5 else r.choice(WORDS)

    def line_that_works(self):
        words = self.random.choice(LINES).split()
        if self.random.random() < 0.3:
            words[self.random.randrange(len(words))] = self.value("", "")
        return words

    def any_line(self):
        r = self.random
        command = r.choice(list(self.commands.values()))
        words = [command.name]
        for _ in range(command.positionals if r.random() < 0.9 else r.randrange(4)):
            words.append(r.choice(self.files) if r.random() < 0.9 else r.choice(WORDS))
        output = OUTPUT_OF.get(command.name, "out.h5") if r.random() < 0.8 else r.choice(OUTPUTS)
        return words + (["-o", output] if command.has_output else [])

    def line(self):
        r = self.random
        words = self.line_that_works() if r.random() < 0.7 else self.any_line()
        if command := self.commands.get(words[0]):
            for name, kind, choices in r.sample(command.options, r.randrange(4)):
                if name not in words or r.random() < 0.1:
                    words += [name, self.value(kind, choices)] if kind else [name]
        return words


def limit():
    """Keeps a run from filling the machine. It is told of a file that grows too large, not ended."""
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_FSIZE, (MOST_IN_A_FILE, MOST_IN_A_FILE))
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)


def run(program, words, folder, seconds):
    """The exit status, None if it did not end; what it wrote on standard error; and whether it was stopped."""
    with subprocess.Popen([program, *words], cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                          stderr=subprocess.PIPE, text=True, errors="replace", preexec_fn=limit) as process:
        for asked, wait in enumerate((seconds, PATIENCE, PATIENCE)):
            try:
                said = process.communicate(timeout=wait)[1]
                return process.returncode, said, asked > 0
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGINT)
        process.kill()
        return None, process.communicate()[1], True


def defect(status, said, was_stopped, folder):
    """What is wrong with the end of a run; "" if nothing."""
    if status is None:
        return f"does not end within {PATIENCE} s of a second Ctrl-C"
    if status not in ((0, 1, 2, 130) if was_stopped else (0, 1, 2)):
        return f"exit status {status}"
    lines = [line for line in said.removesuffix("\n").split("\n") if line and not line.startswith("nbdtree: warning: ")]
    errors = [line for line in lines if line.startswith("nbdtree: error: ")]
    if len(lines) != (status != 0) or lines != errors:
        return f"exit status {status} with {len(lines)} lines, {len(errors)} of them of an error"
    if "nbdtree: error: " in lines:
        return "an error without words"
    if lines and len(lines[0]) > 1000:
        return f"a line of {len(lines[0])} characters"
    left = sorted(str(path.relative_to(folder)) for path in folder.rglob("*.tmp"))
    return f"leaves {', '.join(left)}" if left else ""


def make_inputs(program, folder):
    """Makes a folder of files: the corpus and the assets, and small ones that fit together. Returns the names to draw from,
    those that fit together more often."""
    shutil.copytree(HERE / "corpus", folder / "corpus")
    shutil.copytree(ASSETS, folder / "assets")
    files = [str(path.relative_to(folder)) for path in sorted(folder.rglob("*"))
             if path.is_file() and path.suffix not in (".py", ".md", ".geo", "")]
    for command in ("mesh assets/ring.obj -o body.h5", "modes body.h5 -m 6",
                    "dataset body.h5 -o poses.h5 --trajectories 3 --frames 3",
                    "train body.h5 poses.h5 -o tree.h5 --depth 3 --bounds learned_affine",
                    "simulate assets/scenes/rings.json -o run.h5 --frames 3"):
        subprocess.run([program, *command.split(), "-q"], cwd=folder, check=True, stderr=subprocess.DEVNULL)
    return files + 20 * ["body.h5", "poses.h5", "tree.h5", "run.h5"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--runs", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0, help="number of the first run")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=3)
    chosen = parser.parse_args()
    program = chosen.program.resolve()
    commands = commands_of(program)
    ends, wrong = Counter(), 0
    with tempfile.TemporaryDirectory(prefix="nbdtree_arguments_") as name:
        inputs, folder = Path(name) / "inputs", Path(name) / "run"
        inputs.mkdir()
        files = make_inputs(program, inputs)
        for number in range(chosen.first, chosen.first + chosen.runs):
            words = Draw(commands, files, f"{chosen.seed} {number}").line()
            shutil.copytree(inputs, folder)
            status, said, was_stopped = run(program, words, folder, chosen.seconds)
            ends["after Ctrl-C" if was_stopped else f"with status {status}"] += 1
            if problem := defect(status, said, was_stopped, folder):
                wrong += 1
                print(f"run {number}: {problem}: nbdtree {shlex.join(words)}\n{said[-600:]}", flush=True)
            shutil.rmtree(folder)
    print(f"{chosen.runs} runs, {wrong} wrong; " + ", ".join(f"{count} ended {end}" for end, count in sorted(ends.items())))
    return wrong > 0


if __name__ == "__main__":
    sys.exit(main())
