"""Makes a page for each command of a program from what its --help prints."""
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


def without_groups(text):
    """The lines of a help text, with the options of groups among the others: CLI11 puts them behind and indents them."""
    in_group = False
    for line in text.splitlines():
        if line.startswith("[Option Group"):
            in_group = True
        elif not in_group or not line:
            in_group = False
            yield line
        elif line.startswith("    "):
            yield line[2:]
        # What is left are titles, such as "  [Exactly 1 of the following options is required]" and "  Options:".


def sections(text):
    """The parts of a help text by their titles; "" is what stands before the first."""
    found, title = {"": []}, ""
    for line in without_groups(text):
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
    for word, how in (("Excludes", "not"), ("Needs", "only")):
        others = re.search(rf"\s*\b{word}: (.*)$", rest)
        if others:
            rest = rest[:others.start()]
            meaning += f" ({how} with {', '.join(f'`{name}`' for name in others.group(1).split())})"
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


def command_page(program, name, common_options):
    """common_options: link to the page of the options that every command has."""
    parts = sections(help_of(program, name))
    description, usage = parts[""][0], next(line for line in parts[""] if line.startswith("Usage:"))
    text = f"# {program.name} {name}\n\n{description.rstrip('.')}.\n\n```text\n{usage.removeprefix('Usage: ')}\n```\n\n"
    if "Positionals" in parts:
        text += f"## Arguments\n\n{table(parts['Positionals'])}\n"
    notes = [line for line in parts[""][1:] if line and not line.startswith("Usage:")]
    if notes:
        text += " ".join(notes) + "\n\n"
    text += f"## Options\n\n{table(parts['Options'])}\n[Common options]({common_options}) work with every command.\n\n"
    examples = "\n".join(line.strip() for line in parts.get("Examples", []) if line.strip())
    return text + (f"## Examples\n\n```sh\n{examples}\n```\n" if examples else "")


def list_page(program, title):
    """The commands of a program, each with a link to its page in the same folder."""
    parts = sections(help_of(program))
    text = f"# {title}\n\n{parts[''][0]} Each command has `--help`; these pages are made from it.\n\n"
    text += "| command | what it does |\n| --- | --- |\n"
    for entry in entries(parts["Subcommands"]):
        text += f"| [`{program.name} {entry.names}`]({entry.names}.md) | {entry.meaning} |\n"
    return text


def common_options(program):
    """The options of every command, and the exit statuses."""
    parts = sections(help_of(program))
    return f"\n## Common options\n\nThey stand before or behind the command.\n\n{table(parts['Options'])}\n" + """
Exit status: 0 done, 1 failed, 2 wrong usage, 130 interrupted. An error is one line on standard error. On a terminal, work of more
than a second shows how far it is.
"""
