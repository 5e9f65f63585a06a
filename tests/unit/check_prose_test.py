"""scripts/check_prose.py accepts plain sentences, and names words and sentences that are not."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "check_prose.py"
LONG = " ".join(["word"] * 41)


def check(page):
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "README.md").write_text(page)
        done = subprocess.run([sys.executable, SCRIPT, "--root", folder], capture_output=True, text=True)
        return done.returncode, done.stderr


class CheckProse(unittest.TestCase):
    def test_accepts_plain_sentences(self):
        self.assertEqual(check("# Title\n\nThe cart moves. The residual is noise.\n"), (0, ""))

    def test_ignores_listings_tables_and_quotations(self):
        self.assertEqual(check(f"```\n{LONG}\n```\n\n| {LONG} |\n\nIt prints `what is left` and \"what is left\".\n"), (0, ""))

    def test_counts_the_words_of_each_item_of_a_list(self):
        item = "- " + " ".join(["word"] * 30) + "\n"
        self.assertEqual(check(item + item), (0, ""))

    def test_names_a_long_sentence(self):
        code, said = check(f"Short. {LONG}.\n")
        self.assertEqual(code, 1)
        self.assertIn("README.md: a sentence of 41 words", said)

    def test_names_a_word_with_its_line_and_a_plain_one(self):
        code, said = check("One.\n\nThe noise is what is left.\n")
        self.assertEqual(code, 1)
        self.assertIn("README.md:3: says 'what is left': write the residual", said)


if __name__ == "__main__":
    unittest.main()
