#!/usr/bin/env python3
"""Opens pages of `nbdtree view` in a headless Chromium without network, as their readers do.

    browser_test.py NBDTREE ASSETS

Makes a recording of rings.json and pages of it, of a dataset's trajectory, of a tree's pose and of two surfaces that
collide. Exit status 77, for ctest: Chromium, selenium or h5py is not there.
"""
import io
import json
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from needs import need

need("h5py", "numpy", "PIL")
import h5py
import numpy as np
from browser import Browser
from PIL import Image

NBDTREE, ASSETS = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()


def nbdtree(*arguments, folder):
    return subprocess.run([NBDTREE, *map(str, arguments)], cwd=folder, check=True, capture_output=True, text=True).stdout


def pixels(browser):
    return np.asarray(Image.open(io.BytesIO(browser.screenshot())).convert("RGB")).astype(int)


def differing(a, b):
    """Number of pixels that differ clearly."""
    return int((np.abs(a - b).max(axis=2) > 24).sum())


class PageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="nbdtree_view_"))
        cls.make("simulate", ASSETS / "scenes" / "rings.json", "-o", "rings.h5", "--frames", 60, "--contact-forces", "-q")
        cls.make("view", "rings.h5", "-o", "rings.html", "-q")
        cls.browser = Browser()

    @classmethod
    def tearDownClass(cls):
        cls.browser.driver.quit()
        shutil.rmtree(cls.folder)

    @classmethod
    def make(cls, *arguments):
        return nbdtree(*arguments, folder=cls.folder)

    def open(self, page, width=1280, height=800):
        self.browser.resize(width, height)
        self.browser.open(self.folder / page)
        self.addCleanup(lambda: self.assertEqual(self.browser.complaints(), []))
        self.addCleanup(lambda: self.assertEqual(self.browser.requests(), []))

    def press(self, *keys):
        from selenium.webdriver.common.action_chains import ActionChains
        for key in keys:
            ActionChains(self.browser.driver).send_keys(key).perform()

    def test_shows_every_frame_of_the_recording(self):
        self.open("rings.html")
        with h5py.File(self.folder / "rings.h5") as file:
            for body in (0, 1):
                recorded = file[f"trajectories/{body:06}/positions"][:].astype(float)
                step = (recorded.max(axis=(0, 1)) - recorded.min(axis=(0, 1))) / 65535
                self.assertEqual(len(recorded), 61)
                for frame in (0, 1, 2, 37, 60):
                    self.browser.seek(frame)
                    shown = np.array(self.browser.run("return Array.from(nbdtree.nodes(arguments[0]))", body)).reshape(-1, 3)
                    # Half a step, and the rounding of single precision.
                    self.assertLess((np.abs(shown - recorded[frame]) / step).max(), 0.51)

    def test_pictures_of_frames_differ(self):
        self.open("rings.html")
        self.browser.seek(0)
        first = pixels(self.browser)
        self.assertEqual(differing(first, pixels(self.browser)), 0)
        self.browser.seek(55)
        self.assertGreater(differing(first, pixels(self.browser)), 20000)

    def test_plays_and_pauses(self):
        self.open("rings.html")
        self.browser.run("nbdtree.play()")
        moved = self.browser.driver.execute_async_script(
            "const done = arguments[0]; const look = () => nbdtree.frame() > 2 ? done(true) : requestAnimationFrame(look); look();")
        self.assertTrue(moved)
        self.browser.run("nbdtree.pause()")
        frame = self.browser.run("return nbdtree.frame()")
        self.browser.frame_is_drawn()
        self.assertEqual(self.browser.run("return nbdtree.frame()"), frame)

    def test_shows_reactions_as_arrows_on_demand(self):
        self.open("rings.html")
        with h5py.File(self.folder / "rings.h5") as file:
            rows = {name: array[:] for name, array in file["reactions"].items() if name != "names"}
        last = rows["time"][rows["frame"] == 60].max()
        wanted = [i for i, time in enumerate(rows["time"]) if time == last]
        self.assertTrue(wanted)
        self.browser.seek(60)
        shown = self.browser.run("return nbdtree.reactions()")
        self.assertEqual([arrow["body"] for arrow in shown], rows["body"][wanted].tolist())
        for name in ("point", "force"):
            np.testing.assert_allclose([arrow[name] for arrow in shown], rows[name][wanted], rtol=1e-6, atol=1e-6)
        legend = self.browser.driver.find_element("id", "arrow-legend")
        self.assertFalse(legend.is_displayed())
        plain = pixels(self.browser)
        self.press("r")
        self.assertRegex(legend.text, r"force: [\d.]+ [kmM]?N as long as [\d.]+ m?m")
        drawn = pixels(self.browser)
        self.assertGreater(differing(plain, drawn), 1000)
        red = (drawn[:, :, 0] > 150) & (drawn[:, :, 1] < 60) & (drawn[:, :, 2] < 60)
        self.assertGreater(red[:, :1000].sum(), 100)
        self.browser.run("nbdtree.choose('scale', 'frame')")
        self.browser.seek(0)
        self.assertIn("none in this frame", legend.text)
        self.press("r")
        self.assertFalse(legend.is_displayed())

    def test_scrubs_by_slider_and_keys(self):
        from selenium.webdriver.common.keys import Keys
        self.open("rings.html")
        slider = self.browser.driver.find_element("id", "frame")
        self.browser.run("arguments[0].value = 30; arguments[0].dispatchEvent(new Event('input'))", slider)
        frame = lambda: self.browser.run("return nbdtree.frame()")
        self.assertEqual(frame(), 30)
        self.press(Keys.ARROW_RIGHT, Keys.ARROW_RIGHT, Keys.ARROW_LEFT)
        self.assertEqual(frame(), 31)
        self.press(Keys.END)
        self.assertEqual(frame(), 60)
        self.press(Keys.HOME)
        self.assertEqual(frame(), 0)
        self.press(" ")
        self.assertTrue(self.browser.run("return nbdtree.isPlaying()"))
        self.press(" ")
        self.assertFalse(self.browser.run("return nbdtree.isPlaying()"))
        before = pixels(self.browser)
        self.press("l", "l")
        self.assertGreater(differing(before, pixels(self.browser)), 5000)
        self.press("?")
        self.assertTrue(self.browser.run("return document.getElementById('help').open"))
        self.press("?")
        self.assertFalse(self.browser.run("return document.getElementById('help').open"))

    def test_every_control_has_a_name_and_shows_its_focus(self):
        self.open("rings.html")
        unnamed = self.browser.run("""
            return [...document.querySelectorAll('button, input, select, canvas')].filter((element) =>
                !(element.getAttribute('aria-label') || element.textContent.trim() ||
                  (element.labels && element.labels[0] && element.labels[0].textContent.trim()))).map((e) => e.outerHTML)""")
        self.assertEqual(unnamed, [])
        from selenium.webdriver.common.keys import Keys
        self.press(Keys.TAB)
        self.press(Keys.TAB)
        style = self.browser.run("return getComputedStyle(document.activeElement).outlineStyle")
        self.assertEqual(style, "solid")

    def test_colours_by_scalars_with_a_scale(self):
        self.open("rings.html")
        self.browser.seek(55)
        plain = pixels(self.browser)
        names = self.browser.run("return nbdtree.facts.scalars.map(({name}) => name)")
        self.assertEqual(names, ["displacement", "von Mises stress", "contact force"])
        for name, unit in (("displacement", "m"), ("von Mises stress", "Pa"), ("contact force", "N")):
            self.browser.run("nbdtree.choose('colour', arguments[0])", name)
            self.assertGreater(differing(plain, pixels(self.browser)), 5000)
            legend = self.browser.driver.find_element("id", "legend").text
            self.assertIn(name[1:], legend)
            self.assertRegex(legend, rf", [kmMµ]?{unit}\n")
        with h5py.File(self.folder / "rings.h5") as file:
            forces = file["trajectories/000000/contact_forces"][55]
        largest = np.linalg.norm(forces, axis=1).max()
        self.assertGreater(largest, 0)
        shown = self.browser.run("return nbdtree.scalar(0, 'contact force').reduce((a, b) => Math.max(a, b), 0)")
        self.assertLess(abs(shown - largest), 0.02 * largest + 1e-3 * self.browser.run("return nbdtree.facts.scalars[2].max"))

    def test_displacement_is_the_distance_from_the_start(self):
        self.open("rings.html")
        self.browser.seek(40)
        with h5py.File(self.folder / "rings.h5") as file:
            recorded = file["trajectories/000001/positions"][:].astype(float)
        largest = np.linalg.norm(recorded[40] - recorded[0], axis=1).max()
        shown = self.browser.run("return nbdtree.scalar(1, 'displacement').reduce((a, b) => Math.max(a, b), 0)")
        self.assertAlmostEqual(shown / largest, 1, delta=0.02)

    def test_draws_bounds_of_a_depth(self):
        self.open("rings.html")
        without = pixels(self.browser)
        self.browser.run("nbdtree.choose('show-bounds', true)")
        coarse = pixels(self.browser)
        self.assertGreater(differing(without, coarse), 500)
        self.browser.run("nbdtree.choose('depth', 1)")
        self.assertGreater(differing(coarse, pixels(self.browser)), 500)
        # Those of `auto`, which hang on nodes, are the boxes of the tree that queries walk.
        self.assertEqual(self.browser.run("return nbdtree.facts.bodies.map(({bounds}) => bounds.kind)"), ["affine", "affine"])
        self.assertEqual(self.browser.run("return nbdtree.facts.bodies[0].bounds.firstNode[1]"), 1)

    def test_fits_a_narrow_screen(self):
        self.open("rings.html", 360, 640)
        for setting in ("false", "true"):
            self.browser.run(f"document.getElementById('panel').hidden = !{setting}")
            self.browser.run("nbdtree.choose('colour', 'displacement')")
            outside = self.browser.run("""
                return [...document.querySelectorAll('header, nav, aside, figure, footer, button, select')].filter((e) => {
                    const box = e.getBoundingClientRect();
                    return box.width && (box.left < -0.5 || box.right > innerWidth + 0.5 || box.bottom > innerHeight + 0.5 && !e.closest('#panel'));
                }).map((e) => e.id)""")
            self.assertEqual(outside, [])

    def test_marks_the_faces_that_collide_finds(self):
        lines = (ASSETS / "ring.obj").read_text().splitlines()
        moved = [f"v {float(x) + 0.07} {float(y) + 0.03} {float(z) + 0.04}" if kind == "v" else " ".join([kind, x, y, z])
                 for kind, x, y, z in (line.split() for line in lines if line.startswith(("v ", "f ")))]
        (self.folder / "moved.obj").write_text("\n".join(moved) + "\n")
        shutil.copy(ASSETS / "ring.obj", self.folder)
        self.make("collide", "ring.obj", "moved.obj", "--pairs", "pairs.csv", "--view", "collide.html", "-q")
        pairs = np.loadtxt(self.folder / "pairs.csv", delimiter=",", skiprows=1, dtype=int)
        self.assertGreater(len(pairs), 10)
        self.open("collide.html")
        for body in (0, 1):
            marked = self.browser.run("return nbdtree.marked(arguments[0], 'intersecting')", body)
            self.assertEqual(marked, sorted(set(pairs[:, body])))
        shown = pixels(self.browser)
        self.browser.run("nbdtree.choose('mark-intersecting', false)")
        self.assertGreater(differing(shown, pixels(self.browser)), 30)

    def test_shows_poses_of_a_dataset_and_misses_of_a_tree(self):
        self.make("mesh", ASSETS / "beam.obj", "-o", "beam.h5", "--elements", "linear", "-q")
        self.make("modes", "beam.h5", "-m", 8, "-q")
        self.make("dataset", "beam.h5", "-o", "poses.h5", "--trajectories", 20, "--frames", 30, "--seed", 1, "-q")
        self.make("train", "beam.h5", "poses.h5", "-o", "tree.h5", "--epochs", 50, "-q")
        self.make("view", "poses.h5:0", "--body", "beam.h5", "-o", "poses.html", "-q")
        self.open("poses.html")
        self.assertEqual(self.browser.run("return nbdtree.facts.times.length"), self.frames_of("poses.h5"))
        self.make("view", "tree.h5@poses.h5:0", "--bounds", "learned_affine", "-o", "tree.html", "-q")
        self.browser.open(self.folder / "tree.html")
        self.assertEqual(self.browser.run("return nbdtree.facts.bodies[0].bounds.kind"), "learned_affine")
        self.check_obstacles_of_a_recipe()
        self.make("view", "tree.h5@poses.h5:0:3", "-o", "pose.html", "-q")
        self.browser.open(self.folder / "pose.html")
        self.assertEqual(self.browser.run("return nbdtree.facts.numbers"), [3])
        # Far from the training and without margins, the paper's bounds miss some of the pairs that exact ones find.
        scene = {"bodies": [
            {"body": "beam.h5", "tree": "tree.h5", "bounds": "learned_affine", "margin": 0, "velocity": [0, 0, 1]},
            {"body": "beam.h5", "tree": "tree.h5", "bounds": "learned_affine", "margin": 0,
             "transform": {"translate": [0, 0.05, 0.25], "rotate": {"axis": [0, 0, 1], "degrees": 40}}, "velocity": [0, 0, -6], "material": {"young": 8000}}],
            "gravity": [0, 0, 0], "time": {"dt": 0.004, "frames": 40}}
        (self.folder / "beams.json").write_text(json.dumps(scene))
        self.make("simulate", "beams.json", "-o", "beams.h5", "-q")
        told = json.loads(self.make("view", "beams.h5", "-o", "beams.html", "--bounds", "nbd", "--margin", 0, "--json", "-q"))
        self.assertTrue(told["audited"])
        self.browser.open(self.folder / "beams.html")
        missed = self.browser.run("return nbdtree.facts.pairs.nearMissed.reduce((a, b) => a + b)")
        self.assertEqual(missed, told["near_pairs_missed"])
        marked = 0
        for frame in range(told["frames"]):
            self.browser.run("nbdtree.seek(arguments[0])", frame)
            marked += len(self.browser.run("return nbdtree.marked(0, 'missed')"))
        self.assertGreater(missed, 0)
        self.assertGreater(marked, 0)

    def check_obstacles_of_a_recipe(self):
        """The page of a trajectory draws the floor and the plates that its recipe names, and moves the plates."""
        weights = {kind: {"weight": int(kind in ("drop", "squash"))} for kind in
                   ("drop", "forces", "grips", "thrown", "free", "fold", "squash", "curl")}
        (self.folder / "pressed.json").write_text(json.dumps({"kinds": weights}))
        self.make("dataset", "beam.h5", "-o", "pressed.h5", "--trajectories", 2, "--frames", 10, "--seed", 1, "-q",
                  "--recipe", "pressed.json")
        with h5py.File(self.folder / "pressed.h5") as file:
            recipes = {int(name): json.loads(group["recipe"][0]) for name, group in file["trajectories"].items()}
            times = {int(name): group["times"][:] for name, group in file["trajectories"].items()}
        self.assertEqual({recipe["kind"] for recipe in recipes.values()}, {"drop", "squash"})
        for trajectory, recipe in recipes.items():
            self.make("view", f"pressed.h5:{trajectory}", "--body", "beam.h5", "-o", "pressed.html", "-q")
            self.browser.open(self.folder / "pressed.html")
            shown = self.browser.run("return nbdtree.facts.obstacles")
            plates = recipe.get("plates", [])
            self.assertEqual([obstacle["shape"] for obstacle in shown], ["plane"] * (("floor" in recipe) + len(plates)))
            if "floor" in recipe:
                self.assertEqual(shown[0]["point"], [0, 0, recipe["floor"]])
            for obstacle, plate in zip(shown[-len(plates):] if plates else [], plates):
                self.assertEqual((obstacle["point"], obstacle["normal"]), (plate["point"], plate["normal"]))
                way = plate["speed"] * np.minimum(times[trajectory], plate["stop"])
                np.testing.assert_allclose(obstacle["shifts"], np.outer(way, plate["normal"]))

    def frames_of(self, path):
        with h5py.File(self.folder / path) as file:
            return len(file["trajectories/000000/times"])

    def test_keeps_long_bodies_and_moving_obstacles_in_the_free_part_of_the_picture(self):
        for scale, obstacles in (([12, 0.5, 0.5], []), ([0.5, 12, 0.5], []),
                                 ([1, 1, 1], [{"sphere": {"centre": [0.9, 0, 0], "radius": 0.1}, "velocity": [3, 0, 1]}])):
            corners = [[a * s - s / 2 for a, s in zip((x, y, z), scale)] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
            faces = [(1, 2, 4), (1, 4, 3), (5, 7, 8), (5, 8, 6), (1, 5, 6), (1, 6, 2), (3, 4, 8), (3, 8, 7), (1, 3, 7), (1, 7, 5),
                     (2, 6, 8), (2, 8, 4)]
            (self.folder / "bar.obj").write_text("".join("v {} {} {}\n".format(*p) for p in corners) +
                                                 "".join("f {} {} {}\n".format(*f) for f in faces))
            (self.folder / "bar.json").write_text(json.dumps({"bodies": [{"surface": "bar.obj"}], "gravity": [0, 0, 0],
                                                              "obstacles": obstacles, "time": {"frames": 10, "dt": 0.02}}))
            self.make("simulate", "bar.json", "-o", "bar.h5", "-q")
            self.make("view", "bar.h5", "-o", "bar.html", "-q")
            self.open("bar.html")
            for frame in (0, 5, 10):
                self.browser.seek(frame)
                low, high, free = self.browser.run("""
                    const {view, facts} = nbdtree, camera = view.camera, seen = new THREE.Box2(), x = nbdtree.positions(0);
                    camera.updateMatrixWorld();
                    const see = (p) => { p.project(camera); seen.expandByPoint(new THREE.Vector2(p.x, p.y)); };
                    for (let i = 0; i < x.length; i += 3) see(new THREE.Vector3(x[i], x[i + 1], x[i + 2]));
                    for (const {centre, radius, shifts} of facts.obstacles)
                        for (const side of [-1, 1])
                            for (let c = 0; c < 3; ++c) {
                                const p = new THREE.Vector3(...centre).add(new THREE.Vector3(...shifts[nbdtree.frame()]));
                                see(p.setComponent(c, p.getComponent(c) + side * radius));
                            }
                    const at = (id) => document.getElementById(id).getBoundingClientRect(), stage = view.canvas.getBoundingClientRect();
                    const x_of = (px) => 2 * px / stage.width - 1, y_of = (py) => 1 - 2 * py / stage.height;
                    return [[seen.min.x, seen.min.y], [seen.max.x, seen.max.y],
                        [[-1, y_of(at('transport').top)], [x_of(at('panel').left), y_of(at('title').bottom)]]]""")
                for axis in (0, 1):
                    self.assertGreater(low[axis], free[0][axis], (scale, frame, axis))
                    self.assertLess(high[axis], free[1][axis], (scale, frame, axis))
                self.assertLess(free[1][0], 0.9)
                self.assertGreater(max((h - l) / (b - a) for l, h, a, b in zip(low, high, *free)), 0.3)

    def test_the_same_input_gives_the_same_bytes(self):
        self.make("view", "rings.h5", "-o", "again.html", "-q", "--threads", 1)
        self.assertEqual((self.folder / "again.html").read_bytes(), (self.folder / "rings.html").read_bytes())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
