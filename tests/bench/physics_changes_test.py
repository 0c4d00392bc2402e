"""What the list of physics checks that do not hold tells of a run."""
import sys
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).parent))
from physics_changes import changes


def row(check, error, failed, held=False):
    return {"check": check, "error": error, "allowed": 0.01, "held": held, "failed": failed, "worst": "size 0.1 m"}


RUN = [row("fall", 0.02, 1), row("slide", 0, 0, True), row("roll", 0.3, 2)]


class ChangesTest(unittest.TestCase):
    def check(self, listed, *told, run=None):
        rows = {check: {"failed": str(failed), "error": str(error)} for check, failed, error in listed}
        self.assertEqual(changes(run or RUN, rows), list(told))

    def test_a_run_as_listed_tells_nothing(self):
        self.check([("fall", 1, 0.02), ("roll", 2, 0.3)])
        self.check([("fall", 1, 0.019), ("roll", 2, "inf")])

    def test_what_differs_is_told(self):
        self.check([("fall", 1, 0.017), ("roll", 2, 0.3)], "fall: error 0.02 at size 0.1 m; listed: 0.017")
        self.check([("fall", 1, 0.02)], "roll: error 0.3 at size 0.1 m; allowed: 0.01")
        self.check([("fall", 1, 0.02), ("roll", 2, 0.3), ("slide", 1, 1)], "slide holds now (error 0): strike it from the list")
        self.check([("fall", 1, 0.02), ("roll", 1, 0.3)], "roll: 2 cases fail; listed: 1")
        self.check([("fall", 1, 100)], "fall: error inf at size 0.1 m; listed: 100", run=[row("fall", None, 1)])


if __name__ == "__main__":
    unittest.main()
