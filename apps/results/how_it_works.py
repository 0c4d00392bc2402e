#!/usr/bin/env python3
"""Takes the pictures of apps/docs/how_it_works.md: pages of `nbdtree view` in a headless Chromium, side by side.

    apps/results/how_it_works.py NBDTREE -o FOLDER

Needs Debian's chromium-driver, python3-selenium and python3-pil.
"""
import argparse
import io
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

PROJECT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(PROJECT / "tests" / "apps" / "view"))
from browser import Browser

WIDTH, HEIGHT, SEED = 400, 300, 1


class Pictures:
    def __init__(self, program, folder, browser):
        self.program, self.folder, self.browser = program.resolve(), folder, browser

    def nbdtree(self, *arguments):
        subprocess.run([self.program, *map(str, arguments), "-q"], check=True, cwd=self.folder)

    def take(self, *source, depth=None, colour=None):
        """A picture of what `nbdtree view` shows of a source, with the bounds of one depth."""
        self.nbdtree("view", *source, "-o", "page.html")
        self.browser.open(self.folder / "page.html")
        self.browser.run("for (const e of document.querySelectorAll('header, nav, aside, figure, footer')) e.style.display = 'none'")
        if depth is not None:
            self.browser.run("nbdtree.choose('show-bounds', true); nbdtree.choose('depth', arguments[0]);"
                             "nbdtree.choose('see-through', 50)", depth)
        if colour:
            self.browser.run("nbdtree.choose('colour', arguments[0])", colour)
        return Image.open(io.BytesIO(self.browser.screenshot())).convert("RGB")


def save(pictures, path):
    """Pictures side by side, in a palette to keep the file small."""
    strip = Image.new("RGB", (sum(p.width for p in pictures), pictures[0].height), "white")
    for i, picture in enumerate(pictures):
        strip.paste(picture, (i * picture.width, 0))
    strip.quantize(64, dither=Image.Dither.NONE).save(path, optimize=True)
    print(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for how_pipeline.png and how_depths.png")
    arguments = parser.parse_args()
    assets = PROJECT / "assets"
    with tempfile.TemporaryDirectory(prefix="nbdtree_how_") as name, Browser(WIDTH, HEIGHT) as browser:
        pictures = Pictures(arguments.program, Path(name), browser)
        pictures.nbdtree("mesh", assets / "gecko.obj", "-o", "gecko.h5", "--cage", 800)
        pictures.nbdtree("mesh", "gecko.h5", "-o", "tets.h5")  # the same tetrahedra, their boundary as surface
        pictures.nbdtree("dataset", "gecko.h5", "-o", "poses.h5", "--trajectories", 4, "--frames", 20, "--seed", SEED)
        pictures.nbdtree("remap", "poses.h5", "--from", "gecko.h5", "--to", "tets.h5", "-o", "tet_poses.h5")
        moved = "poses.h5:3:15"
        save([pictures.take(assets / "gecko.obj"),
              pictures.take("tet_poses.h5:3:0", "--body", "tets.h5"),
              pictures.take(moved, "--body", "gecko.h5", colour="von Mises stress"),
              pictures.take(moved, "--body", "gecko.h5", "--bounds", "boxes", depth=5)],
             arguments.output / "how_pipeline.png")
        save([pictures.take(moved, "--body", "gecko.h5", "--bounds", "exact", depth=depth) for depth in (0, 2, 4, 6)],
             arguments.output / "how_depths.png")


if __name__ == "__main__":
    main()
