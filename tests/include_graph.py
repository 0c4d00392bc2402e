"""Checks every #include of the project against the links of the rooms. A room is the library of one folder.

    include_graph.py SOURCE ROOMS [--plant FILE INCLUDE]

ROOMS is the file rooms.txt that CMake writes into the build folder, with one line `name|folder|public|private|files` per
room, program, test program and library of test helpers. A file may include headers of its own room, of the rooms that its room links, and of
their PUBLIC links. A header that other rooms include may itself include only PUBLIC links. Unneeded links, PUBLIC links
that could be PRIVATE, and cycles are errors as well. --plant checks FILE as if it
included INCLUDE, to test this script.
"""

import argparse
import re
from pathlib import Path

SOURCES = {".cpp", ".hpp", ".inl"}
TOP_FOLDERS = ["collision", "meshing", "sim", "training", "apps"]
PACKAGES = {
    "CLI": "CLI11::CLI11",
    "Eigen": "Eigen3::Eigen",
    "assimp": "assimp::assimp",
    "fmt": "fmt::fmt",
    "httplib": "PkgConfig::HTTPLIB",
    "nlohmann": "nlohmann_json::nlohmann_json",
    "tbb": "TBB::tbb",
}


class Target:
    def __init__(self, line):
        self.name, self.folder, public, private, files = line.split("|")
        self.public, self.private, self.files = public.split(), private.split(), files.split()


def read_targets(path):
    return [Target(line) for line in path.read_text().splitlines() if line]


def includes_of(text):
    quoted = re.findall(r'^\s*#include "([^"]+)"', text, re.MULTILINE)
    packages = re.findall(r"^\s*#include <(\w+)[/.]?[^>]*>", text, re.MULTILINE)
    return quoted, [PACKAGES[name] for name in packages if name in PACKAGES]


class Graph:
    def __init__(self, source, targets, planted):
        self.errors = []
        self.targets = {"nbd::" + t.name: t for t in targets}
        self.bundles = {"nbd::collision": ["nbd::query", "nbd::flat"]}
        self.room_of_folder = {t.folder: "nbd::" + t.name for t in targets if not t.files}
        self.includes, self.packages = {}, {}
        for path in sorted(p for p in source.rglob("*") if p.suffix in SOURCES):
            name = path.relative_to(source).as_posix()
            top = name.split("/")[0]
            if top in TOP_FOLDERS + ["tests"] and not name.startswith("tests/embedding/program/"):
                self.includes[name], self.packages[name] = includes_of(path.read_text())
        if planted:
            if planted[0] not in self.includes:
                self.error(planted[0], "is not a source file, so --plant cannot use it")
            self.includes.setdefault(planted[0], []).append(planted[1])

    def error(self, where, what):
        self.errors.append(f"{where}: {what}")

    def room(self, file):
        return self.room_of_folder.get(file.rsplit("/", 1)[0])

    def shown_by(self, link):
        """The link and its PUBLIC links, transitively."""
        seen, todo = set(), [link]
        while todo:
            name = todo.pop()
            if name not in seen:
                seen.add(name)
                todo += self.bundles.get(name, [])
                if name in self.targets:
                    todo += self.targets[name].public
        return seen

    def shown_by_all(self, links):
        return set().union(*(self.shown_by(link) for link in links)) if links else set()

    def public_headers(self):
        """Headers that another room includes, and headers that these include, transitively."""
        found = {i for f, names in self.includes.items() for i in names if self.room(f) != self.room(i)}
        todo = list(found)
        while todo:
            for name in self.includes.get(todo.pop(), []):
                if name not in found:
                    found.add(name)
                    todo.append(name)
        return found

    def needs(self, files):
        """Includes from outside the room of the files: {room or package: a file that includes it}."""
        result = {}
        for file in files:
            for name in self.includes[file]:
                if name not in self.includes:
                    self.error(file, f'includes "{name}", which does not exist')
                elif not name.startswith("tests/") and self.room(name) != self.room(file):
                    result.setdefault(self.room(name), file)
            for package in self.packages[file]:
                result.setdefault(package, file)
        return result

    def check_room(self, target, public_headers):
        files = [f for f in self.includes if f.rsplit("/", 1)[0] == target.folder]
        shown = self.shown_by_all(target.public)
        linked = shown | self.shown_by_all(target.private)
        needs = self.needs(files)
        needs_shown = self.needs([f for f in files if f in public_headers])
        for room, file in needs.items():
            if room not in linked:
                self.error(file, f"includes {room}, which nbd::{target.name} does not link")
        for room, file in needs_shown.items():
            if room in linked and room not in shown:
                self.error(file, f"shows {room} to other rooms, but nbd::{target.name} links it PRIVATE")
        self.check_links(target, target.public, needs_shown, "PRIVATE would do")
        self.check_links(target, target.private, needs, "no file needs it")

    def check_links(self, target, links, needs, why):
        for link in links:
            known = link.startswith("nbd::") or link in PACKAGES.values()
            if known and not self.shown_by(link) & set(needs):
                self.error(target.folder, f"nbd::{target.name} links {link}, but {why}")

    def check_test(self, target):
        """A test program or library of test helpers may include only its links and their PUBLIC links, also indirectly through tests/."""
        linked = self.shown_by_all(target.public + target.private)
        todo = [f"{target.folder}/{file}" for file in target.files]
        seen = set(todo)
        while todo:
            file = todo.pop()
            for name in self.includes.get(file, []):
                if name.startswith("tests/"):
                    if name not in seen:
                        seen.add(name)
                        todo.append(name)
                elif self.room(name) not in linked:
                    self.error(file, f'includes "{name}", which {target.name} does not link')

    def check_cycles(self):
        done, path = set(), []

        def visit(name):
            if name in path:
                self.error(name, "links itself: " + " -> ".join(path[path.index(name):] + [name]))
            elif name in self.targets and name not in done:
                path.append(name)
                for link in self.targets[name].public + self.targets[name].private:
                    visit(link)
                path.pop()
                done.add(name)

        for name in self.targets:
            visit(name)

    def check(self):
        public_headers = self.public_headers()
        for file in self.includes:
            if not file.startswith("tests/") and self.room(file) is None:
                self.error(file, "is in a folder that is not a room")
        for target in self.targets.values():
            if target.files:
                self.check_test(target)
            else:
                self.check_room(target, public_headers)
        self.check_cycles()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", type=Path)
    parser.add_argument("rooms", type=Path)
    parser.add_argument("--plant", nargs=2, metavar=("FILE", "INCLUDE"))
    arguments = parser.parse_args()
    graph = Graph(arguments.source, read_targets(arguments.rooms), arguments.plant)
    graph.check()
    for error in sorted(set(graph.errors)):
        print(error)
    rooms = sum(1 for t in graph.targets.values() if not t.files)
    print(f"{len(graph.includes)} files in {rooms} rooms, {len(set(graph.errors))} errors")
    return 1 if graph.errors else 0


if __name__ == "__main__":
    raise SystemExit(main())
