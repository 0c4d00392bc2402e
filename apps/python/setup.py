"""Makes the wheel: CMake builds the module for any x86-64, setuptools packs it."""

import os
import pathlib
import re
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build" / "portable"  # kept, so that a second wheel takes seconds


class BuildByCMake(build_ext):
    def build_extension(self, extension):
        subprocess.run(["cmake", "--preset", "portable", "-Wno-dev", f"-DPython3_EXECUTABLE={sys.executable}"],
                       cwd=ROOT, check=True)
        subprocess.run(["cmake", "--build", BUILD, "--target", "nbdtree_python", "nbdtree_python_files"],
                       check=True)
        [module] = (BUILD / "python" / "nbdtree").glob("_nbdtree*.so")
        target = pathlib.Path(self.get_ext_fullpath(extension.name))
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(module.read_bytes())
        (target.parent / "__init__.pyi").write_bytes((BUILD / "python" / "nbdtree" / "__init__.pyi").read_bytes())
        subprocess.run(["strip", "--strip-unneeded", target], check=True)


def version():
    return re.search(r"project\(nbdtree VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]


(BUILD / "setuptools").mkdir(parents=True, exist_ok=True)
setup(
    options={"build": {"build_base": str(BUILD / "setuptools")}, "egg_info": {"egg_base": str(BUILD / "setuptools")}},
    name="nbdtree",
    version=version(),
    description="Deformable solids with learned collision culling",
    long_description=(ROOT / "apps" / "docs" / "python.md").read_text(),
    long_description_content_type="text/markdown",
    license="GPL-3.0-or-later",  # of the binary, which links gmsh and CGAL; our own code is under the MIT licence
    python_requires=">=3.11",
    install_requires=["numpy"],
    packages=["nbdtree"],
    package_data={"nbdtree": ["*.pyi", "py.typed"]},
    ext_modules=[Extension("nbdtree._nbdtree", [])],
    cmdclass={"build_ext": BuildByCMake},
)
