#!/usr/bin/env python3
"""Builds the site and looks at it as readers do: from disk, without network, on wide and narrow screens.

    site_test.py BUILD

BUILD: build folder with apps/nbdtree and python/. Exit status 77, for ctest: mkdocs or doxygen is not there.
"""
import json
import re
import subprocess
import sys
import time
import unittest
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

PROJECT = Path(__file__).resolve().parents[2]
BUILD = Path(sys.argv.pop(1)).resolve()
SITE = BUILD / "site"
sys.dont_write_bytecode = True
sys.path.insert(0, str(PROJECT / "tests" / "apps" / "view"))
from needs import missing

PAGES = ["index.html", "apps/docs/first_steps.html", "apps/docs/how_it_works.html", "apps/docs/faq.html",
         "apps/docs/speed.html", "reference/commands/train.html", "reference/scene.html", "reference/recipe.html",
         "reference/python.html", "reference/cpp/index.html"]


class Page(HTMLParser):
    """Links, anchors and addresses of what a page loads."""

    def __init__(self, path):
        super().__init__()
        self.links, self.anchors, self.assets = [], {""}, []
        self.feed(path.read_text(errors="replace"))

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self.anchors.update(filter(None, (values.get("id"), values.get("name") if tag == "a" else None)))
        if tag == "a" and values.get("href"):
            self.links.append(values["href"])
        if tag in ("script", "img", "iframe", "source", "audio", "video") and values.get("src"):
            self.assets.append(values["src"])
        if tag == "link" and values.get("href") and values.get("rel") not in ("canonical", "prev", "next"):
            self.assets.append(values["href"])


class SiteTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.pages = {path: Page(path) for path in SITE.rglob("*.html")}

    def targets(self, path, link):
        """The file and the anchor that a link of a page names; None where it leads out of the site."""
        parts = urlsplit(link)
        if parts.scheme or parts.netloc:
            return None
        there = path if not parts.path else (path.parent / unquote(parts.path)).resolve()
        return there, unquote(parts.fragment)

    def test_every_link_leads_somewhere(self):
        dead, followed = [], 0
        for path, page in self.pages.items():
            for link in page.links + page.assets:
                target = self.targets(path, link)
                if not target or link.startswith("javascript:"):
                    continue
                there, anchor = target
                followed += 1
                if there.is_dir():
                    there = there / "index.html"
                if not there.is_file():
                    dead.append(f"{path.relative_to(SITE)}: {link}")
                elif anchor and there in self.pages and anchor not in self.pages[there].anchors:
                    dead.append(f"{path.relative_to(SITE)}: {link}: no such anchor")
        self.assertEqual(dead, [])
        self.assertGreater(followed, 5000)

    def test_nothing_is_loaded_from_the_network(self):
        outside = [f"{path.relative_to(SITE)}: {asset}" for path, page in self.pages.items() for asset in page.assets
                   if re.match(r"(https?:)?//", asset)]
        self.assertEqual(outside, [])
        styles = [f"{path.relative_to(SITE)}: {match}" for path in SITE.rglob("*.css")
                  for match in re.findall(r"(?:url\(|@import )[\"']?(https?:[^)\"']+)", path.read_text())]
        self.assertEqual(styles, [])

    def check_pages(self, program, folder, at_least):
        """Each command of a program has a page with all of its options. Returns the pages' texts by the commands' names."""
        def help_of(*command):
            return subprocess.run([BUILD / "apps" / program, *command, "--help"], check=True, capture_output=True, text=True).stdout

        names = re.findall(r"^  (\w+) ", help_of().split("Subcommands:")[1], re.M)
        self.assertGreaterEqual(len(names), at_least)
        pages = {name: (SITE / "reference" / folder / f"{name}.html").read_text() for name in names}
        for name, page in pages.items():
            options = re.findall(r"^(?:  |    )(-[-\w,]+)", help_of(name), re.M)  # those of a group are indented by four
            self.assertIn("-h,--help", options, name)
            cells = re.findall(r"<td><code>(-[^<]*)</code></td>", page)
            self.assertEqual(sorted(cells), sorted(option.replace(",", ", ") for option in options), name)
        return pages

    def test_every_command_has_a_page_with_options_and_examples(self):
        pages = self.check_pages("nbdtree", "commands", 16)
        for name, page in pages.items():
            text = re.sub(r"<[^>]*>", "", page.split("<article")[1])
            self.assertGreaterEqual(text.count(f"nbdtree {name} "), 3, name)  # the usage and two examples
        self.assertIn("SOURCE: the recording of a scene", pages["view"])
        self.assertIn("<code>--gltf</code>", pages["export"])  # of a group

    def test_every_benchmark_has_a_page_with_its_options(self):
        self.check_pages("nbdtree-bench", "benchmarks", 8)

    def test_search_index_has_the_pages(self):
        script = (SITE / "search" / "offline.js").read_text()
        index = json.loads(re.search(r"index: Promise\.resolve\((.*)\),\nworker", script, re.S).group(1))
        locations = {entry["location"].split("#")[0] for entry in index["docs"]}
        for page in PAGES[1:-1]:
            self.assertIn(page, locations)
        self.assertFalse([location for location in locations if ".hpp" in location])


class BrowserTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        if names := missing():
            raise unittest.SkipTest(f"missing: {names}")
        from browser import Browser
        cls.browser = Browser()
        cls.addClassCleanup(cls.browser.driver.quit)

    def open(self, page, width):
        self.browser.resize(width, 900)
        self.browser.driver.get_log("browser")
        self.browser.driver.get_log("performance")
        self.browser.driver.get((SITE / page).as_uri())

    def test_opens_without_network_and_complaints(self):
        for page in PAGES:
            with self.subTest(page):
                self.open(page, 1280)
                self.assertEqual(self.browser.complaints(), [])
                self.assertEqual([url for url in self.browser.requests() if not url.startswith("file://")], [])

    def test_pages_fit_a_narrow_screen(self):
        for page in PAGES[:-1]:  # doxygen's frames are made for wide ones
            with self.subTest(page):
                self.open(page, 360)
                self.assertLessEqual(self.browser.run("return document.documentElement.scrollWidth"), 360)

    def search(self, words):
        """Addresses that the search finds. Words that are typed before its index is ready are lost, and the same words are
        nothing new to it, so the box is emptied and the words are typed again; where it stays silent, in a page opened anew."""
        end = time.monotonic() + 1800  # it hangs
        while time.monotonic() < end:
            self.open("index.html", 1280)
            for _ in range(20):
                self.browser.run("""
                    const box = document.querySelector("input.md-search__input");
                    box.focus();
                    for (const text of ["", arguments[0]]) {
                        box.value = text;
                        for (const event of ["input", "keyup"]) box.dispatchEvent(new Event(event, {bubbles: true}));
                    }""", words)
                time.sleep(0.5)
                found = self.browser.run("""return [...document.querySelectorAll(".md-search-result__link")]
                                            .map((link) => link.getAttribute("href"));""")
                if found:
                    return found
        return []

    def test_search_finds_a_page_from_disk(self):
        found = self.search("miss rate")
        self.assertTrue(any("coverage.html" in link or "calibrate.html" in link for link in found), found)


if __name__ == "__main__":
    built = subprocess.run([sys.executable, PROJECT / "apps" / "docs" / "site" / "build_site.py", "--build", BUILD,
                            "--source", PROJECT, "-o", SITE])
    if built.returncode != 0:
        sys.exit(built.returncode)
    unittest.main()
