"""scripts/check_sizes.py accepts short files and names, and names each that is too long."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "check_sizes.py"


def check(**files):
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / "tests").mkdir()
        for name, text in files.items():
            (root / "tests" / f"{name}.cpp").write_text(text)
        done = subprocess.run([sys.executable, SCRIPT, "--root", root], capture_output=True, text=True)
        return done.returncode, done.stderr


class CheckSizes(unittest.TestCase):
    def test_accepts_a_file_of_600_lines_and_a_name_of_60_characters(self):
        self.assertEqual(check(longest="int i;\n" * 600, named=f"TEST(Suite, {'A' * 54}) {{}}\n"), (0, ""))

    def test_names_a_longer_file(self):
        code, said = check(long="int i;\n" * 601)
        self.assertEqual(code, 1)
        self.assertIn("tests/long.cpp: has 601 lines", said)

    def test_names_a_longer_test_also_over_two_lines(self):
        for kind in ("TEST", "TEST_F", "TEST_P"):
            code, said = check(named=f"\n{kind}(Suite,\n     {'A' * 55}) {{}}\n")
            self.assertEqual(code, 1, kind)
            self.assertIn("tests/named.cpp:2: Suite.AAA", said)


if __name__ == "__main__":
    unittest.main()
