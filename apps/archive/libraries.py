"""The shared libraries that lie in the archive: found, renamed and made to find each other."""

import pathlib
import re
import shutil
import subprocess

# What every Linux with glibc has; the loader takes no other version than its own.
OF_GLIBC = re.compile(r"(ld-linux.*|libc|libm|libdl|librt|libpthread|libresolv|libutil|libanl|libmvec)\.so\.\d+$")
# A process must have one of each, and Python brings them: only the program finds these, in a folder apart.
OF_COMPILER = re.compile(r"(libstdc\+\+|libgcc_s)\.so\.\d+$")
# TBB asks for it by this name when it begins, and does without where there is none.
BY_NAME = "libtbbmalloc.so.2"
# OpenBLAS has all that these have.
OPENBLAS = pathlib.Path("/usr/lib/x86_64-linux-gnu/libopenblas.so.0")
BY_OPENBLAS = ("libblas.so.3", "liblapack.so.3")


def run(*command):
    return subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True).stdout


def needed(path):
    """Names of the libraries that a file asks the loader for."""
    return run("patchelf", "--print-needed", path).split()


def resolve(paths):
    """All libraries that the files load, directly or not: {name: path on this machine}."""
    found = {OPENBLAS.name: OPENBLAS.resolve()}
    for path in paths:
        for name, place in re.findall(r"^\s*(\S+) => (.*?)(?: \(0x[0-9a-f]+\))?$", run("ldd", path), re.MULTILINE):
            if place == "not found":
                raise SystemExit(f"error: {path}: needs {name}, which is not on this machine")
            if name not in BY_OPENBLAS:
                found[name] = pathlib.Path(place).resolve()
    return found


def own_name(name):
    """The name in the archive: not the system's, so that a process may hold both (say, the HDF5 of h5py)."""
    if OF_GLIBC.match(name) or OF_COMPILER.match(name) or name == BY_NAME or "-nbdtree.so" in name:
        return name
    return (OPENBLAS.name if name in BY_OPENBLAS else name).replace(".so", "-nbdtree.so", 1)


def patch(path, search):
    """Makes a file load the archive's libraries, which it searches in these folders."""
    before = needed(path)
    wanted = [own_name(name) for name in before]
    renames = [word for old, new in zip(before, wanted) if old != new for word in ("--replace-needed", old, new)]
    if renames:  # by a call of its own: in one with the folders, patchelf 0.14 takes a name for a folder
        run("patchelf", *renames, path)
    run("patchelf", "--set-rpath", ":".join(search), path)
    if needed(path) != wanted or run("patchelf", "--print-rpath", path).strip() != ":".join(search):
        raise SystemExit(f"error: {path}: patchelf did not change it as it should")


def add_libraries(folder, made):
    """Copies what the files `made` load into folder, the compiler's libraries into folder/gcc. Returns {name: path}."""
    libraries = {name: path for name, path in resolve(made).items() if not OF_GLIBC.match(name)}
    (folder / "gcc").mkdir(parents=True)
    for name, path in libraries.items():
        if OF_COMPILER.match(name):
            shutil.copy(path, folder / "gcc" / name)
            continue
        copy = folder / own_name(name)
        shutil.copy(path, copy)
        copy.chmod(0o755)
        run("patchelf", "--set-soname", copy.name, copy)
        patch(copy, ["$ORIGIN"])
    return libraries


def newest_glibc(paths):
    """The newest version of glibc that any of the files asks for, as (2, 36)."""
    versions = {(2, 0)}
    for path in paths:
        for major, minor in re.findall(r"\bGLIBC_(\d+)\.(\d+)", run("objdump", "-T", path)):
            versions.add((int(major), int(minor)))
    return max(versions)
