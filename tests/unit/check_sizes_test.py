"""scripts/check_sizes.py accepts short files and names, and names each that is too long."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "check_sizes.py"


def check(folder="tests", **files):
    with tempfile.TemporaryDirectory() as temporary:
        root = pathlib.Path(temporary)
        (root / folder).mkdir()
        for name, text in files.items():
            (root / folder / f"{name}.cpp").write_text(text)
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

    def test_names_a_long_function_without_a_reason(self):
        for head in ("int f() {\n", "namespace a {\n\nint f(int a,\n      int b) const {\n", "class A {\n public:\n  A() : b_(1) {\n"):
            indent = "  " if "class" in head else ""
            text = head + "  go();\n" * 60 + indent + "}\n"
            code, said = check("src", long=text)
            self.assertEqual(code, 1, head)
            self.assertIn("more than 60: split it", said)
        self.assertEqual(check("src", long="// Not split: one equation.\nint f() {\n" + "  go();\n" * 60 + "}\n"), (0, ""))
        self.assertEqual(check("src", short="int f() {\n" + "  go();\n" * 58 + "}\n"), (0, ""))

    def test_names_a_function_with_many_parameters_without_a_reason(self):
        many = "int f(int a, std::pair<int, int> b, int c, int d, int e, int f, int g) {\n}\n"
        code, said = check("src", many=many)
        self.assertEqual(code, 1)
        self.assertIn("src/many.cpp:1: f has 7 parameters", said)
        self.assertEqual(check("src", many="/// Seven parameters: all are known.\n" + many), (0, ""))
        self.assertEqual(check("src", few=many.replace("int a, ", "")), (0, ""))


if __name__ == "__main__":
    unittest.main()
