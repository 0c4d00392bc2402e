"""Charts of apps/drawing/draw_charts.py: what a table shows, and what is said of one that cannot be drawn."""

import importlib.util
import os
import pathlib
import subprocess
import sys

import pytest

pytest.importorskip("matplotlib")

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "apps" / "drawing" / "draw_charts.py"
RESULTS = SCRIPT.parents[1] / "results"

spec = importlib.util.spec_from_file_location("draw", SCRIPT)
draw = importlib.util.module_from_spec(spec)
spec.loader.exec_module(draw)

BOUNDS = "body,frames,bound,margin,depth,radius_error,vertices_outside\n"
PEERS = "contact,faces,method,total_us,update_us,query_us,failure\n"


@pytest.fixture
def table(tmp_path):
    def write(text):
        path = tmp_path / "table.csv"
        path.write_text(text)
        return path
    return write


def run(*arguments, **more):
    return subprocess.run([sys.executable, SCRIPT, *map(str, arguments)], capture_output=True, text=True, **more)


def figure_of(chart, path, **options):
    """The figure that a chart makes of a table."""
    given = {"body": None, **options}
    with draw.plt.rc_context(draw.STYLE):
        return draw.CHARTS[chart](draw.Table(path), type("Options", (), given))


@pytest.mark.parametrize("chart, name", [("peers", "armadillos.csv"), ("figure5", "figure5.csv"),
                                         ("outside", "figures/bounds.csv"), ("radii", "figures/bounds.csv"),
                                         ("margins", "figures/bounds.csv")])
def test_committed_tables_are_drawn(chart, name, tmp_path):
    for suffix, beginning in {".png": b"\x89PNG", ".svg": b"<?xml"}.items():
        picture = tmp_path / ("chart" + suffix)
        draw.save(figure_of(chart, RESULTS / name), picture)
        assert picture.read_bytes().startswith(beginning)
    assert {path.name for path in tmp_path.iterdir()} == {"chart.png", "chart.svg"}


def test_a_chart_is_drawn_by_one_command(tmp_path):
    done = run("peers", RESULTS / "scans_13k.csv", "-o", tmp_path / "peers.png")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert (tmp_path / "peers.png").read_bytes().startswith(b"\x89PNG")


def test_lines_are_the_numbers_of_the_table(table):
    rows = [("A_1", "held-out", "nbd", 0, d, 0.1, share) for d, share in enumerate((0, 1e-3, 1e-1))]
    rows += [("A_1", "held-out", "nbd", 0.05, 0, 0.1, 0.5), ("A_1", "held-out", "exact", 0, 0, 0, 0)]
    path = table(BOUNDS + "".join(",".join(map(str, row)) + "\n" for row in rows))
    [axes] = figure_of("outside", path).axes
    [line] = axes.lines  # `exact` never misses, and other margins have a chart of their own
    assert line.get_xydata().tolist() == [[0, 0], [1, 0.1], [2, 10]]
    place = axes.transData.transform
    assert place((0, 0))[1] < place((0, 0.1))[1]  # zero has a place below the lowest power of ten
    assert place((0, 10))[1] - place((0, 1))[1] == pytest.approx(place((0, 1))[1] - place((0, 0.1))[1], rel=1e-3)


def test_peers_are_sorted_by_their_time_and_failures_left_out(table):
    path = table(PEERS + "light,1000,slow,90,1,89,\nlight,1000,fast,3,1,2,\nlight,1000,broken,0,0,0,out of memory\n")
    axes = figure_of("peers", path).axes[0]
    assert [text.get_text() for text in axes.get_yticklabels()] == ["slow", "fast"]
    assert "1 us" in [axes.xaxis.get_major_formatter()(tick) for tick in axes.get_xticks()]


def test_labels_are_shown_as_they_are(table, tmp_path):
    odd = ["_first", "$x^2$", "a\\b", 'say ""so""', "\u03b1, \u03b2"]
    path = table(PEERS + "".join(f'light,1000,"{name}",{i + 1},1,1,\n' for i, name in enumerate(odd)))
    draw.save(figure_of("figure5", path), tmp_path / "odd.svg")
    shown = [text.get_text().strip() for text in figure_of("figure5", path).legends[0].get_texts()]
    assert shown == [name.replace('""', '"') for name in odd]


def test_legends_cover_no_panel(table):
    """Even those of forty methods with long names."""
    path = table(PEERS + "".join(f"light,{faces},{'m' * 40}{i},{i + 1},1,1,\n" for i in range(40) for faces in (10, 1000)))
    for chart in ("peers", "figure5"):
        figure = figure_of(chart, path)
        figure.canvas.draw()
        legend = figure.legends[0].get_window_extent()
        assert not any(legend.overlaps(axes.get_window_extent()) for axes in figure.axes)


def test_worst_cells_of_physics_are_shown(table):
    columns = "# a machine\ncheck,size_m,dt_s,error,allowed\n"
    path = table(columns + "fall,0.01,0.0001,0.05,1\nfall,0.01,0.0001,5,1\nrest,10,0.02,inf,1\n")
    (panel,) = figure_of("physics", path).axes
    cells = panel.collections[0].get_array().reshape(2, 16)
    assert cells[0, 0] == 3 and cells[0].sum() == 3  # the third shade: up to ten times what is allowed
    assert cells[1, 15] == 5


@pytest.mark.parametrize("text, error", [
    ("", "table.csv: has no rows to draw"),
    ("# a machine\n" + PEERS, "table.csv: has no rows to draw"),
    ("contact\nlight\n", "table.csv: has no column 'faces'; allowed: the table that the chart is for"),
    (PEERS + "light,1000,a,much,1,1,\n", "table.csv: total_us is 'much'; allowed: a number"),
    (PEERS + "light,1000,a,1,1,1,out of memory\n", "table.csv: has no rows to draw: all methods failed"),
])
def test_what_cannot_be_drawn_is_told_in_one_line(table, text, error):
    with pytest.raises(draw.Refused) as refused:
        figure_of("peers", table(text))
    assert str(refused.value).endswith(error) and "\n" not in str(refused.value)


def test_paths_that_cannot_be_used_are_told_in_one_line(table, tmp_path):
    good = table(PEERS + "light,1000,a,1,1,1,\n")
    for arguments, error in [((tmp_path / "none.csv", "-o", tmp_path / "a.png"), "none.csv: cannot be read: No such file"),
                             ((good, "-o", tmp_path / "a.txt"), "a.txt: cannot be written: allowed: .png, .svg, .pdf"),
                             ((good, "-o", tmp_path / "none" / "a.png"), "a.png: cannot be written: No such file")]:
        done = run("peers", *arguments)
        assert done.returncode == 1 and error in done.stderr and done.stderr.count("\n") == 1, done.stderr


def test_tables_of_bodies_are_drawn_beside_each_other(tmp_path):
    paths = [tmp_path / f"{body}.csv" for body in ("ONE", "TWO")]
    for path in paths:
        path.write_text(BOUNDS.removeprefix("body,") + "held-out,nbd,0,0,0.1,0.5\n")
    assert [row["body"] for row in draw.Table(*paths).rows] == ["ONE", "TWO"]
    assert run("outside", *paths, "-o", tmp_path / "a.png").returncode == 0


def test_matplotlib_is_named_where_it_is_missing(tmp_path):
    (tmp_path / "matplotlib.py").write_text("raise ImportError\n")
    done = run("outside", "none.csv", "-o", "a.png", env={**os.environ, "PYTHONPATH": str(tmp_path)})
    assert done.returncode == 1 and done.stderr == ("error: charts need matplotlib, which python3 lacks; install Debian's "
                                                    "python3-matplotlib\n")


def test_an_older_picture_stays_where_a_new_one_fails(table, tmp_path):
    picture = tmp_path / "chart.png"
    picture.write_bytes(b"older")
    assert run("peers", table(PEERS), "-o", picture).returncode == 1
    assert picture.read_bytes() == b"older"
