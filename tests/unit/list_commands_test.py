"""scripts/list_commands.py says which test runs a command of a page, and names those that none runs."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "scripts" / "list_commands.py"
sys.path[:0] = [str(ROOT / "scripts"), str(ROOT / "tests" / "pages")]
import list_commands  # noqa: E402


def listed(text):
    with tempfile.TemporaryDirectory() as folder:
        page = pathlib.Path(folder) / "page.md"
        page.write_text(text)
        done = subprocess.run([sys.executable, SCRIPT, page], capture_output=True, text=True)
        return done.returncode, done.stdout, done.stderr


class ListCommands(unittest.TestCase):
    def test_names_a_command_that_no_test_runs(self):
        code, _, said = listed("# Title\n\n```sh\nscripts/build.sh ci\nupright sweep my-sweep.yaml\n```\n")
        self.assertEqual(code, 1)
        self.assertIn("page.md:5: no test runs 'upright sweep my-sweep.yaml'", said)
        self.assertNotIn("scripts/build.sh", said)

    def test_names_inline_code_that_no_test_runs(self):
        code, _, said = listed("Then `upright margin PLANT\nGAINS` says it, and `upright conjure` and `theta_rad`.\n")
        self.assertEqual(code, 1)
        self.assertIn("page.md:1: no test runs 'upright margin PLANT GAINS'", said)
        self.assertIn("no test runs a command 'upright conjure'", said)
        self.assertNotIn("theta_rad", said)

    def test_names_a_command_that_hides_from_the_tests(self):
        for text in ("Type\n\n    upright check FILE\n", "```console\nupright check FILE\n```\n",
                     "```\nupright check FILE\n```\n"):
            code, _, said = listed(text)
            self.assertEqual(code, 1, text)
            self.assertIn("is a command in no block ```sh", said)

    def test_accepts_output(self):
        self.assertEqual(listed("```text\nupright check FILE\n```\n\n    upright: a message of the program\n")[0], 0)

    def test_says_who_runs_a_command(self):
        code, said, _ = listed("```sh\nscripts/test.sh ci       # all tests\n```\n")
        self.assertEqual(code, 0)
        self.assertIn("page.md:2\tscripts/test.sh ci\t.ci/run, step 'tests'", said)

    def test_knows_the_tests_of_the_pages(self):
        tests = list_commands.tests_of_pages()
        self.assertEqual(tests["docs/tutorial/first-hour.md"], "tutorial_test")
        self.assertEqual(tests["README.md"], "rig_pages_test")


if __name__ == "__main__":
    unittest.main()
