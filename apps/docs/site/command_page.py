"""Makes a page for each command of nbdtree from what its --help prints."""
import re
import subprocess
from dataclasses import dataclass

COLUMN = 30  # where descriptions begin


def help_of(program, *command):
    return subprocess.run([program, *command, "--help"], check=True, capture_output=True, text=True).stdout


def commands_of(program):
    return re.findall(r"^  (\w+) ", help_of(program).split("Subcommands:")[1], re.M)


@dataclass
class Entry:
    """An argument or option: its names, what it takes, and what it does."""
    names: str
    takes: str
    default: str
    meaning: str


def sections(text):
    """The parts of a help text by their titles; "" is what stands before the first."""
    found, title = {"": []}, ""
    for line in text.splitlines():
        head = re.fullmatch(r"(\w+):", line)
        if head:
            title = head.group(1)
            found[title] = []
        elif line and not line.startswith(" ") and title in ("Positionals", "Options", "Subcommands"):
            title = ""
            found[title].append(line)
        else:
            found[title].append(line)
    return found


def value_of(rest):
    """What an option takes, in words, and its default."""
    rest = re.sub(r"\s*\.\.\.$", "", rest)
    default = re.search(r"=(\[.*\]|\S*)$", rest)
    value = rest[:default.start()] if default else rest
    kind, _, limits = value.partition(":")
    words = {"INT": "whole number", "UINT": "whole number", "FLOAT": "number", "TEXT": "text", "BOOLEAN": "true or false"}
    takes = words.get(kind, kind)
    between = re.search(r"in \[(\S+) - (\S+)\]", limits)
    if between:
        takes += f", {between.group(1)} to {between.group(2)}"
    elif limits.startswith("{"):
        takes = ", ".join(f"`{choice}`" for choice in limits.strip("{}").split(","))
    elif limits:
        takes += f" {limits}"
    return takes, f"`{default.group(1).strip('[]')}`" if default and default.group(1) else ""


def entry_of(head, meaning):
    names, _, rest = head.partition(" ")
    excludes = re.search(r"\s*Excludes: (.*)$", rest)
    if excludes:
        rest = rest[:excludes.start()]
        meaning += f" (not with {', '.join(f'`{name}`' for name in excludes.group(1).split())})"
    is_required = rest.endswith(" REQUIRED")
    takes, default = value_of(rest.removesuffix(" REQUIRED"))
    return Entry(names.replace(",", ", "), takes, "required" if is_required else default, meaning)


def entries(lines):
    """Arguments or options; a long one has its description on the next line."""
    found = []
    for i, line in enumerate(lines):
        if not re.match(r"  \S", line):
            continue
        following = lines[i + 1] if i + 1 < len(lines) else ""
        if following.startswith(" " * COLUMN):
            found.append(entry_of(line.strip(), following.strip()))
        else:
            found.append(entry_of(line[:COLUMN].strip(), line[COLUMN:].strip()))
    return found


def table(lines):
    rows = "| | | takes | default |\n| --- | --- | --- | --- |\n"
    for entry in entries(lines):
        rows += f"| `{entry.names}` | {entry.meaning} | {entry.takes} | {entry.default} |\n".replace("<", "&lt;")
    return rows


def command_page(programs, name):
    parts = sections(help_of(programs / "nbdtree", name))
    description, usage = parts[""][0], next(line for line in parts[""] if line.startswith("Usage:"))
    text = f"# nbdtree {name}\n\n{description}.\n\n```text\n{usage.removeprefix('Usage: ')}\n```\n\n"
    if "Positionals" in parts:
        text += f"## Arguments\n\n{table(parts['Positionals'])}\n"
    notes = [line for line in parts[""][1:] if line and not line.startswith("Usage:")]
    if notes:
        text += " ".join(notes) + "\n\n"
    text += f"## Options\n\n{table(parts['Options'])}\n[Common options](README.md) work with every command.\n\n"
    examples = "\n".join(line.strip() for line in parts["Examples"] if line.strip())
    return text + f"## Examples\n\n```sh\n{examples}\n```\n"


def common_page(programs):
    parts = sections(help_of(programs / "nbdtree"))
    text = "# Commands\n\nEach command has `--help`; these pages are made from it.\n\n| command | what it does |\n| --- | --- |\n"
    for entry in entries(parts["Subcommands"]):
        text += f"| [`nbdtree {entry.names}`]({entry.names}.md) | {entry.meaning} |\n"
    text += f"\n## Common options\n\nThey stand before or behind the command.\n\n{table(parts['Options'])}\n"
    return text + """
Exit status: 0 done, 1 failed, 2 wrong usage, 130 interrupted. An error is one line on standard error. On a terminal, work of more
than a second shows how far it is.
"""
