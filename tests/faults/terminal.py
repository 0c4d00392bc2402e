"""Runs a program on a terminal."""

import os
import pty
import subprocess
import time


def run_on_terminal(words, folder, environment, awaited, told):
    """Makes the file `told` as soon as `awaited` is shown. Returns the exit status, all that was shown, and the duration in
    seconds."""
    terminal, other = pty.openpty()
    start = time.monotonic()
    process = subprocess.Popen([str(w) for w in words], cwd=folder, stdin=other, stdout=other, stderr=other,
                               env={**os.environ, **environment, "TERM": "xterm"})
    os.close(other)
    shown = b""
    try:
        while part := os.read(terminal, 4096):
            shown += part
            if awaited in shown:
                told.touch()
    except OSError:
        pass  # the program has closed its end
    os.close(terminal)
    return process.wait(), shown.decode(), time.monotonic() - start
