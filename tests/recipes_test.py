#!/usr/bin/env python3
"""Holds the recipes for other tools (apps/recipes) against the project: they parse, and what they name is there.

    recipes_test.py PROJECT
"""
import ast
import json
import re
import sys
import unittest
from pathlib import Path

PROJECT = Path(sys.argv.pop(1)).resolve()
RECIPES = PROJECT / "apps" / "recipes"


def text(name):
    return (RECIPES / name).read_text()


def cmake_texts():
    tops = [PROJECT / "CMakeLists.txt"]
    for folder in ("sim", "collision", "meshing", "training", "apps"):
        tops += (PROJECT / folder).rglob("CMakeLists.txt")
    return "\n".join(path.read_text() for path in tops)


class Recipes(unittest.TestCase):
    def test_set_options_that_the_project_has(self):
        known = set(re.findall(r"(?:option\(|set\(|find_file\()(NBD_\w+)", cmake_texts()))
        known |= {"NBD_JS_three", "NBD_JS_OrbitControls"}  # find_file(NBD_JS_${name})
        self.assertIn("NBD_CMAKE_OPTIONS", (PROJECT / "apps" / "bootstrap").read_text())
        known.add("NBD_CMAKE_OPTIONS")
        self.assertIn("NBD_LIBRARY_ONLY", known)
        count = 0
        for path in sorted(RECIPES.rglob("*")):
            for option in re.findall(r"(?:\b|(?<=-D))NBD_\w+", path.read_text() if path.is_file() else ""):
                count += 1
                self.assertIn(option, known, f"{path} sets {option}")
        self.assertGreater(count, 10)

    def test_have_the_version_of_the_project(self):
        version = re.search(r"project\(nbdtree VERSION ([\d.]+)", (PROJECT / "CMakeLists.txt").read_text())[1]
        self.assertEqual(json.loads(text("vcpkg/vcpkg.json"))["version"], version)
        self.assertIn(f'{{% set version = "{version}" %}}', text("conda/meta.yaml"))
        self.assertIn(f'version("{version}"', text("spack/package.py"))

    def test_spack_recipe_is_one_package(self):
        [package] = [node for node in ast.parse(text("spack/package.py")).body if isinstance(node, ast.ClassDef)]
        self.assertEqual(package.name, "Nbdtree")
        calls = [node for node in ast.walk(package) if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "depends_on"]
        self.assertGreater(len(calls), 15)

    def test_three_js_has_one_checksum(self):
        sums = set(re.findall(r"\b[0-9a-f]{64}\b", text("spack/package.py") + text("conda/meta.yaml")))
        self.assertEqual(len(sums), 1)

    def test_workflow_and_conda_recipe_are_yaml(self):
        try:
            import yaml
        except ImportError:
            self.skipTest("needs PyYAML (Debian: python3-yaml)")
        jobs = yaml.safe_load(text("ci.yml"))["jobs"]
        self.assertEqual(set(jobs), {"debian", "ubuntu", "arm", "packages"})
        for job in jobs.values():
            for step in job["steps"]:
                for script in re.findall(r"(?:\.ci|apps|tests)/\w+", step.get("run", "")):
                    self.assertTrue((PROJECT / script).is_file(), script)
        plain = re.sub(r"\{%.*?%\}", "", text("conda/meta.yaml"))
        recipe = yaml.safe_load(re.sub(r"\{\{.*?\}\}", "x", plain))
        self.assertEqual(set(recipe), {"package", "source", "build", "requirements", "test", "about"})

    def test_image_runs_what_its_program_loads(self):
        """Each library that bootstrap installs for the program has its runtime package in the image."""
        image = text("Dockerfile")
        self.assertIn("apps/bootstrap demo", image)
        bootstrap = (PROJECT / "apps" / "bootstrap").read_text()
        for development, runtime in (("libarpack2-dev", "libarpack2"), ("libsuitesparse-dev", "libcholmod3"),
                                     ("libcpp-httplib-dev", "libcpp-httplib0.11"), ("libfmt-dev", "libfmt9"),
                                     ("libgmsh-dev", "libgmsh4.8"), ("libhdf5-dev", "libhdf5-103-1"),
                                     ("libopenblas-dev", "libopenblas0-pthread"), ("libpng-dev", "libpng16-16"),
                                     ("libtbb-dev", "libtbb12")):
            self.assertRegex(bootstrap, rf"\b{re.escape(development)}\b")
            self.assertRegex(image, rf"\s{re.escape(runtime)}\s")


if __name__ == "__main__":
    unittest.main()
