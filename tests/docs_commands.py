#!/usr/bin/env python3
"""Runs the commands of the pages and checks the links of all .md files.

The pages are README.md, CONTRIBUTING.md, apps/docs/*.md, apps/results/README.md, assets/*/README.md, and the other READMEs with
commands, in this order:

    tests/docs_commands.py --build build/release --source .

- A block marked ```sh runs line by line, as written, in a fresh folder that looks like the project's: its files, with
  the build as build/release and an empty out/. Later pages see what earlier ones wrote.
- A block marked ```output is what the block before it prints; figures may differ a little (same_line()).
- A block marked ```sh long, or a command inside the text, is checked only: the program exists, and every subcommand,
  option and named choice is in its --help.
- A block marked ```python runs where the modules that it imports are installed.
- A relative link in any .md file of the project must lead to a file, and to a heading where it names one.
- A path of a source file in code marks, from the project's folder or the page's, must be there; in the change log it need not.
- Each table and picture of apps/results is named by a page and by a row of provenance.csv; what apps/results/make runs is checked, too.

Prints each command with its seconds; stops at the first failure with page and line, exit status 1.
"""
import argparse
import csv
import importlib.util
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

OURS = ("nbdtree", "nbdtree-bench")
LAUNCHERS = ("mpirun", "sbatch", "srun")  # what they start stands behind their own options
OTHERS = ("cmake", "ctest", "git", "mkdir", "apt-get", "ninja", "export")  # not ours: checked by nobody but their makers
OPERATORS = {"&&", "||", ";", "|", "(", ")", "&"}
SECONDS_FOR_ONE_COMMAND = 1800  # it hangs


class Failure(Exception):
    """What is wrong, and where: page and line."""


# --- pages ---------------------------------------------------------------------------------------------------

def blocks(text):
    """Fenced blocks as (info string, number of the first line inside, lines)."""
    found, opened = [], None
    for number, line in enumerate(text.splitlines(), 1):
        fence = re.match(r"\s*```(.*)$", line)
        if fence and opened is None:
            opened = (fence.group(1).strip(), number + 1, [])
        elif fence:
            found.append(opened)
            opened = None
        elif opened:
            opened[2].append(line.strip() if opened[0].startswith("sh") else line)
    return found


def command_lines(first, lines):
    """Commands as (line number, text): lines that end with a backslash go on, comments of a whole line are left out."""
    text, start = "", first
    for number, line in enumerate(lines, first):
        if not text:
            start = number
        if line.endswith("\\"):
            text += line[:-1] + " "
            continue
        text += line
        if text.strip() and not text.lstrip().startswith("#"):
            yield start, text.strip()
        text = ""


def commands_in_text(text):
    """Commands of ours inside the prose: `nbdtree SUBCOMMAND ...`, as (line number, text)."""
    prose = re.sub(r"^([ \t]*)```.*?^[ \t]*```", lambda m: "\n" * m.group().count("\n"), text, flags=re.M | re.S)
    for span in re.finditer(r"(?<!`)`((?:nbdtree|nbdtree-bench) [^`]+)`", prose):
        yield prose.count("\n", 0, span.start()) + 1, " ".join(span.group(1).replace("...", "").split())


# --- commands that are checked only --------------------------------------------------------------------------

def simple_commands(text):
    """The words of each simple command of a line, without variables in front and redirections behind."""
    lexer = shlex.shlex(text, posix=True, punctuation_chars=True)
    lexer.whitespace_split = True
    lexer.commenters = "#"
    commands, words, skip = [], [], False
    for token in lexer:
        if token in OPERATORS:
            commands.append(words)
            words = []
        elif skip or re.fullmatch(r"[<>]+", token):
            skip = not skip
        elif words or not re.fullmatch(r"\w+=.*", token):
            words.append(token)
    return [words for words in commands + [words] if words]


class Help:
    """Subcommands, options and choices that programs name in their --help."""

    def __init__(self, environment):
        self.environment, self.known = environment, {}

    def text(self, *command):
        if command not in self.known:
            run = subprocess.run([*command, "--help"], env=self.environment, capture_output=True, text=True, timeout=SECONDS_FOR_ONE_COMMAND)
            if run.returncode != 0:
                raise Failure(f"{' '.join(command)}: there is no such command")
            self.known[command] = run.stdout
        return self.known[command]

    def options(self, *command):
        """Option -> the choices for its value: those that its line names, [] for any, None where it takes none."""
        found = {}
        for line in self.text(*command).splitlines():
            head = re.match(r"\s+(-{1,2}[A-Za-z][\w-]*(?:,-{1,2}[A-Za-z][\w-]*)*)(?: ([A-Z]+|\S*\{)|$|\s)", line)
            if not head:
                continue
            choices = re.search(r"\{([\w,-]+)\}", line)
            value = choices.group(1).split(",") if choices else [] if head.group(2) else None
            found.update(dict.fromkeys(head.group(1).split(","), value))
        return found


def check_ours(words, help_of):
    """A command of nbdtree or nbdtree-bench: the options in front, the subcommand, its options and their choices."""
    program, common = words[0], help_of.options(words[0])
    subcommand, options, choices = None, common, None  # choices: for the value that comes next
    for word in words[1:]:
        if re.match(r"--?[A-Za-z]", word):
            if word not in options:
                raise Failure(f"{program} {subcommand or ''}: no option {word}; see its --help")
            choices = options[word]
        elif choices is not None:
            for value in word.split(","):
                if choices and value not in choices and not value.isupper():
                    raise Failure(f"{program} {subcommand or ''}: no choice {value}; known: {', '.join(choices)}")
            choices = None
        elif subcommand is None:
            if not re.search(rf"^\s+{re.escape(word)}\s", help_of.text(program), re.M):
                raise Failure(f"{program}: no command {word}; see its --help")
            subcommand, options = word, {**common, **help_of.options(program, word)}


def check_other(words, folder):
    """A command that is not ours: a file of the project, or a known program."""
    program = words[0]
    if Path(program).name.startswith("python") and len(words) > 1 and words[1].endswith(".py"):
        program = words[1]
    if "/" in program:
        if not (folder / program).is_file():
            raise Failure(f"{program}: no such file")
        for word in words[1:]:
            if re.match(r"(build|tests|apps|training|assets)/", word) and not (folder / word).exists():
                raise Failure(f"{word}: no such file")
    elif program not in OTHERS:
        raise Failure(f"{program}: neither a program of ours nor one that {Path(__file__).name} knows")
    if "--preset" in words:
        presets = json.loads((folder / "CMakePresets.json").read_text())
        names = [p["name"] for kind in ("configurePresets", "buildPresets", "testPresets") for p in presets[kind]]
        if words[words.index("--preset") + 1] not in names:
            raise Failure(f"no preset {words[words.index('--preset') + 1]}; known: {', '.join(dict.fromkeys(names))}")


def check(text, help_of, folder):
    for words in simple_commands(text):
        if words[0] in LAUNCHERS:
            start = next((i for i, word in enumerate(words) if word in OURS or "/" in word), len(words))
            words = words[start:]
        if not words:
            continue
        if words[0] in OURS:
            if shutil.which(words[0], path=help_of.environment["PATH"]):
                check_ours(words, help_of)
        else:
            check_other(words, folder)


def check_examples(help_of, folder):
    """The examples in the --help of each command of our programs: two at least. Returns their number."""
    examples = 0
    for program in (name for name in OURS if shutil.which(name, path=help_of.environment["PATH"])):
        for command in re.findall(r"^  (\w+) ", help_of.text(program).split("Subcommands:")[1], re.M):
            text = help_of.text(program, command)
            lines = re.findall(rf"^  ((?:mpirun .*)?{program} .*)", text.split("Examples:")[-1], re.M)
            if "Examples:" not in text or len(lines) < 2:
                raise Failure(f"{program} {command} --help: shows {len(lines)} examples; wanted: 2")
            for below in re.findall(r"([A-Z]+) .*see below$", text, re.M):
                if not re.search(rf"^{below}: ", text, re.M):
                    raise Failure(f"{program} {command} --help: nothing about {below} stands below")
            for line in lines:
                check(line, help_of, folder)
            examples += len(lines)
    return examples


# --- commands that run ---------------------------------------------------------------------------------------

def make_folder(folder, source, build):
    """Links to the project's files, the build as build/release, an empty out/."""
    for entry in source.iterdir():
        if entry.name not in ("build", "out", ".git"):
            (folder / entry.name).symlink_to(entry)
    (folder / "build").mkdir()
    (folder / "build" / "release").symlink_to(build)
    (folder / "out").mkdir()


def run(text, folder, environment):
    """Runs a line of the shell; variables that it exports are kept. Returns the seconds and what it printed."""
    start = time.monotonic()
    kept = folder / ".environment"
    script = f"set -eu -o pipefail\n{text}\nenv -0 > '{kept}'"
    with open(folder / ".output", "w+") as output:
        shell = subprocess.Popen(["bash", "-c", script], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                                 stdout=output, stderr=subprocess.STDOUT, start_new_session=True)
        try:
            status = shell.wait(SECONDS_FOR_ONE_COMMAND)
        except subprocess.TimeoutExpired:
            os.killpg(shell.pid, signal.SIGKILL)
            shell.wait()
            raise Failure(f"still running after {SECONDS_FOR_ONE_COMMAND} s: {text}") from None
    if status != 0:
        raise Failure(f"exit status {status}: {text}\n{(folder / '.output').read_text()[-4000:]}")
    exported = dict(pair.split("=", 1) for pair in kept.read_text().split("\0") if "=" in pair)
    environment.clear()
    environment.update(exported)
    return time.monotonic() - start, (folder / ".output").read_text()


def same_line(wanted, got):
    """Whether a printed line is the wanted one. Whole numbers may differ by a fiftieth, for other processors round
    differently; numbers with a decimal point, which may be times, by any amount."""
    number = re.compile(r"-?\d+\.\d+(?:e[+-]?\d+)?|\d+(?:e[+-]?\d+)?")
    if number.sub("0", " ".join(wanted.split())) != number.sub("0", " ".join(got.split())):
        return False
    pairs = zip(number.findall(wanted), number.findall(got))
    return all("." in a + b or "e" in a + b or abs(int(a) - int(b)) <= max(int(a), int(b)) / 50 for a, b in pairs)


def check_output(expected, printed):
    """Throws where a block marked output is not what was printed. A line of three points stands for any lines."""
    wanted = [line for line in expected.splitlines() if line.strip()]
    got = [line for line in printed.splitlines() if line.strip()]
    skips = False
    for line in wanted:
        if line.strip() == "...":
            skips = True
            continue
        while skips and got and not same_line(line, got[0]):
            got.pop(0)
        skips = False
        if not got or not same_line(line, got.pop(0)):
            raise Failure(f"the page says that the commands before print '{line}'; they print:\n{printed}")
    if got and not skips:
        raise Failure(f"the page does not say that the commands before print '{got[0]}'")


def missing_modules(code):
    names = re.findall(r"^\s*(?:import|from)\s+([\w, ]+?)(?:\s+import.*)?$", code, re.M)
    modules = {name.split()[0] for group in names for name in group.split(",")}
    return sorted(name for name in modules if importlib.util.find_spec(name) is None)


def missing_bench(line, environment):
    return line.startswith("nbdtree-bench") and not shutil.which("nbdtree-bench", path=environment["PATH"])


def run_page(page, source, folder, environment, help_of):
    text = (source / page).read_text()
    printed = ""
    for info, first, lines in blocks(text):
        number = first
        try:
            if info == "python":
                code = "\n".join(lines)
                missing = missing_modules(code)
                if missing:
                    print(f"  skipped {page}:{first}: no Python module {', '.join(missing)}")
                    continue
                (folder / "out" / "block.py").write_text(code)
                seconds, _ = run(f"{sys.executable} out/block.py", folder, environment)
                print(f"{seconds:6.1f} s  {page}:{first}: python")
            elif info == "output":
                check_output("\n".join(lines), printed)
            elif info in ("sh", "sh long"):
                printed = ""
                for number, line in command_lines(first, lines):
                    check(line, help_of, folder) if info == "sh long" or line.startswith(OURS) else None
                    if info == "sh" and not missing_bench(line, environment):
                        seconds, output = run(line, folder, environment)
                        printed += output
                        print(f"{seconds:6.1f} s  {line}", flush=True)
        except Failure as failure:
            raise Failure(f"{page}:{number}: {failure}") from None
    for number, line in commands_in_text(text):
        try:
            check(line, help_of, folder)
        except Failure as failure:
            raise Failure(f"{page}:{number}: {failure}") from None


# --- links ---------------------------------------------------------------------------------------------------

def anchors(path):
    """Headings of a page as links name them."""
    titles = re.findall(r"^#+\s+(.*?)\s*$", path.read_text(), re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def check_links(page, source):
    text = (source / page).read_text()
    for link in re.finditer(r"\]\(([^()\s]+)\)", text):
        target, _, heading = link.group(1).partition("#")
        where = f"{page}:{text.count(chr(10), 0, link.start()) + 1}"
        if re.match(r"[a-z]+:", target):
            continue
        path = (source / page).parent / target if target else source / page
        if not path.exists():
            raise Failure(f"{where}: the link {link.group(1)} leads nowhere")
        if heading and path.suffix == ".md" and heading not in anchors(path):
            raise Failure(f"{where}: the page {path.name} has no heading for #{heading}")


def check_paths(page, source):
    """Paths of source files in the text, such as `sim/world/world.hpp`."""
    text = (source / page).read_text()
    for path in re.finditer(r"`((?:apps|assets|collision|meshing|sim|tests|training)/[\w/.-]+\.(?:hpp|cpp|inl|py|json))[`:]", text):
        folders = (source, source / page.parent)
        if "NAME" not in path.group(1) and not any((folder / path.group(1)).is_file() for folder in folders):
            raise Failure(f"{page}:{text.count(chr(10), 0, path.start()) + 1}: there is no {path.group(1)}")


def check_results(source):
    """Tables and pictures of apps/results: a page names each, and provenance.csv has a row for each and no other. Returns their number."""
    results = source / "apps" / "results"
    texts = [(source / page).read_text() for page in all_markdown(source)]
    files = {str(path.relative_to(results)) for path in results.rglob("*") if path.suffix in (".csv", ".png")} - {"provenance.csv"}
    for name in sorted(files):
        if not any(f"results/{name})" in text for text in texts):
            raise Failure(f"apps/results/{name}: no page links to it")
    with (results / "provenance.csv").open(newline="") as table:
        rows = list(csv.DictReader(table))
    for row in rows:
        if not all(row.values()) or not (results / row["file"]).is_file():
            raise Failure(f"apps/results/provenance.csv: the row of {row['file']} has an empty cell, or there is no such file")
    if without := sorted(files - {row["file"] for row in rows}):
        raise Failure(f"apps/results/provenance.csv: has no row for {without[0]}")
    return len(files)


def check_stages(help_of, folder):
    """The commands of apps/results/make: those of our programs, and the scripts that it starts. Returns their number."""
    listed = subprocess.run([sys.executable, folder / "apps/results/make", "--list"], check=True, capture_output=True, text=True).stdout
    commands = [words for line in listed.splitlines() if line.startswith("      ") for words in simple_commands(line)]
    ours = [words for words in commands if words[0] in OURS or "/" in words[0] or words[0].startswith("python")]
    for words in ours:
        try:
            check(shlex.join(words), help_of, folder)
        except Failure as failure:
            raise Failure(f"apps/results/make: {failure}") from None
    return len(ours)


def pages_of(source):
    docs = sorted((source / "apps" / "docs").glob("*.md"), key=lambda path: (path.name != "README.md", path.name))
    results = source / "apps" / "results" / "README.md"
    paths = [source / "README.md", source / "CONTRIBUTING.md", *docs, results, *sorted(source.glob("assets/*/README.md"))]
    pages = [path.relative_to(source) for path in paths]
    return pages + [page for page in all_markdown(source)
                    if page not in pages and re.search(r"^```(sh|python)", (source / page).read_text(), re.M)]


def all_markdown(source):
    for folder, folders, files in os.walk(source):
        folders[:] = sorted(f for f in folders if f not in (".git", "build", "out"))
        yield from (Path(folder, f).relative_to(source) for f in sorted(files) if f.endswith(".md"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=Path, default=Path("build/release"), help="build folder with apps/nbdtree")
    parser.add_argument("--source", type=Path, default=Path(__file__).parent.parent, help="the project's folder")
    parser.add_argument("--links", action="store_true", help="only check links")
    arguments = parser.parse_args()
    source, build = arguments.source.resolve(), arguments.build.resolve()
    start = time.monotonic()
    try:
        links = list(all_markdown(source))
        for page in links:
            check_links(page, source)
            if page.name != "CHANGELOG.md":
                check_paths(page, source)
        print(f"links of {len(links)} pages lead somewhere")
        print(f"{check_results(source)} tables and pictures have a page and a row of provenance.csv")
        if arguments.links:
            return 0
        if not (build / "apps" / "nbdtree").is_file():
            raise Failure(f"{build}/apps/nbdtree: no such program; build it first")
        # As for a user who has installed the programs and the package: python3 is the interpreter that runs this.
        path = [str(build / "apps"), str(Path(sys.executable).parent), os.environ["PATH"]]
        environment = {**os.environ, "PATH": os.pathsep.join(path), "PYTHONPATH": str(build / "python")}
        sys.path.insert(0, str(build / "python"))
        if not (build / "apps" / "nbdtree-bench").is_file():
            print("nbdtree-bench was not built: its commands are not checked")
        with tempfile.TemporaryDirectory(prefix="nbdtree_docs_") as name:
            folder = Path(name)
            make_folder(folder, source, build)
            help_of = Help(dict(environment))
            print(f"{check_examples(help_of, folder)} examples in --help are right")
            print(f"{check_stages(help_of, folder)} commands of apps/results/make are right")
            for page in pages_of(source):
                print(f"{page}", flush=True)
                run_page(page, source, folder, environment, help_of)
    except Failure as failure:
        print(f"error: {failure}", file=sys.stderr)
        return 1
    print(f"{time.monotonic() - start:.0f} s in all")
    return 0


if __name__ == "__main__":
    sys.exit(main())
