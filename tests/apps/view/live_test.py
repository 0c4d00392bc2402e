#!/usr/bin/env python3
"""Follows runs of `nbdtree simulate --live` in a headless Chromium that reaches the loopback address alone.

    live_test.py NBDTREE ASSETS

Exit status 77, for ctest: Chromium, selenium or h5py is not there.
"""
import http.client
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

from needs import need

need("h5py", "numpy")
import h5py
import numpy as np
from browser import Browser

NBDTREE, ASSETS = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
HANGS = 1800  # seconds after which anything counts as hanging
RINGS = ASSETS / "scenes" / "rings.json"


class Run:
    """A run in the background, which stays at each of the frames `stays` until let_go() or Ctrl-C; `port` is where it shows
    itself."""

    def __init__(self, folder, *arguments, stays=()):
        self.folder, self.stays = folder, list(stays)
        for frame in stays:
            self.file_of(frame).unlink(missing_ok=True)
        at = ";".join(f"frames|{frame}|wait|{self.file_of(frame)}" for frame in stays)
        self.process = subprocess.Popen([NBDTREE, "simulate", *map(str, arguments), "-q"], cwd=folder, text=True,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**os.environ, "NBDTREE_AT": at})
        line = self.process.stderr.readline()
        found = re.fullmatch(r"nbdtree: (http://127\.0\.0\.1:(\d+)/) shows the run\n", line)
        assert found, line + self.process.stderr.read()
        self.url, self.port = found[1], int(found[2])

    def file_of(self, frame):
        return self.folder / f"go_on_from_{frame}"

    def let_go(self):
        """Lets the run go on to the next frame at which it stays, or to its end."""
        self.file_of(self.stays.pop(0)).touch()

    def end(self, interrupt=False):
        """Waits for the end; returns the exit status and what is on standard error."""
        if interrupt:
            self.process.send_signal(signal.SIGINT)
        error = self.process.communicate(timeout=HANGS)[1]
        return self.process.returncode, error

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.communicate()

    def ask(self, path, method="GET", host=None):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=HANGS)
        connection.request(method, path, headers={"Host": host} if host else {})
        response = connection.getresponse()
        return response.status, response.read().decode(), response.headers


class LiveTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="nbdtree_live_"))
        cls.browser = Browser()

    @classmethod
    def tearDownClass(cls):
        cls.browser.driver.quit()
        shutil.rmtree(cls.folder)

    def wait_for(self, script, seconds=HANGS):
        """Waits until an expression of the page is true, and returns it."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            value = self.browser.run(f"return {script}")
            if value:
                return value
            if "=== 'stopped'" in script and self.browser.run("return document.getElementById('live').className") == "lost":
                self.fail("the run ended before the page could ask, which then had no time to draw for ten seconds")
            time.sleep(0.02)
        self.fail(f"never true: {script}; the page says: {self.browser.driver.find_element('id', 'title').text}")

    def open(self, run):
        self.browser.open(run.url)
        self.addCleanup(lambda: self.assertEqual(self.browser.complaints(), []))

    def check_frames(self, path, frames):
        """The page's last frames are those of the recording."""
        with h5py.File(self.folder / path) as file:
            for body in (0, 1):
                recorded = file[f"trajectories/{body:06}/positions"][:].astype(float)
                for frame in frames:
                    self.browser.seek(frame)
                    number = self.browser.run("return nbdtree.facts.numbers[nbdtree.frame()]")
                    shown = np.array(self.browser.run("return Array.from(nbdtree.nodes(arguments[0]))", body)).reshape(-1, 3)
                    step = (recorded[number].max(axis=0) - recorded[number].min(axis=0)) / 65535
                    self.assertLess((np.abs(shown - recorded[number]) / step).max(), 0.6)

    def test_shows_frames_as_they_come_and_the_end(self):
        with Run(self.folder, RINGS, "-o", "seen.h5", "--frames", 150, "--live", stays=(20, 60, 100)) as run:
            self.open(run)
            self.assertEqual(self.browser.run("return document.getElementById('live').className"), "running")
            self.wait_for("nbdtree.facts.times.length === 21")
            run.let_go()
            # The page follows the run.
            self.wait_for("nbdtree.frame() > 20")
            # It can be scrubbed meanwhile, and stays where it is while frames are added.
            slider = self.browser.driver.find_element("id", "frame")
            self.browser.run("arguments[0].value = 1; arguments[0].dispatchEvent(new Event('input'))", slider)
            count = self.browser.run("return nbdtree.facts.times.length")
            run.let_go()
            self.wait_for(f"nbdtree.facts.times.length > Math.max(61, {count} + 3)")
            self.assertEqual(self.browser.run("return nbdtree.frame()"), 1)
            self.assertIsNone(run.process.poll())
            run.let_go()
            self.browser.run("nbdtree.choose('colour', 'von Mises stress'); nbdtree.choose('show-bounds', true)")
            status, error = run.end()
            self.assertEqual((status, error), (0, ""))
            self.wait_for("document.getElementById('live').className === 'done'")
        title = self.browser.driver.find_element("id", "live").text
        self.assertIn("Done", title)
        self.assertIn("151 of 151 frames", title)
        self.browser.resize(360, 640)
        self.addCleanup(lambda: self.browser.resize(1280, 800))
        self.assertTrue(self.browser.run("""
            const [live, legend] = ['live', 'legend'].map((id) => document.getElementById(id).getBoundingClientRect());
            return live.height > 0 && legend.height > 0 && live.bottom <= legend.top && live.right <= innerWidth;"""))
        self.check_frames("seen.h5", (0, 1, 75, 150))
        # What it shows besides is what `view` shows.
        subprocess.run([NBDTREE, "view", "seen.h5", "-o", "seen.html", "-q"], cwd=self.folder, check=True)
        live = self.browser.run("return [nbdtree.facts.pairs, nbdtree.facts.times]")
        marked = "const r = []; for (const f of [20, 90, 150]) { nbdtree.seek(f); r.push(nbdtree.marked(0, 'near')); } return r;"
        live_marks = self.browser.run(marked)
        requests = self.browser.requests()
        self.assertTrue(all(address.startswith(run.url) for address in requests), requests)
        self.browser.open(self.folder / "seen.html")
        self.assertEqual(self.browser.run("return [nbdtree.facts.pairs, nbdtree.facts.times]"), live)
        self.assertEqual(self.browser.run(marked), live_marks)
        self.assertTrue(any(live_marks))
        # The same run that nobody looks at.
        subprocess.run([NBDTREE, "simulate", RINGS, "-o", "alone.h5", "--frames", "150", "-q"], cwd=self.folder, check=True)
        self.assertEqual((self.folder / "seen.h5").read_bytes(), (self.folder / "alone.h5").read_bytes())

    def test_says_when_the_run_is_stopped_and_shows_it_again_when_it_goes_on(self):
        with Run(self.folder, RINGS, "-o", "stopped.h5", "--frames", 400, "--live", 0, stays=(30,)) as run:
            self.open(run)
            self.wait_for("nbdtree.facts.times.length > 5")
            status, error = run.end(interrupt=True)
            self.assertEqual(status, 130)
            self.assertIn("interrupted", error)
            self.wait_for("document.getElementById('live').className === 'stopped'")
        with h5py.File(self.folder / "stopped.h5") as file:
            recorded = len(file["trajectories/000000/times"])
        # Of 401 frames a page shows 300.
        shown = self.browser.run("return nbdtree.facts.numbers")
        self.assertEqual(shown, [n for n in (i * 400 / 299 for i in range(300)) for n in [int(n + 0.5)] if n < recorded])
        with Run(self.folder, RINGS, "-o", "stopped.h5", "--frames", 400, "--resume", "--live", stays=(70,)) as run:
            self.open(run)
            self.wait_for(f"nbdtree.facts.times.length > {len(shown)}")
            run.end(interrupt=True)
            self.wait_for("document.getElementById('live').className === 'stopped'")

    def test_says_that_the_run_has_failed_and_why(self):
        scene = json.loads(RINGS.read_text())
        for body in scene["bodies"]:
            for key in ("surface", "body"):
                if key in body:
                    body[key] = str((RINGS.parent / body[key]).resolve())
        scene["bodies"][0]["velocity"] = [0, 0, 200]
        scene["time"] = {"dt": 0.005, "frames": 1000}
        (self.folder / "fast.json").write_text(json.dumps(scene))
        with Run(self.folder, "fast.json", "-o", "failed.h5", "--strict", "--live", "--keep-live") as run:
            self.open(run)
            self.wait_for("document.getElementById('live').className === 'failed'")
            text = self.browser.driver.find_element("id", "live").text
            self.assertRegex(text, "^Failed: .+ · [0-9]+ of 300 frames$")
            status, error = run.end(interrupt=True)
            self.assertEqual(status, 1)
            reason = re.match("Failed: (.+) ·", text)[1]
            self.assertIn(f"nbdtree: the run has failed: {reason}; {run.url} shows it until Ctrl-C\n", error)
            self.assertIn(f"s: {reason}\n", error)

    def test_serves_after_the_end_only_if_asked(self):
        with Run(self.folder, RINGS, "-o", "kept.h5", "--frames", 2, "--live", "--keep-live") as run:
            self.assertEqual(run.process.stderr.readline(), f"nbdtree: the run has ended; {run.url} shows it until Ctrl-C\n")
            self.open(run)
            self.wait_for("document.getElementById('live').className === 'done'")
            self.assertEqual(self.browser.run("return nbdtree.facts.times.length"), 3)
            with h5py.File(self.folder / "kept.h5") as file:  # it is whole while the page is served
                self.assertEqual(len(file["trajectories/000000/times"]), 3)
            self.assertEqual(run.end(interrupt=True), (0, ""))
        with Run(self.folder, RINGS, "-o", "short.h5", "--frames", 2, "--live") as run:
            self.assertEqual(run.end(), (0, ""))

    def test_a_page_whose_run_is_killed_says_so(self):
        with Run(self.folder, RINGS, "-o", "killed.h5", "--frames", 400, "--live", stays=(30,)) as run:
            self.browser.open(run.url)
            self.wait_for("nbdtree.facts.times.length > 1")
            run.process.kill()
            run.process.communicate()
            self.wait_for("document.getElementById('live').className === 'lost'")
        self.assertTrue(all("ERR_CONNECTION" in complaint for complaint in self.browser.complaints()))

    def test_a_page_that_cannot_take_a_frame_says_so(self):
        with Run(self.folder, RINGS, "-o", "untaken.h5", "--frames", 400, "--live", stays=(5, 30)) as run:
            self.browser.open(run.url)
            self.browser.run("nbdtree.live.take = async () => { throw new Error('no memory'); };")
            run.let_go()
            self.wait_for("document.getElementById('live').className === 'failed'")
            self.assertRegex(self.browser.driver.find_element("id", "live").text,
                             "^Failed: this page cannot show the next frames: no memory · ")
            self.assertIsNone(run.process.poll())
        self.assertIn("no memory", self.browser.complaints()[0])

    def test_answers_only_reads_of_its_own_name_on_the_loopback_address(self):
        with Run(self.folder, RINGS, "-o", "asked.h5", "--frames", 400, "--live", stays=(5,)) as run:
            status, page, headers = run.ask("/")
            self.assertEqual(status, 200)
            self.assertIn("connect-src 'self'", page)
            self.assertEqual(headers["Cache-Control"], "no-store")
            name = json.loads(re.search(r'id="facts">(.*?)</script>', page)[1])["live"]["run"]
            status, answer, _ = run.ask(f"/frames?run={name}&from=1")
            self.assertEqual((status, json.loads(answer)["state"]), (200, "running"))
            for path, expected in [(f"/frames?run={name}&from=-1", 400), (f"/frames?run={name}&from=1e3", 400),
                                   (f"/frames?run={name}&from=99999999999999999999", 400), (f"/frames?run={name}", 400),
                                   ("/frames?run=other&from=1", 410), ("/frames?from=1", 410), ("/run.h5", 404),
                                   ("/../etc/passwd", 404), ("//", 404)]:
                self.assertEqual(run.ask(path)[0], expected, path)
            self.assertEqual(json.loads(run.ask(f"/frames?run={name}&from=1000000")[1])["frames"], [])
            for method in ("POST", "PUT", "DELETE", "PATCH", "OPTIONS"):
                self.assertEqual(run.ask("/", method)[0], 405, method)
            self.assertEqual(run.ask("/", "HEAD")[0], 200)
            self.assertEqual(run.ask("/", host=f"localhost:{run.port}")[0], 200)
            for host in ("evil.example", f"evil.example:{run.port}", "127.0.0.1", "localhost"):
                self.assertEqual(run.ask("/", host=host)[0], 403, host)
            listening = [line.split()[1] for table in ("/proc/net/tcp", "/proc/net/tcp6")
                         for line in Path(table).read_text().splitlines()[1:] if line.split()[3] == "0A"]
            of_port = [address for address in listening if int(address.split(":")[1], 16) == run.port]
            self.assertEqual(of_port, [f"0100007F:{run.port:04X}"])
            # Connections that say nothing do not stop the run from ending.
            silent = [socket.create_connection(("127.0.0.1", run.port)) for _ in range(10)]
            self.assertEqual(run.end(interrupt=True)[0], 130)
            for connection in silent:
                connection.close()

    def test_wrong_ports_are_one_line(self):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            for value, status, expected in [
                (port, 1, f"nbdtree: error: --live: port {port} of 127.0.0.1 cannot be had: Address already in use; allowed: a "
                 "port that is free, or --live alone, which finds one\n"),
                (65536, 2, "--live: is '65536'; allowed: a port from 0 to 65535, or nothing as the last word of the command"),
                ("-1", 2, "-1"), ("8000x", 2, "is '8000x'; allowed: a port"), ("1e3", 2, "is '1e3'; allowed: a port"),
                (RINGS, 2, "or nothing as the last word of the command"), ("99999999999999999999", 2, "allowed: a port"),
            ]:
                ran = subprocess.run([NBDTREE, "simulate", RINGS, "-o", "never.h5", "--live", str(value)], cwd=self.folder,
                                     capture_output=True, text=True)
                self.assertEqual(ran.returncode, status, ran.stderr)
                self.assertIn(expected, ran.stderr)
                self.assertEqual(ran.stderr.count("\n"), 1)
        ran = subprocess.run([NBDTREE, "simulate", RINGS, "-o", "never.h5", "--keep-live"], cwd=self.folder, capture_output=True, text=True)
        self.assertEqual(ran.returncode, 2)
        self.assertIn("--live", ran.stderr)
        self.assertEqual(list(self.folder.glob("never*")), [])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
