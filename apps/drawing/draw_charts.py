#!/usr/bin/env python3
"""Draws a chart of a table that `nbdtree` or `nbdtree-bench` wrote.

    python3 draw_charts.py CHART TABLE.csv ... -o CHART.png      # or .svg, .pdf

  outside    tables of `nbdtree evaluate --csv`, one for each body: vertices outside by depth (figure 6 of the paper)
  radii      the same: radius error by depth (figure 7)
  margins    the same, of one --body: vertices outside by margin (figure 8)
  peers      peers.csv of `nbdtree-bench peers`: times of all methods
  figure5    figure5.csv of `nbdtree-bench fig5`: times by the number of faces (figure 5)
  physics    the table of `nbdtree-bench physics`: errors by size and step

Needs matplotlib (Debian: python3-matplotlib).
"""
import argparse
import csv
import math
import os
import sys
import tempfile
from pathlib import Path

try:
    import matplotlib

    matplotlib.use("Agg")  # needs no display
    import matplotlib.pyplot as plt
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator
    from PIL import Image
except ImportError:
    plt = None

# Distinguishable for colour-blind people [Okabe and Ito].
COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#555555"]
DASHES = ["-", "--", ":", "-."]
MARKERS = ["o", "s", "^", "D", "v", "P", "X"]
STYLE = {"font.size": 9, "axes.titlesize": 9.5, "axes.titleweight": "bold", "axes.grid": True, "grid.color": "#e4e4e8",
         "axes.axisbelow": True, "axes.spines.top": False, "axes.spines.right": False, "lines.linewidth": 1.5,
         "lines.markersize": 4, "legend.frameon": False, "text.parse_math": False, "savefig.dpi": 110,
         "figure.constrained_layout.use": True, "svg.hashsalt": "nbdtree"}


class Refused(Exception):
    """What is wrong with a table, in one line."""


class Table:
    """Rows of CSV files as dictionaries, whose `body` is by default the name of their file. Lines that begin with # say what it was
    measured on."""

    def __init__(self, *paths):
        self.path, self.rows = paths[0], []
        for path in paths:
            try:
                lines = path.read_text(encoding="utf-8").splitlines()
            except (OSError, UnicodeDecodeError) as error:
                raise Refused(f"{path}: cannot be read: {getattr(error, 'strerror', None) or 'is not a text'}") from error
            rows = list(csv.DictReader(line for line in lines if line and not line.startswith("#")))
            if not rows:
                raise Refused(f"{path}: has no rows to draw")
            self.rows += [{"body": path.stem, **row} for row in rows]

    def need(self, *columns):
        for column in columns:
            if self.rows[0].get(column) is None:
                raise Refused(f"{self.path}: has no column '{column}'; allowed: the table that the chart is for")

    def number(self, row, column):
        try:
            return float(row[column])
        except (TypeError, ValueError):
            raise Refused(f"{self.path}: {column} is '{row[column]}'; allowed: a number") from None


def distinct(values):
    return list(dict.fromkeys(values))


def label(text):
    """A text as a label: matplotlib leaves out labels that begin with an underscore."""
    return " " + text if text.startswith("_") else text


def plain(value, _=None):
    """5000 as 5,000, and 0.00001 as it is."""
    return f"{value:,.0f}" if abs(value) >= 1 else f"{value:.12f}".rstrip("0").rstrip(".")


def microseconds(value, _=None):
    unit, name = (1e6, "s") if value >= 1e6 else (1e3, "ms") if value >= 1e3 else (1, "us")
    return f"{plain(value / unit)} {name}"


def faces(value, _=None):
    return f"{value / 1e6:.2g}M" if value >= 999500 else f"{value / 1e3:.0f}k" if value >= 1000 else f"{value:g}"


def face_ticks(axis, values):
    """Ticks at the sizes of the bodies alone."""
    axis.set_major_locator(FixedLocator(sorted(set(values))))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(faces))


def log_scale(axes, values, axis="y"):
    """A logarithmic axis over `values`; if some are 0, they stand below a linear step at its end."""
    positive = [v for v in values if v > 0 and math.isfinite(v)]
    if not positive:
        return
    set_scale = axes.set_yscale if axis == "y" else axes.set_xscale
    low, high = math.floor(math.log10(min(positive))), math.ceil(math.log10(max(positive)))
    ticks = [10.0**k for k in range(low, max(high, low + 1) + 1)]
    if len(positive) < len(values):
        set_scale("symlog", linthresh=10.0**low, linscale=0.3)
        ticks.insert(0, 0)
    else:
        set_scale("log")
    of = axes.yaxis if axis == "y" else axes.xaxis
    of.set_major_locator(FixedLocator(ticks))
    of.set_minor_locator(NullLocator())
    of.set_major_formatter(FuncFormatter(plain))
    (axes.set_ylim if axis == "y" else axes.set_xlim)(-0.3 * 10.0**low if ticks[0] == 0 else ticks[0], ticks[-1])


def legend_below(figure, handles, columns):
    """A legend below all panels, where it covers nothing."""
    figure.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, 0), ncol=columns, handlelength=3)


def panels(rows, columns, width, height, **more):
    return plt.subplots(rows, columns, figsize=(width, height), squeeze=False, **more)


def by_depth(table, column, y_label, kinds, title):
    """A panel for each set of frames, a line for each body (colour) and kind of bounds (dash), at margin 0."""
    table.need("body", "frames", "bound", "margin", "depth", column)
    rows = [r for r in table.rows if table.number(r, "margin") == 0 and kinds(r["bound"])]
    if not rows:
        raise Refused(f"{table.path}: has no rows to draw at margin 0")
    sets, bodies, bounds = (distinct(r[key] for r in rows) for key in ("frames", "body", "bound"))
    figure, axes = panels(1, len(sets), max(5, 4 * len(sets)), 3.6, sharey=True)
    for panel, frames in zip(axes[0], sets):
        for b, body in enumerate(bodies):
            for k, bound in enumerate(bounds):
                of = [r for r in rows if (r["frames"], r["body"], r["bound"]) == (frames, body, bound)]
                points = sorted((table.number(r, "depth"), 100 * table.number(r, column)) for r in of)
                panel.plot(*zip(*points) if points else ([], []), color=COLOURS[b % len(COLOURS)],
                           ls=DASHES[k % len(DASHES)], marker=MARKERS[k % len(MARKERS)])
        panel.set(title=frames, xlabel="depth of the node")
        panel.xaxis.set_major_locator(FixedLocator(sorted({table.number(r, "depth") for r in rows})))
    log_scale(axes[0][0], [100 * table.number(r, column) for r in rows])
    axes[0][0].set_ylabel(y_label)
    figure.suptitle(title, fontsize=10.5)
    handles = [plt.Line2D([], [], color=COLOURS[b % len(COLOURS)], lw=3, label=label(body)) for b, body in enumerate(bodies)]
    handles += [plt.Line2D([], [], color="#333333", ls=DASHES[k % len(DASHES)], marker=MARKERS[k % len(MARKERS)],
                           label=label(bound)) for k, bound in enumerate(bounds)]
    legend_below(figure, handles, 4)
    return figure


def is_learned(kind):
    """Bounds that are learned and may leave vertices outside."""
    return kind == "nbd" or kind.startswith("learned")


def outside(table, _):
    return by_depth(table, "vertices_outside", "vertices outside, %", is_learned,
                    "Vertices outside their node's sphere, without margin")


def radii(table, _):
    return by_depth(table, "radius_error", "mean radius error, %", lambda kind: kind != "exact",
                    "Radius error relative to the exact sphere, without margin")


def margins(table, options):
    """A panel for each set of frames and kind of bounds, a line for each depth."""
    table.need("body", "frames", "bound", "margin", "depth", "vertices_outside")
    body = options.body or table.rows[0]["body"]
    rows = [r for r in table.rows if r["body"] == body and is_learned(r["bound"])]
    if not rows:
        raise Refused(f"{table.path}: has no rows of body '{body}'; allowed: "
                      f"{', '.join(distinct(r['body'] for r in table.rows))}")
    sets, bounds = (distinct(r[key] for r in rows) for key in ("frames", "bound"))
    depths = sorted({int(table.number(r, "depth")) for r in rows})
    shade = plt.get_cmap("viridis")
    figure, axes = panels(len(bounds), len(sets), max(5, 4 * len(sets)), 0.8 + 2.6 * len(bounds), sharex=True, sharey=True)
    for row, bound in zip(axes, bounds):
        for panel, frames in zip(row, sets):
            for depth in depths:
                of = [r for r in rows if (r["frames"], r["bound"]) == (frames, bound) and int(r["depth"]) == depth]
                points = sorted((100 * table.number(r, "margin"), 100 * table.number(r, "vertices_outside")) for r in of)
                panel.plot(*zip(*points) if points else ([], []), color=shade(0.9 * depth / max(depths[-1], 1)))
            panel.set_title(f"{bound}, {frames}")
        row[0].set_ylabel("vertices outside, %")
    for panel in axes[-1]:
        panel.set_xlabel("margin, % of the radius")
    log_scale(axes[0][0], [100 * table.number(r, "vertices_outside") for r in rows])
    figure.suptitle(f"{body}: vertices outside by margin", fontsize=10.5)
    legend_below(figure, [plt.Line2D([], [], color=shade(0.9 * d / max(depths[-1], 1)), label=f"depth {d}") for d in depths], 4)
    return figure


def peers(table, _):
    """A panel for each kind of contact, a line of dots for each method: one dot for each size of the bodies."""
    table.need("contact", "faces", "method", "total_us", "failure")
    rows = [r for r in table.rows if not r["failure"]]
    if not rows:
        raise Refused(f"{table.path}: has no rows to draw: all methods failed")
    contacts = distinct(r["contact"] for r in rows)
    sizes = sorted({int(table.number(r, "faces")) for r in rows})
    largest = {r["method"]: table.number(r, "total_us") for r in sorted(rows, key=lambda r: int(r["faces"]))}
    methods = sorted(largest, key=largest.get, reverse=True)
    shade = plt.get_cmap("viridis_r")
    figure, axes = panels(1, len(contacts), 3 + 3.4 * len(contacts), 1.5 + 0.17 * len(methods), sharex=True, sharey=True)
    colour = {size: shade(0.12 + 0.88 * i / max(len(sizes) - 1, 1)) for i, size in enumerate(sizes)}
    for panel, contact in zip(axes[0], contacts):
        for y, method in enumerate(methods):
            points = sorted((int(r["faces"]), table.number(r, "total_us")) for r in rows
                            if (r["contact"], r["method"]) == (contact, method))
            panel.plot([t for _, t in points], [y] * len(points), color="#c8c8ce", lw=1, zorder=1)
            panel.scatter([t for _, t in points], [y] * len(points), c=[colour[size] for size, _ in points], s=18, zorder=2)
        panel.set(title=f"{contact} contact", xlabel="update and query of both bodies")
    axes[0][0].set_yticks(range(len(methods)), [label(m) for m in methods])
    log_scale(axes[0][0], [table.number(r, "total_us") for r in rows], "x")
    axes[0][0].xaxis.set_major_formatter(FuncFormatter(microseconds))
    figure.suptitle("Intersecting faces of two deforming bodies, one thread", fontsize=10.5)
    legend_below(figure, [plt.Line2D([], [], color=colour[size], marker="o", ls="", label=f"{faces(size)} faces each")
                          for size in sizes], 4)
    return figure


def figure5(table, _):
    """Panels of the whole time and its two parts, a line for each method."""
    table.need("faces", "method", "total_us", "update_us", "query_us", "failure")
    rows = [r for r in table.rows if not r["failure"]]
    if not rows:
        raise Refused(f"{table.path}: has no rows to draw: all methods failed")
    methods = distinct(r["method"] for r in rows)
    parts = {"total": "total_us", "update": "update_us", "collision": "query_us"}
    figure, axes = panels(1, 3, 9.5, 3.4, sharey=True)
    for panel, (part, column) in zip(axes[0], parts.items()):
        for i, method in enumerate(methods):
            points = sorted((table.number(r, "faces"), table.number(r, column)) for r in rows if r["method"] == method)
            panel.plot(*zip(*points), color=COLOURS[i % len(COLOURS)], ls=DASHES[i // len(COLOURS) % len(DASHES)],
                       marker=MARKERS[i % len(MARKERS)], label=label(method))
        panel.set_xscale("log")
        face_ticks(panel.xaxis, [table.number(r, "faces") for r in rows])
        panel.set(title=part, xlabel="faces of each body")
    log_scale(axes[0][0], [table.number(r, column) for r in rows for column in parts.values()])
    axes[0][0].set_ylabel("median of a frame, us")
    figure.suptitle("Time of a frame, two bodies, one thread", fontsize=10.5)
    legend_below(figure, axes[0][0].get_legend_handles_labels()[0], 5)
    return figure


# Upper limits of a largest error over what is allowed, colours and meanings.
SHADES = [(0.1, "#2971a8", "a tenth of the allowed error at most"), (1, "#9eccE6", "holds"),
          (10, "#fcbf70", "up to ten times the allowed error"), (1e3, "#e66121", "up to a thousand times"),
          (math.inf, "#73051a", "more, or a step failed")]
SIZES = [(0.03, "1 cm"), (0.3, "10 cm"), (3, "1 m"), (math.inf, "10 m")]  # upper limits in metres
STEPS = [(3e-4, "0.1"), (2e-3, "1"), (7e-3, "5"), (math.inf, "20")]  # upper limits in seconds; labels in ms


def place(limits, value):
    return next(i for i, limit in enumerate(limits) if value <= limit[0])


def physics(table, _):
    """A row of cells for each check: by size and step, coloured by the largest error over what is allowed."""
    table.need("check", "size_m", "dt_s", "error", "allowed")
    checks = distinct(r["check"] for r in table.rows)
    worst, held = {}, dict.fromkeys(checks, True)
    for row in table.rows:
        error, allowed = table.number(row, "error"), table.number(row, "allowed")
        ratio = error / allowed if allowed > 0 else math.inf if error > 0 else 0
        held[row["check"]] &= ratio <= 1
        at = (checks.index(row["check"]), 4 * place(SIZES, table.number(row, "size_m")) + place(STEPS, table.number(row, "dt_s")))
        worst[at] = max(worst.get(at, 0), math.inf if math.isnan(ratio) else ratio)
    figure, axes = panels(1, 1, 6.2, 1 + 0.19 * len(checks))
    panel = axes[0][0]
    cells = [[1 + place(SHADES, worst[c, k]) if (c, k) in worst else 0 for k in range(16)] for c in range(len(checks))]
    panel.pcolormesh(cells, cmap=ListedColormap(["#efefef", *(colour for _, colour, _ in SHADES)]), vmin=0,
                     vmax=len(SHADES), edgecolors="white", linewidth=1)
    for k in (4, 8, 12):
        panel.axvline(k, color="white", lw=5)
    panel.set_xticks([k + 0.5 for k in range(16)], [step for _, step in STEPS] * 4, fontsize=6.5)
    panel.tick_params(length=0)
    panel.grid(False)
    panel.spines[:].set_visible(False)
    panel.set_xlabel("step, ms")
    for i, (_, size) in enumerate(SIZES):
        panel.text(4 * i + 2, -0.4, size, ha="center", va="bottom", fontsize=8)
    panel.set_yticks([c + 0.5 for c in range(len(checks))], [label(c) for c in checks], fontsize=8)
    for tick, check in zip(panel.get_yticklabels(), checks):
        tick.set_fontweight("normal" if held[check] else "bold")
    panel.set_ylim(len(checks), 0)
    legend_below(figure, [Patch(color=colour, label=text) for _, colour, text in SHADES], 2)
    return figure


CHARTS = {chart.__name__: chart for chart in (outside, radii, margins, peers, figure5, physics)}


def save(figure, path):
    """Writes under a temporary name beside `path`, then renames."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=path.suffix)
    os.close(handle)
    try:
        metadata = {"Date": None} if path.suffix == ".svg" else {"CreationDate": None} if path.suffix == ".pdf" else None
        figure.savefig(temporary, bbox_inches="tight", pad_inches=0.08, metadata=metadata)
        if path.suffix == ".png":  # a palette makes files a third as large
            with Image.open(temporary) as image:
                small = image.convert("RGB").quantize(255, kmeans=2)
            small.save(temporary, optimize=True)
        os.chmod(temporary, 0o666 & ~umask())
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def umask():
    mask = os.umask(0)
    os.umask(mask)
    return mask


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("chart", metavar="CHART", choices=CHARTS, help=", ".join(CHARTS))
    parser.add_argument("tables", metavar="TABLE", type=Path, nargs="+", help="CSV")
    parser.add_argument("-o", "--output", type=Path, required=True, help="picture to write: .png, .svg or .pdf")
    parser.add_argument("--body", help="of `margins`; default: the first of the table")
    options = parser.parse_args()
    if plt is None:
        sys.exit("error: charts need matplotlib, which python3 lacks; install Debian's python3-matplotlib")
    try:
        if options.output.suffix not in (".png", ".svg", ".pdf"):
            raise Refused(f"{options.output}: cannot be written: allowed: .png, .svg, .pdf")
        with plt.rc_context(STYLE):
            save(CHARTS[options.chart](Table(*options.tables), options), options.output)
    except Refused as refused:
        sys.exit(f"error: {refused}")
    except OSError as error:
        sys.exit(f"error: {options.output}: cannot be written: {error.strerror}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
