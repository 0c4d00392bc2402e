"""The licences of all that the archive holds, as Debian has them."""

import pathlib
import re
import subprocess

# Whose code is in our own binaries: headers, static libraries, scripts of pages.
COMPILED_IN = ["libeigen3-dev", "libcgal-dev", "nlohmann-json3-dev", "libcli11-dev", "libfmt-dev", "libcpp-httplib-dev",
               "libjs-three", "libboost1.74-dev", "libboost1.83-dev"]
TEXTS = pathlib.Path("/usr/share/common-licenses")
HEAD = """What this archive of nbdtree holds, and where the sources are.

The code of nbdtree is under the MIT licence (nbdtree.txt). Its binaries link gmsh, CHOLMOD and CGAL, so that they are passed
on under the GPL, version 3 or later. Beside this file lies the licence of each package of Debian whose libraries, headers or
scripts are in the archive; the texts that these cite lie in texts/. The libraries are Debian's binaries, but for the names and
paths by which they find each other (patchelf). Their sources, with all that Debian changed: apt-get source PACKAGE=VERSION in
a Debian, or https://snapshot.debian.org. Those of nbdtree are the project's, at the version in the archive's name.

"""


def packages_of(paths):
    """The packages of Debian that files belong to: {path: package}."""
    # Where /lib is a link to /usr/lib, dpkg may know a file by either name.
    names = {name: path for path in paths for name in (str(path), re.sub("^/usr", "", str(path)))}
    found = subprocess.run(["dpkg-query", "-S", *names], capture_output=True, text=True).stdout
    packages = {}
    for line in found.splitlines():
        owners, _, name = line.partition(": ")
        packages[names[name]] = owners.split(",")[0]
    for path in paths:
        if path not in packages:
            raise SystemExit(f"error: {path}: belongs to no package of Debian, so that its licence is not known")
    return packages


def version_of(package):
    found = subprocess.run(["dpkg-query", "-W", "-f", "${db:Status-Status} ${Version}", package], capture_output=True, text=True)
    status, _, version = found.stdout.partition(" ")
    return version if status == "installed" else None


def write_licences(folder, ours, libraries, pybind11):
    """ours: our own licence. libraries: {name: path on this machine}. pybind11: the licence of its headers."""
    (folder / "texts").mkdir(parents=True)
    (folder / "nbdtree.txt").write_text(ours.read_text())
    (folder / "pybind11.txt").write_text(pybind11.read_text())
    held = {}
    packages = packages_of(libraries.values())
    for name, path in libraries.items():
        held.setdefault(packages[path], []).append(name)
    for package in COMPILED_IN:
        if version_of(package):
            held.setdefault(package, []).append("compiled in")
    lines = []
    for package, names in sorted(held.items()):
        text = pathlib.Path("/usr/share/doc", package.split(":")[0], "copyright").read_text(errors="replace")
        (folder / f"{package.split(':')[0]}.txt").write_text(text)
        lines.append(f"{package.split(':')[0]} {version_of(package)}: {', '.join(sorted(names))}\n")
    for text in sorted(TEXTS.iterdir()):
        if text.is_file() and not text.is_symlink():
            (folder / "texts" / text.name).write_text(text.read_text(errors="replace"))
    (folder / "README.txt").write_text(HEAD + "".join(lines))
