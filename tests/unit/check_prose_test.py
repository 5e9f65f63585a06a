"""scripts/check_prose.py accepts plain sentences, and names words and sentences that are not."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "check_prose.py"
LONG = " ".join(["word"] * 41)


def check(text, name="README.md", others={}):
    with tempfile.TemporaryDirectory() as folder:
        for file, content in {name: text, **others}.items():
            path = pathlib.Path(folder) / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content)
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
        self.assertIn("README.md: a sentence has 41 words", said)

    def test_names_a_word_with_its_line_and_a_plain_one(self):
        code, said = check("One.\n\nThe noise is what is left.\n")
        self.assertEqual(code, 1)
        self.assertIn("README.md:3: says 'what is left': write the residual", said)

    def test_names_a_word_in_a_literal_with_its_line(self):
        code, said = check('int x;\nfail("kind stands twice");\n', "src/cli/a.cpp")
        self.assertEqual(code, 1)
        self.assertIn("src/cli/a.cpp:2: says 'stands twice': write appears twice", said)

    def test_joins_neighbouring_literals_and_takes_a_line_end_for_a_space(self):
        for source in ('f("kind stands "\n  "twice");', 'f("first line\\nstands twice");', 'f(R"(stands twice)");'):
            self.assertEqual(check(source, "src/base/a.hpp")[0], 1, source)

    def test_ignores_comments_and_names_in_code(self):
        source = '#include "very.hpp"\n// It stands twice.\n/* " very " */ char c = \'"\'; f("very_small", 1\'000); // very\n'
        self.assertEqual(check(source, "src/cli/a.cpp"), (0, ""))

    def test_accepts_what_outputs_for_programs_say(self):
        self.assertEqual(check('f("while the cart slides it bears %.3g ms more of delay");', "src/cli/a.cpp"), (0, ""))
        self.assertEqual(check('f("the loop bears any delay");', "src/cli/a.cpp")[0], 1)

    def test_accepts_the_fixed_phrases_of_diagnoses(self):
        table = {"src/diagnosis/plain_words.hpp": '    {"what is left",\n     "the residual"},\n'}
        source = 'f("what is left depends on x");'
        self.assertEqual(check(source, "src/a.cpp", table), (0, ""))
        self.assertEqual(check(source, "src/a.cpp")[0], 1)

    def test_names_a_word_in_a_comment_of_a_configuration(self):
        code, said = check("plant: a  # what is left\nname: what is left\n", "config/rigs/a.yaml")
        self.assertEqual(code, 1)
        self.assertEqual(said.count("says 'what is left'"), 1)
        self.assertIn("config/rigs/a.yaml:1:", said)


if __name__ == "__main__":
    unittest.main()
