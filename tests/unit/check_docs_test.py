"""scripts/check_docs.py accepts pages whose links lead somewhere, and names each that does not."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "check_docs.py"


def check(page):
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / "docs").mkdir()
        (root / "src").mkdir()
        (root / "src" / "loop.cpp").write_text("")
        (root / "docs" / "delay.md").write_text("# Delay\n\n## How it is `measured`, twice\n\n```text\n14.2 ms\n```\n")
        (root / "README.md").write_text(page)
        done = subprocess.run([sys.executable, SCRIPT, "--root", root], capture_output=True, text=True)
        return done.returncode, done.stderr


class CheckDocs(unittest.TestCase):
    def test_accepts_links_anchors_and_names_that_are_there(self):
        good = "[a](docs/delay.md) [b](docs/delay.md#how-it-is-measured-twice) [c](https://x.org/y) `loop.cpp` `src/loop.cpp`\n"
        self.assertEqual(check(good), (0, ""))

    def test_ignores_what_stands_in_a_listing(self):
        self.assertEqual(check("```\n[a](nowhere.md) `gone.cpp`\n```\n"), (0, ""))

    def test_names_what_is_not_there_with_its_line(self):
        for wrong, words in (("[a](docs/gone.md)", "links to docs/gone.md"), ("[a](docs/delay.md#other)", "no such heading"),
                             ("[a](#other)", "no such heading"), ("`gone.cpp`", "names gone.cpp"),
                             ("`src/other/loop.cpp`", "names src/other/loop.cpp")):
            code, said = check("# Title\n\n" + wrong + "\n")
            self.assertEqual(code, 1, wrong)
            self.assertIn("README.md:3: ", said)
            self.assertIn(words, said)

    def test_names_a_line_that_a_quotation_has_and_its_source_has_not(self):
        quoted = "<!-- quoted from docs/delay.md -->\n\n```\n14.2 ms\n"
        self.assertEqual(check(quoted + "```\n"), (0, ""))
        code, said = check(quoted + "15 ms\n```\n")
        self.assertEqual(code, 1)
        self.assertIn("README.md:5: is not a line of docs/delay.md", said)


if __name__ == "__main__":
    unittest.main()
