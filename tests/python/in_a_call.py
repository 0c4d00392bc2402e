"""What tests do to a long call once it runs, which shows in its handler of Ctrl-C, however fast or slow the machine is."""

import ctypes
import os
import signal
import threading
import time


def _handler():
    """Address of the function of C that handles Ctrl-C."""
    action = ctypes.create_string_buffer(1024)
    ctypes.CDLL(None).sigaction(signal.SIGINT, None, action)
    return action.raw[:ctypes.sizeof(ctypes.c_void_p)]


_python = _handler()


def wait_for_a_call(done=None):
    """Waits until a long call of some thread handles Ctrl-C, or until the event `done`."""
    while _handler() == _python and not (done and done.is_set()):
        time.sleep(0.001)


class Pressing:
    """While alive, presses Ctrl-C so many seconds after a long call began; again and again if asked."""

    def __init__(self, after=0.0, again=False):
        self.after, self.again = after, again
        self.done = threading.Event()
        self.thread = threading.Thread(target=self._press)

    def _press(self):
        wait_for_a_call(self.done)
        self.done.wait(self.after)
        while not self.done.is_set():
            os.kill(os.getpid(), signal.SIGINT)
            self.done.wait(0.02 if self.again else None)

    def __enter__(self):
        self.thread.start()

    def __exit__(self, *_):
        self.done.set()
        self.thread.join()
