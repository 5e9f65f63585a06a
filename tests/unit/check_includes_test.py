"""scripts/check_includes.py accepts a tree whose folders keep to their targets, and says what is wrong with each that does not."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "check_includes.py"

GOOD = {
    "src/low/CMakeLists.txt": "# Holds: what is low\nupright_library(upright_low SOURCES low.cpp OFFERS shown.hpp)\n",
    "src/low/low.cpp": '#include "hidden.hpp"\n#include "shown.hpp"\n#include "upright/low/api.hpp"\n',
    "src/low/hidden.hpp": "",
    "src/low/shown.hpp": "",
    "include/upright/low/api.hpp": "",
    "src/high/CMakeLists.txt": "# Holds: what is high\nupright_library(upright_high SOURCES high.cpp LINK upright_low)\n",
    "src/high/high.cpp": '#include <vector>\n#include "low/shown.hpp"\n#include "upright/low/api.hpp"\n',
    "docs/architecture.md": "<!-- written by scripts/check_includes.py --write -->\n<!-- end -->\n",
}


def check(changes, write_table=True):
    """The exit code and the words of the script on the good tree with some files changed."""
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, text in {**GOOD, **changes}.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text)
        command = [sys.executable, SCRIPT, "--root", root]
        if write_table:
            subprocess.run([*command, "--write"], capture_output=True)
        done = subprocess.run(command, capture_output=True, text=True)
        return done.returncode, done.stderr


class CheckIncludes(unittest.TestCase):
    def expect(self, words, changes):
        code, said = check(changes)
        self.assertEqual(code, 1, said)
        self.assertIn(words, said)

    def test_accepts_a_tree_that_keeps_to_its_targets(self):
        self.assertEqual(check({}), (0, ""))

    def test_refuses_a_header_that_is_not_offered(self):
        self.expect("src/high/high.cpp:1: includes low/hidden.hpp, which upright_low does not offer",
                    {"src/high/high.cpp": '#include "low/hidden.hpp"\n#include "low/shown.hpp"\n'})

    def test_refuses_a_header_of_a_target_that_is_not_linked(self):
        self.expect("which upright_low does not link", {"src/low/low.cpp": '#include "high/high.hpp"\n', "src/high/high.hpp": ""})

    def test_refuses_a_supported_header_that_includes_another_kind(self):
        self.expect("not part of the supported API", {"include/upright/low/api.hpp": '#include "low/shown.hpp"\n'})

    def test_refuses_a_cycle(self):
        self.expect("links itself", {"src/low/CMakeLists.txt": GOOD["src/low/CMakeLists.txt"].replace(")", " LINK upright_high)")})

    def test_refuses_an_offer_that_nobody_takes(self):
        self.expect("offers hidden.hpp, which no other folder includes", {"src/low/CMakeLists.txt": GOOD["src/low/CMakeLists.txt"].replace("OFFERS", "OFFERS hidden.hpp")})

    def test_refuses_a_folder_that_does_not_say_what_it_holds(self):
        self.expect("begin it with '# Holds:", {"src/low/CMakeLists.txt": GOOD["src/low/CMakeLists.txt"].split("\n", 1)[1]})

    def test_refuses_a_page_whose_table_is_another(self):
        code, said = check({}, write_table=False)
        self.assertEqual(code, 1)
        self.assertIn("the table of folders differs from the targets", said)


if __name__ == "__main__":
    unittest.main()
