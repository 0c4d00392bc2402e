#!/usr/bin/env python3
"""Builds the site: the project's pages, references made from the program, the schemas and the code.

    python3 apps/docs/site/build_site.py --build build/release -o build/site

Needs mkdocs with its theme material, doxygen, the programs and the Python package in the build. The site opens from disk
and fetches nothing. Exit status 77, for ctest: mkdocs or doxygen is not there.
"""
import argparse
import importlib
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

sys.dont_write_bytecode = True
HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
from command_page import command_page, commands_of, common_options, list_page
from python_page import python_page
from schema_page import SchemaPage
from staging import Staging

THEME = Path("/usr/share/mkdocs/themes/material")
MARKER = ".made_by_build_site"  # in the folders that a build makes; mkdocs leaves hidden files in place
REFERENCES = {"assets/scenes/schema/scene.schema.json": "reference/scene.md", "assets/recipes/recipe.schema.json": "reference/recipe.md"}
SCENE = """Keys of a [scene file](../assets/scenes/README.md), made from `assets/scenes/schema/scene.schema.json`, which a test holds against the
parser. All keys without the word *required* may be left out. An unknown key is an error that names the nearest known one."""
RECIPE = """Keys of a [recipe](../apps/docs/datasets.md#recipes), made from `assets/recipes/recipe.schema.json`, which a test holds
against the parser. All keys may be left out. A *range* is `{"from": 1, "to": 2}`, from which a number is drawn for each use; the
limits hold for both ends."""

DOCS = "apps/docs/"
NAVIGATION = {
    "Start": {"nbdtree": "README.md", "First steps": DOCS + "first_steps.md", "How it works": DOCS + "how_it_works.md",
              "Questions": DOCS + "faq.md", "Glossary": DOCS + "glossary.md"},
    "Manual": {"Contents": DOCS + "README.md", "Meshing": DOCS + "meshing.md", "Simulating": DOCS + "simulating.md",
               "Scenes": "assets/scenes/README.md", "Machines": DOCS + "machines.md", "Viewing": DOCS + "viewer.md",
               "Datasets": DOCS + "datasets.md", "Training": DOCS + "training.md", "Which bounds?": DOCS + "bounds.md",
               "Learning": DOCS + "learning.md", "Python": DOCS + "python.md", "Embedding": DOCS + "embedding.md",
               "Files": DOCS + "files.md", "Packages": DOCS + "packages.md"},
    "Reference": {"Scenes": "reference/scene.md", "Recipes": "reference/recipe.md",
                  "Python": "reference/python.md", "C++": "reference/cpp.md",
                  "File formats": DOCS + "formats.md", "Flat trees": "collision/flat/README.md"},
    "Evidence": {"Contents": DOCS + "evidence.md", "Accuracy": DOCS + "accuracy.md", "Coverage": DOCS + "coverage.md",
                 "Speed of queries": DOCS + "speed.md", "Speed of steps": DOCS + "steps.md", "Elements": DOCS + "elements.md",
                 "Physics": DOCS + "physics.md",
                 "Contact": DOCS + "contact.md", "Tests": DOCS + "checks.md", "Attacks": "tests/RELIABILITY.md",
                 "What did not pay": DOCS + "what_did_not_pay.md", "Shells and rods": DOCS + "shells_and_rods.md",
                 "Beside others": DOCS + "others.md", "Sources": DOCS + "sources.md",
                 "Results": "apps/results/README.md"},
    "Project": {"Architecture": DOCS + "architecture.md", "Contributing": "CONTRIBUTING.md", "Change log": "CHANGELOG.md",
                "Collision": "collision/README.md", "Meshing": "meshing/README.md", "Simulator": "sim/README.md",
                "Training": "training/README.md", "Programs": "apps/README.md", "Tests": "tests/README.md"},
}


class Failure(Exception):
    """What is wrong, in one line."""


def write_references(staging, source, build):
    """Writes the pages that are made from something else. Returns the navigation of each program's commands."""
    for path, title, introduction in (("assets/scenes/schema/scene.schema.json", "Scene reference", SCENE),
                                      ("assets/recipes/recipe.schema.json", "Recipe reference", RECIPE)):
        schema = json.loads((source / path).read_text())
        staging.write(Path(REFERENCES[path]), SchemaPage(schema, title, introduction).text)
    sys.path.insert(0, str(build / "python"))
    module = importlib.import_module("nbdtree")
    stubs = (build / "python" / "nbdtree" / "__init__.pyi").read_text()
    staging.write(Path("reference/python.md"), python_page(module, stubs))
    program, benchmarks = build / "apps" / "nbdtree", build / "apps" / "nbdtree-bench"
    commands = list_page(program, "Commands") + common_options(program)
    return {"Commands": write_commands(staging, program, "commands", "Commands", commands, "README.md"),
            "Benchmarks": write_commands(staging, benchmarks, "benchmarks", "Benchmarks", list_page(benchmarks, "Benchmarks"),
                                         "../commands/README.md")}


def write_commands(staging, program, folder, title, first, options):
    """Writes a page for each command of a program, after the first one. Returns their navigation.

    first: text of the page that lists the commands. options: link from the others to that of the common options."""
    pages = Path("reference") / folder
    staging.write(pages / "README.md", first)
    navigation = {title: str(pages / "README.md")}
    for name in commands_of(program):
        navigation[name] = str(pages / f"{name}.md")
        staging.write(pages / f"{name}.md", command_page(program, name, options))
    return navigation


def configuration(pages, site, commands):
    navigation = [{section: [{title: path} for title, path in entries.items()]} for section, entries in NAVIGATION.items()]
    reference = next(entry["Reference"] for entry in navigation if "Reference" in entry)
    for place, (title, entries) in enumerate(commands.items()):
        reference.insert(place, {title: [{name: path} for name, path in entries.items()]})
    return {
        "site_name": "nbdtree", "site_url": "", "docs_dir": str(pages), "site_dir": str(site), "use_directory_urls": False,
        "theme": {"name": "material", "custom_dir": str(HERE / "theme"), "font": False, "favicon": "assets/images/favicon.png",
                  "palette": {"primary": "blue grey"}, "features": ["navigation.tabs", "navigation.top"]},
        "extra": {"generator": False},
        "extra_css": ["extra.css"], "nav": navigation, "plugins": ["search"],
        "markdown_extensions": ["attr_list", "tables", {"toc": {"permalink": True}}, "pymdownx.superfences",
                                {"pymdownx.highlight": {"guess_lang": False}}],
    }


def write_search(site):
    """Puts the search's index and worker into a script, since pages from disk may not fetch files."""
    index = json.loads((site / "search" / "search_index.json").read_text())
    sources = re.compile(r"\.(cpp|hpp|inl|pyi?|json|sh|js|css|cmake|txt|csv|geo)\.html")
    index["docs"] = [entry for entry in index["docs"] if not sources.search(entry["location"])]
    worker = next((site / "assets" / "javascripts" / "workers").glob("search.*.js")).read_text()
    script = (f"const __search = {{index: Promise.resolve({json.dumps(index)}),\n"
              f"worker: URL.createObjectURL(new Blob([{json.dumps(worker)}], {{type: 'text/javascript'}}))}};\n")
    (site / "search" / "offline.js").write_text(script)


def plain_page(page):
    """A README as doxygen's main page: links to files of the project mean nothing there."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", page.read_text())
    text = re.sub(r"^# .*", "# The collision library {#mainpage}", text, count=1, flags=re.M)
    return text + '\n\n<a href="../../index.html">All pages</a>\n'


def run(command, **arguments):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, **arguments)
    if done.returncode != 0:
        raise Failure(f"{command[0]}: {(done.stderr or done.stdout).strip()[-3000:]}")
    return done


def write_cpp_reference(source, work, target):
    (work / "include").mkdir()
    headers = work / "include" / "nbdtree"  # as they are installed
    headers.symlink_to(source / "collision")
    main_page = work / "cpp_main_page.md"
    main_page.write_text(plain_page(source / "collision" / "README.md"))
    settings = (HERE / "Doxyfile").read_text()
    for name, value in (("INPUT", f"{main_page} {headers}"), ("STRIP_FROM_PATH", headers),
                        ("STRIP_FROM_INC_PATH", headers.parent), ("OUTPUT_DIRECTORY", work), ("HTML_OUTPUT", target)):
        settings += f"{name} = {value}\n"
    target.mkdir(parents=True, exist_ok=True)
    run(["doxygen", "-"], input=settings)
    # Doxygen 1.9.4 links to lists of nested classes that it leaves out where all of them are private.
    link = '<a href="#nested-classes">Classes</a> &#124;'
    for page in target.glob("*.html"):
        text = page.read_text()
        if link in text and 'name="nested-classes"' not in text:
            page.write_text(text.replace(link, ""))


def clear_folders(*folders):
    """Makes these folders, without what an earlier build left there. Raises Failure, and removes nothing, if one of them
    holds something else."""
    for folder in folders:
        if folder.exists() and not (folder.is_dir() and (not any(folder.iterdir()) or (folder / MARKER).is_file())):
            raise Failure(f"{folder}: exists and was not made by this program; allowed: a new or empty folder, or an earlier site")
    for folder in folders:
        if folder.exists():
            shutil.rmtree(folder)
        folder.mkdir(parents=True)
        (folder / MARKER).touch()


def build_site(source, build, site):
    work = Path(f"{site}_pages")
    clear_folders(work, site)
    staging = Staging(source, work / "pages", REFERENCES)
    staging.run()
    commands = write_references(staging, source, build)
    staging.write(Path("reference/cpp.md"), CPP)
    shutil.copyfile(HERE / "theme" / "extra.css", work / "pages" / "extra.css")
    settings = work / "mkdocs.yml"  # JSON is YAML
    settings.write_text(json.dumps(configuration(work / "pages", site, commands)))
    run(["/usr/bin/mkdocs", "build", "--strict", "--quiet", "-f", settings])
    (site / "404.html").unlink()  # for servers
    write_search(site)
    write_cpp_reference(source, work, site / "reference" / "cpp")


CPP = """# C++ reference

<a href="cpp/index.html">The reference of the collision library</a> is made by doxygen from its headers: all rooms, classes and
functions. Headers are installed as `<nbdtree/ROOM/NAME.hpp>`. Where to start:

| header | what it answers |
| --- | --- |
| `<nbdtree/query/one_shot.hpp>` | which faces of two surfaces touch or are near, in one call |
| `<nbdtree/query/pair_query.hpp>` | the same for bodies that move, frame by frame |
| `<nbdtree/query/closest_query.hpp>` | how far apart two bodies are |
| `<nbdtree/query/self_query.hpp>` | which faces of one body touch each other |
| `<nbdtree/query/many_body_query.hpp>` | which of many bodies touch |
| `<nbdtree/tree/posed_tree.hpp>` | a body in a pose |
| `<nbdtree/flat/flat_tree.hpp>` | trained trees from a flat file |

The guide is [Embedding](../apps/docs/embedding.md); [examples](../apps/examples/README.md) are short programs.
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=Path, default=Path("build/release"), help="build folder with apps/nbdtree and python/")
    parser.add_argument("--source", type=Path, default=HERE.parents[2], help="the project's folder")
    parser.add_argument("-o", "--output", type=Path, default=Path("build/site"), help="folder to write")
    arguments = parser.parse_args()
    if not (os.access("/usr/bin/mkdocs", os.X_OK) and THEME.is_dir() and shutil.which("doxygen")):
        print("skipped: no mkdocs with mkdocs-material, or no doxygen")
        return 77
    try:
        build_site(arguments.source.resolve(), arguments.build.resolve(), arguments.output.resolve())
    except Failure as failure:
        print(f"error: {failure}", file=sys.stderr)
        return 1
    print(f"{arguments.output}/index.html")
    return 0


if __name__ == "__main__":
    sys.exit(main())
