#!/usr/bin/env python3
"""Measures what `nbdtree simulate --live` costs a run.

    apps/results/live.py NBDTREE SCENE [--frames 100] [--repeats 5] [--chromium] [-o FILE.csv]

Runs SCENE in turns without a page; with --live that nobody asks; and with a reader that asks for all frames as a page
does. With --chromium, in headless Chromium too, which draws on the processor here. Seconds are of the whole run, and of all
of its threads (CPU); medians. The browser's own work is not in the CPU seconds of the run.
"""
import argparse
import json
import re
import resource
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "apps" / "view"))


def read_all(url, got):
    """Asks as page/live.js does; appends the number of frames."""
    page = urllib.request.urlopen(url).read().decode()
    run = json.loads(re.search(r'id="facts">(.*?)</script>', page)[1])["live"]["run"]
    frames = 1
    while True:
        answer = json.load(urllib.request.urlopen(f"{url}frames?run={run}&from={frames}"))
        frames += len(answer["frames"])
        if not answer["frames"] and answer["state"] != "running":
            break
        if not answer["frames"]:
            time.sleep(0.2)
    got.append(frames)


def measure(command, live, reader):
    """Seconds and CPU seconds of a run."""
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    process = subprocess.Popen(command + (["--live"] if live else []), stderr=subprocess.PIPE, text=True)
    got, thread = [], None
    if live:
        url = re.search(r"http://\S+", process.stderr.readline())[0]
        if reader == "script":
            thread = threading.Thread(target=read_all, args=(url, got))
            thread.start()
        elif reader:
            reader.driver.get(url)
    errors = process.communicate()[1]
    seconds = time.monotonic() - begun
    assert process.returncode == 0, errors
    if thread:
        thread.join()
        assert got and got[0] > 1
    elif reader:
        assert reader.run("return nbdtree.facts.times.length") > 1
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return seconds, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--chromium", action="store_true")
    parser.add_argument("-o", "--output", type=Path, help="table to write (CSV)")
    arguments = parser.parse_args()
    ways = {"no server": (False, None), "no page": (True, None), "a reader": (True, "script")}
    browser = None
    if arguments.chromium:
        from browser import Browser
        browser = Browser()
        ways["Chromium"] = (True, browser)
    seconds = {way: [] for way in ways}
    with tempfile.TemporaryDirectory(prefix="nbdtree_live_") as folder:
        command = [str(arguments.program), "simulate", str(arguments.scene), "-o", f"{folder}/run.h5", "--frames",
                   str(arguments.frames), "-q"]
        for _ in range(arguments.repeats):
            for way, (live, reader) in ways.items():
                seconds[way].append(measure(command, live, reader))
    if browser:
        browser.driver.quit()
    table = "page,frames,seconds,cpu_seconds\n"
    for way, times in seconds.items():
        wall, cpu = (statistics.median(values) for values in zip(*times))
        table += f"{way},{arguments.frames},{wall:.2f},{cpu:.2f}\n"
    if arguments.output:
        arguments.output.write_text(table)
    print(table, end="")


if __name__ == "__main__":
    main()
