"""What tests in a browser need."""
import importlib.util
import shutil
import sys


def missing(*packages):
    """Chromium with its driver and packages of Python that are not there, in words; "" if all are."""
    names = [name for name in ("selenium", *packages) if importlib.util.find_spec(name) is None]
    names += [name for name in ("chromium", "chromedriver") if not shutil.which(name)]
    return ", ".join(names)


def need(*packages):
    """Ends the program with status 77, which ctest takes for a skipped test, if Chromium or a package is not there."""
    if names := missing(*packages):
        print(f"skipped: missing: {names}")
        sys.exit(77)
