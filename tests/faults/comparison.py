"""What of a file must be the same in every run."""

import re

TIME = re.compile(r"\w*?(_us|seconds)$")  # names of columns, and of values that --json prints
LONGEST = {"_us": 600e6, "seconds": 600}


def is_plausible_time(name, text):
    """Whether a value is how long a small run, or a part of it, took; tables may leave it out."""
    unit = TIME.match(name)
    try:
        return bool(unit) and 0 <= float(text) < LONGEST[unit[1]]
    except ValueError:
        return text in ("", "null")


def without_times(name, text):
    """Takes plausible times out of a table or of what --json prints: they differ from run to run."""
    if name.endswith(".json"):
        return re.sub(r'"(\w+)": ([^\s,]+)', lambda m: m[1] if is_plausible_time(m[1], m[2]) else m[0], text)
    titles, *rows = [line.split(",") for line in text.splitlines()]
    rows = [["" if is_plausible_time(title, x) else x for title, x in zip(titles, row)] + row[len(titles):] for row in rows]
    return "\n".join(",".join(row) for row in [titles, *rows])


def comparable(path):
    """The bytes of a file, without times."""
    return without_times(path.name, path.read_text()).encode() if path.suffix in (".csv", ".json") else path.read_bytes()
