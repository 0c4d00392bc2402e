"""Small file systems, which a script may mount without root in a namespace of its own."""

import os
import shutil
import subprocess
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path


def has_own_mounts():
    return "NBD_OWN_MOUNTS" in os.environ


def continue_with_own_mounts():
    """Starts the script again in a mount namespace of its own, where that is permitted. Its mounts end with it."""
    if has_own_mounts() or not shutil.which("unshare"):
        return
    for option in ["-rm", "-m"]:
        trial = subprocess.run(["unshare", option, "mount", "-t", "tmpfs", "trial", "/mnt"], capture_output=True)
        if trial.returncode == 0:
            os.environ["NBD_OWN_MOUNTS"] = "1"
            os.execvp("unshare", ["unshare", option, sys.executable, *sys.argv])


@contextmanager
def small_disk():
    """Yields the folder of a new file system, with much room, and a function that leaves it so many free bytes; None:
    makes it read-only."""
    folder = Path(tempfile.mkdtemp(prefix="faults-"))
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1g", "faults", folder], check=True)

    def remount(room):
        disk = os.statvfs(folder)
        used = (disk.f_blocks - disk.f_bfree) * disk.f_frsize
        setting = "ro" if room is None else f"size={used + room}"
        subprocess.run(["mount", "-o", f"remount,{setting}", folder], check=True)

    try:
        yield folder, remount
    finally:
        subprocess.run(["umount", folder], check=True)
        folder.rmdir()
