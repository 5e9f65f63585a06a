"""scripts/check_keys.py holds the keys of readers against the reference, both ways."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "check_keys.py"
# One reader, and one list of keys that is read and written.
READER = 'config.delay_s = document.number("delay_s", range);\nint f(const YamlMap& map) { return small(map, "sign", -1, 1); }\n'
LIST = 'void rig_keys(YamlKeys& keys, Rig& rig) { keys.one_of("active", rig.active, levels); line_key(keys, "line", rig.line); }\n'


def check(page):
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for file, text in (("src/control/gain_file.cpp", READER), ("hal/rig_file.cpp", LIST), ("docs/reference/files.md", page)):
            (root / file).parent.mkdir(parents=True)
            (root / file).write_text(text)
        done = subprocess.run([sys.executable, SCRIPT, "--root", root], capture_output=True, text=True)
        return done.returncode, done.stderr


def table(*keys):
    return "| key | meaning |\n|---|---|\n" + "".join(f"| `{key}` | text |\n" for key in keys)


class CheckKeys(unittest.TestCase):
    def test_accepts_a_reference_with_every_key(self):
        self.assertEqual(check(table("delay_s", "amplifier.sign", "active", "line")), (0, ""))

    def test_names_a_key_that_is_not_described(self):
        code, said = check(table("delay_s"))
        self.assertEqual(code, 1)
        self.assertIn("src/control/gain_file.cpp: reads sign", said)
        self.assertIn("hal/rig_file.cpp: reads active", said)
        self.assertIn("hal/rig_file.cpp: reads line", said)

    def test_names_a_key_that_no_reader_asks_for(self):
        code, said = check(table("delay_s", "sign", "delay_ms"))
        self.assertEqual(code, 1)
        self.assertIn("docs/reference/files.md:5: has the key delay_ms", said)


if __name__ == "__main__":
    unittest.main()
