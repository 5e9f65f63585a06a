"""The examples in docs/architecture.md apply to the present tree, touch two files each, and compile.

  architecture_diffs_test.py COMPILER
"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
COMPILER = sys.argv.pop(1) if len(sys.argv) > 1 else "c++"
DIFF = re.compile(r"^```diff\n(.*?)^```", re.MULTILINE | re.DOTALL)
CREATED = re.compile(r"^new file mode .*\n--- /dev/null\n\+\+\+ b/(.*)$", re.MULTILINE)

# What uses a new header, by its folder; a new .cpp is compiled itself.
USERS = {
    "include/upright/model/effects": '#include "upright/model/dynamics.hpp"\n'
                                     '#include "../src/model/registry.cpp"\ntemplate class upright::Dynamics<double>;\n',
    "src/experiment/pieces": '#include "../src/experiment/piece.cpp"\n',
}


def diffs():
    return DIFF.findall((ROOT / "docs" / "architecture.md").read_text())


class ArchitectureDiffs(unittest.TestCase):
    def test_shows_an_effect_a_piece_a_backend_and_a_command(self):
        folders = sorted(str(pathlib.PurePosixPath(CREATED.search(diff).group(1)).parent) for diff in diffs())
        self.assertEqual([folder.split("/")[0] for folder in folders], ["hal", "include", "src", "src"])

    def test_each_applies_touches_two_files_and_compiles(self):
        with tempfile.TemporaryDirectory() as folder:
            tree = pathlib.Path(folder)
            for part in ("include", "src", "hal"):
                shutil.copytree(ROOT / part, tree / part)
            (tree / "user").mkdir()
            for diff in diffs():
                new = pathlib.PurePosixPath(CREATED.search(diff).group(1))
                with self.subTest(example=str(new)):
                    self.assertEqual(diff.count("diff --git "), 2)
                    done = subprocess.run(["git", "apply", "-"], cwd=tree, input=diff, text=True, capture_output=True,
                                          env={"GIT_CEILING_DIRECTORIES": str(tree.parent), "PATH": "/usr/bin:/bin"})
                    self.assertEqual((done.returncode, done.stderr), (0, ""))
                    unit = tree / new
                    if new.suffix == ".hpp":
                        unit = tree / "user" / (new.stem + ".cpp")
                        unit.write_text(USERS[str(new.parent)])
                    done = subprocess.run([COMPILER, "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow",
                                           "-Werror", f"-I{tree}/include", f"-I{tree}/src", f"-I{tree}", "-I/usr/include/eigen3",
                                           unit], text=True, capture_output=True)
                    self.assertEqual((done.returncode, done.stderr), (0, ""))


if __name__ == "__main__":
    unittest.main()
