"""scripts/check_key_tables.py holds the tables of keys against the schemas, both ways."""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "scripts" / "check_key_tables.py"
PAGES = ("docs/reference/rig-files.md", "docs/reference/dataset-files.md", "docs/reference/experiment-files.md",
         "docs/explanation/quiet-control.md")
PLANT = {"type": "object", "properties": {
    "mass_kg": {"type": "number", "exclusiveMinimum": 0.0},
    "motor": {"type": "object", "properties": {"lag_s": {"type": "number", "minimum": 0.0, "maximum": 10.0, "default": 0.5}}},
    "shape": {"enum": ["rod", "disc"]}}, "required": ["mass_kg"]}
ROWS = ("| `mass_kg` | kg | above 0 | required | text |", "| `motor.lag_s` | s | 0 to 10 | 0.5 | text |",
        "| `shape` | | `rod`, `disc` | none | text |")


def check(*rows):
    """The exit code and the findings, for a program whose plant files have these keys and a page with these rows."""
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for page in (*PAGES, "docs/reference/files.md"):
            (root / page).parent.mkdir(parents=True, exist_ok=True)
            (root / page).write_text("")
        head = "## Plant file\n\n| key | unit | range | default | meaning |\n|---|---|---|---|---|\n"
        (root / "docs/reference/files.md").write_text(head + "\n".join(rows) + "\n")
        program = root / "upright"
        program.write_text(f"#!{sys.executable}\nimport sys\nprint({json.dumps(PLANT)!r} if sys.argv[2] == 'plant' else '{{}}')\n")
        program.chmod(0o755)
        done = subprocess.run([sys.executable, SCRIPT, "--upright", program, "--root", root], capture_output=True, text=True)
        return done.returncode, done.stderr


class CheckKeyTables(unittest.TestCase):
    def refuses(self, row, place, finding):
        rows = list(ROWS)
        rows[place] = row
        code, said = check(*rows)
        self.assertEqual(code, 1)
        self.assertIn(finding, said)

    def test_accepts_tables_that_state_everything(self):
        self.assertEqual(check(*ROWS), (0, ""))

    def test_names_a_key_without_a_row(self):
        code, said = check(*ROWS[:2])
        self.assertEqual((code, said), (1, "no page has a row for shape of a plant file\n"))

    def test_names_a_row_without_a_key(self):
        code, said = check(*ROWS, "| `colour` | | text | none | text |")
        self.assertEqual(code, 1)
        self.assertIn("files.md:8: has the key colour", said)

    def test_names_what_a_row_states_wrongly(self):
        self.refuses("| `mass_kg` | g | above 0 | required | text |", 0, "mass_kg is in kg, the page says 'g'")
        self.refuses("| `mass_kg` | kg | at least 0 | required | text |", 0, "the program accepts above 0")
        self.refuses("| `mass_kg` | kg | above 0 | none | text |", 0, "it is required")
        self.refuses("| `motor.lag_s` | s | 0 to 100 | 0.5 | text |", 1, "the program accepts 0 to 10,")
        self.refuses("| `motor.lag_s` | s | 0 to 10 | 0.25 | text |", 1, "the default is 0.5")
        self.refuses("| `shape` | | `rod` | none | text |", 2, "the program accepts `disc`")
        self.refuses("| `shape` | | `rod`, `disc` | required | text |", 2, "it may be left out")


if __name__ == "__main__":
    unittest.main()
