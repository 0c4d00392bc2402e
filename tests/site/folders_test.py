#!/usr/bin/env python3
"""Which folders the site's program empties: its own alone."""
import sys
import tempfile
import unittest
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True
sys.path.insert(0, str(PROJECT / "apps" / "docs" / "site"))
from build_site import Failure, build_site, clear_folders


class FoldersTest(unittest.TestCase):
    def setUp(self):
        made = tempfile.TemporaryDirectory()
        self.addCleanup(made.cleanup)
        self.folder = Path(made.name)
        self.site, self.pages = self.folder / "site", self.folder / "site_pages"

    def test_a_folder_of_somebody_else_is_refused_and_left_alone(self):
        for folder in (self.site, self.pages):
            with self.subTest(folder.name):
                kept = folder / "deep" / "thesis.tex"
                kept.parent.mkdir(parents=True)
                kept.write_text("years of work")
                with self.assertRaises(Failure) as failure:
                    build_site(PROJECT, self.folder / "no_build", self.site)
                self.assertEqual(str(failure.exception), f"{folder}: exists and was not made by this program; "
                                                         "allowed: a new or empty folder, or an earlier site")
                self.assertEqual([path for path in self.folder.rglob("*") if path.is_file()], [kept])
                kept.unlink()
                kept.parent.rmdir()

    def test_a_folder_with_the_source_is_refused(self):
        source = self.folder / "project"
        (source / "apps").mkdir(parents=True)
        for site in (self.folder, source):
            with self.assertRaisesRegex(Failure, "was not made by this program"):
                build_site(source, self.folder / "no_build", site)
        self.assertTrue((source / "apps").is_dir())

    def test_a_file_is_refused(self):
        self.site.write_text("a page")
        with self.assertRaisesRegex(Failure, "was not made by this program"):
            clear_folders(self.pages, self.site)
        self.assertEqual(self.site.read_text(), "a page")
        self.assertFalse(self.pages.exists())

    def test_folders_that_are_new_or_empty_or_of_an_earlier_build_are_taken(self):
        self.site.mkdir()
        clear_folders(self.pages, self.site)
        (self.site / "old.html").write_text("an earlier page")
        clear_folders(self.pages, self.site)
        for folder in (self.site, self.pages):
            self.assertEqual([path.name for path in folder.iterdir()], [".made_by_build_site"])


if __name__ == "__main__":
    unittest.main()
