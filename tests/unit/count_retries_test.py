"""scripts/count_retries.py counts each retry and skip once, and fails above its budget."""
import importlib.util
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "count_retries.py"
SPEC = importlib.util.spec_from_file_location("count_retries", SCRIPT)
BUDGET = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(BUDGET)

CTEST = """<?xml version="1.0"?><testsuite>
<testcase name="fault_test" status="run"><system-out>[ RUN      ] Fault.A
[  SKIPPED ] Fault.A (12 ms)
[  SKIPPED ] 1 test, listed below:
[  SKIPPED ] Fault.A
</system-out></testcase>
<testcase name="page_test" status="run"><system-out>[  SKIPPED ] Page.B (0 ms)
[  SKIPPED ] Links/Page.C/rtu, where GetParam() = over RTU (0 ms)
</system-out></testcase>
<testcase name="environment" status="notrun"><skipped message="SKIP_RETURN_CODE=77"/></testcase>
</testsuite>"""


def count(log, ctest=None):
    with tempfile.TemporaryDirectory() as folder:
        if log is not None:
            pathlib.Path(folder, "retries_and_skips.log").write_text(log)
        if ctest is not None:
            pathlib.Path(folder, "ctest.xml").write_text(ctest)
        done = subprocess.run([sys.executable, SCRIPT, folder], capture_output=True, text=True)
        return done.returncode, done.stdout, done.stderr


def lines(kind, number):
    return f"{kind}\tFault.A\tthe run ended with overrun\t1.0\t1.1\n" * number


class CountRetries(unittest.TestCase):
    def test_nothing_is_nothing(self):
        code, out, _ = count(None)
        self.assertEqual(code, 0)
        self.assertEqual(out.count("\n"), 3)
        self.assertIn("0 retries", out)

    def test_counts_each_kind(self):
        code, out, _ = count(lines("retry", 2) + lines("skip", 1) + "absent\tkernel_tests\tpackages\n", CTEST)
        self.assertEqual(code, 0)
        self.assertIn("2 retries", out)
        self.assertIn("1 tests skipped because every attempt met a stall", out)
        self.assertIn("4 tests skipped because a requirement is missing", out)
        for entry in ("page_test: Page.B", "page_test: Links/Page.C/rtu", "environment", "kernel_tests: packages"):
            self.assertIn(entry, out)
        self.assertNotIn("fault_test: Fault.A", out)

    def test_fails_above_each_budget(self):
        for kind, most in (("retry", BUDGET.MAX_RETRIES), ("skip", BUDGET.MAX_STALLED_SKIPS), ("absent", BUDGET.MAX_OTHER_SKIPS)):
            self.assertEqual(count(lines(kind, most))[0], 0, kind)
            code, _, err = count(lines(kind, most + 1))
            self.assertEqual(code, 1, kind)
            self.assertIn("retries or skips exceed the budget", err)


if __name__ == "__main__":
    unittest.main()
