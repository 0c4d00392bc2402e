"""Packs what CMake has built as an archive and as a wheel that run on any Linux with glibc; apps/package calls it.

    pack.py FOLDER BUILD [INSTRUCTIONS=BUILD...]

FOLDER gets both. BUILD is a build for any x86-64 with the targets nbdtree_library and nbdtree_modules; further ones are for
an instruction set as glibc names it (x86-64-v3), among which its loader chooses.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

from libraries import add_libraries, newest_glibc, patch, run
from licences import write_licences
from wheel import write_wheel

PROJECT = pathlib.Path(__file__).resolve().parents[2]
README = """nbdtree {version} for any Linux on x86-64 with glibc {glibc} or newer.

    bin/nbdtree simulate assets/scenes/rings.json -o rings.h5 --frames 60
    bin/nbdtree view rings.h5 -o rings.html
    PYTHONPATH=$PWD/python python3 -c 'import nbdtree'      # {pythons}, with numpy 1.23 or newer

include/ and lib/ hold the library nbd::collision for find_package(nbdtree); it needs Eigen 3.4, which is not in here.
licences/README.txt says what else is in here, under which licences, and where the sources are.
"""


def link_program(package):
    """The program: no code, but the libraries that its loader is to choose from."""
    program = package / "bin" / "nbdtree"
    program.parent.mkdir()
    run("gcc", "-x", "c", "/dev/null", "-x", "none", "-o", program, "-L", package / "lib", "-Wl,--no-as-needed",
        "-l:libnbdtree-program.so", package / "lib/gcc/libstdc++.so.6", package / "lib/gcc/libgcc_s.so.1",
        "-Wl,--allow-shlib-undefined", "-Wl,-rpath,$ORIGIN/../lib:$ORIGIN/../lib/gcc", "-s")


def link_module(package, library):
    """The module of one version of Python: no code either. Python finds its function in the library that it loads."""
    version = re.search(r"cpython-\d+", library.name)[0]
    run("gcc", "-x", "c", "/dev/null", "-x", "none", "-shared", "-nostdlib", "-o",
        package / f"_nbdtree.{version}-x86_64-linux-gnu.so", "-L", package / "lib", "-Wl,--no-as-needed",
        f"-l:{library.name}", "-Wl,--allow-shlib-undefined", "-Wl,-rpath,$ORIGIN/lib", "-s")


def make_package(package, builds):
    """The folder that is the Python package, the wheel, and most of the archive. builds: {instruction set: build}."""
    package.mkdir(parents=True)
    for source in (PROJECT / "apps/python/nbdtree").iterdir():
        if source.suffix in (".py", ".pyi", ".typed"):
            shutil.copy(source, package)
    shutil.copy(PROJECT / "apps/python/nbdtree/py.typed", package)
    for instructions, build in builds.items():
        made = sorted((build / "packed").glob("libnbdtree-*.so"))
        if instructions is None:
            libraries = add_libraries(package / "lib", made)
        folder = package / "lib" / (f"glibc-hwcaps/{instructions}" if instructions else "")
        folder.mkdir(parents=True, exist_ok=True)
        for library in made:
            run("strip", "--strip-unneeded", "-o", folder / library.name, library)
            patch(folder / library.name, ["$ORIGIN/../.." if instructions else "$ORIGIN"])
    link_program(package)
    for library in (package / "lib").glob("libnbdtree-cpython-*.so"):
        link_module(package, library)
    (package / "share/nbdtree").mkdir(parents=True)
    shutil.copy(PROJECT / "apps/drawing/draw_charts.py", package / "share/nbdtree")
    return libraries


def write_stubs(package):
    """Types of what the module has, by a Python of this machine whose module is in the package."""
    environment = dict(os.environ, PYTHONPATH=str(package.parent))
    subprocess.run(["/usr/bin/python3", "-B", PROJECT / "apps/python/stubs/write_stubs.py", package], check=True, env=environment)


def make_archive(top, package, build, text):
    """Around the package: links to the program and the licences, the library with its headers, assets and examples."""
    (top / "bin").mkdir()
    (top / "bin/nbdtree").symlink_to("../python/nbdtree/bin/nbdtree")
    (top / "licences").symlink_to("python/nbdtree/licences")
    (top / "README.txt").write_text(text)
    run("cmake", "--install", build, "--component", "development", "--prefix", top, "--strip")
    files = run("git", "-C", PROJECT, "ls-files", "assets", "apps/python/examples").split("\n")
    for name in filter(None, files):
        (top / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(PROJECT / name, top / name)


def main():
    folder, first, *others = sys.argv[1:]
    builds = {None: pathlib.Path(first).resolve()}
    for other in others:
        instructions, _, build = other.partition("=")
        builds[instructions] = pathlib.Path(build).resolve()
    version = re.search(r"project\(nbdtree VERSION ([\d.]+)", (PROJECT / "CMakeLists.txt").read_text())[1]
    folder = pathlib.Path(folder).resolve()
    top = folder / f"nbdtree-{version}-linux-x86_64"
    shutil.rmtree(top, ignore_errors=True)
    package = top / "python" / "nbdtree"
    libraries = make_package(package, builds)
    write_stubs(package)
    write_licences(package / "licences", PROJECT / "LICENSE", libraries, PROJECT / "build/python_headers/pybind11/copyright")
    glibc = newest_glibc([path for path in package.rglob("*") if ".so" in path.name or path.parent.name == "bin"])
    pythons = sorted(int(module.name.split("-3")[1].split("-")[0]) for module in package.glob("_nbdtree.*.so"))
    text = README.format(version=version, glibc=".".join(map(str, glibc)), pythons="Python " + ", ".join(f"3.{p}" for p in pythons))
    wheel = write_wheel(folder, package, version, glibc, (PROJECT / "apps/docs/python.md").read_text())
    make_archive(top, package, builds[None], text)
    os.environ.setdefault("XZ_OPT", "-T0 --x86 --lzma2=preset=9")  # --x86: for code, which is then smaller
    run("tar", "--sort=name", "--owner=0", "--group=0", "--numeric-owner", "--mtime=2020-01-01", "-C", folder, "-cJf",
        f"{top}.tar.xz", top.name)
    shutil.rmtree(top)
    print(f"{top.name}.tar.xz and {wheel.name}: glibc {glibc[0]}.{glibc[1]} or newer, {len(libraries)} libraries")


if __name__ == "__main__":
    main()
