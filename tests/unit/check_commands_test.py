"""scripts/check_commands.py runs the commands of a page, and names those that print something else."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "check_commands.py"


def check(text, *options):
    with tempfile.TemporaryDirectory() as folder:
        page = pathlib.Path(folder) / "page.md"
        page.write_text(text)
        done = subprocess.run([sys.executable, SCRIPT, "--upright", "/bin/true", page, *options], capture_output=True, text=True)
        return done.returncode, done.stderr, page.read_text()


def page(command, output):
    return f"# Title\n\n```sh\n{command}\n```\n\n```text\n{output}\n```\n"


class CheckCommands(unittest.TestCase):
    def test_accepts_what_is_printed(self):
        self.assertEqual(check(page("echo gap 3.5", "gap 3.5"))[0], 0)

    def test_accepts_stamps_and_numbers_that_differ_little(self):
        self.assertEqual(check(page("echo runs/20260101T000000Z-a 100.4", "runs/20261123T185329Z-a 100.0"))[0], 0)
        self.assertEqual(check(page("echo 1.01", "1.00"))[0], 0)

    def test_names_other_numbers_and_words(self):
        for printed, shown in (("1.03", "1.00"), ("exit code 2", "exit code 3"), ("fell", "Stayed up")):
            code, said, _ = check(page(f"echo {printed}", shown))
            self.assertEqual(code, 1, printed)
            self.assertIn("page.md:3: the output differs from the page", said)

    def test_names_a_command_that_fails(self):
        self.assertIn("page.md:3: the command ended with exit code 3", check(page("exit 3", "nothing"))[1])

    def test_writes_the_files_of_a_page_and_runs_in_one_folder(self):
        text = "<!-- file a.txt -->\n```yaml\nkey: 1\n```\n\n" + page("cat a.txt", "key: 1")
        self.assertEqual(check(text)[0], 0)

    def test_stops_at_the_first_command_that_fails(self):
        code, said, _ = check(page("false\necho on", "on"))
        self.assertEqual(code, 1)
        self.assertIn("page.md:3: the command ended with exit code 1", said)

    def test_lets_a_page_show_an_exit_code(self):
        self.assertEqual(check(page("(exit 3)\necho code $?", "code 3"))[0], 0)

    def test_runs_inline_commands_with_arguments(self):
        self.assertIn("page.md:1: the command ended with exit code 1", check("Type `cmake -E false` in `build`, or `cmake`.\n")[1])

    def test_does_not_run_the_name_of_a_program(self):
        self.assertEqual(check("It uses `sudo` unless `make` is there.\n")[0], 0)

    def test_leaves_out_what_is_run_elsewhere(self):
        self.assertEqual(check(page("sudo groupadd --system upright   # once\nscripts/test.sh ci\necho on", "on"))[0], 0)

    def test_does_not_run_other_blocks(self):
        self.assertEqual(check("```console\nexit 3\n```\n")[0], 0)

    def test_writes_what_is_printed(self):
        self.assertIn("```text\nnew\n```", check(page("echo new", "old"), "--write")[2])


if __name__ == "__main__":
    unittest.main()
