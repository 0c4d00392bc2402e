"""The wheel: the package's folder in a zip file, with what pip wants to know of it."""

import base64
import hashlib
import re
import zipfile

LEVEL = 9

METADATA = """Metadata-Version: 2.1
Name: nbdtree
Version: {version}
Summary: Deformable solids with learned collision culling
License: GPL-3.0-or-later
Requires-Python: >=3.11
Requires-Dist: numpy>=1.23
Description-Content-Type: text/markdown

{text}"""
WHEEL = "Wheel-Version: 1.0\nGenerator: nbdtree {version}\nRoot-Is-Purelib: false\n"
ENTRY_POINTS = "[console_scripts]\nnbdtree = nbdtree.__main__:main\n"


def write_wheel(folder, package, version, glibc, text):
    """Writes the wheel of the folder `package` into folder. The versions of Python are those of its modules. Returns its path."""
    modules = sorted(re.search(r"cpython-(\d+)", module.name)[1] for module in package.glob("_nbdtree.cpython-*.so"))
    pythons = ".".join(f"cp{module}" for module in modules)
    platform = f"manylinux_{glibc[0]}_{glibc[1]}_x86_64"
    path = folder / f"nbdtree-{version}-{pythons}-{pythons}-{platform}.whl"
    tags = "".join(f"Tag: cp{module}-cp{module}-{platform}\n" for module in modules)
    information = f"nbdtree-{version}.dist-info"
    record = []
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=LEVEL) as archive:

        def add(name, data, mode=0o644):
            entry = zipfile.ZipInfo(name, (2020, 1, 1, 0, 0, 0))  # the same bits whenever it is made
            entry.external_attr = (0o100000 | mode) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, data, compresslevel=LEVEL)
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            record.append(f"{name},sha256={digest},{len(data)}\n")

        for file in sorted(package.rglob("*")):
            if file.is_file():
                add(f"nbdtree/{file.relative_to(package)}", file.read_bytes(), file.stat().st_mode & 0o777)
        add(f"{information}/METADATA", METADATA.format(version=version, text=text).encode())
        add(f"{information}/WHEEL", (WHEEL.format(version=version) + tags).encode())
        add(f"{information}/entry_points.txt", ENTRY_POINTS.encode())
        archive.writestr(f"{information}/RECORD", "".join(record) + f"{information}/RECORD,,\n")
    return path
