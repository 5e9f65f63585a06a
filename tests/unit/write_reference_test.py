"""scripts/write_reference.py copies every limit of SelectionPolicy with its comment, and refuses one without."""
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
import write_reference  # noqa: E402

HEADER = """/// When an effect is added.
struct AcceptancePolicy {
  /// [evidence] The least evidence,
  /// beyond the price. Chosen.
  double min_evidence = 25.0;
%s  double share = 1.0 / 3.0;
};

struct SelectionPolicy {
  AcceptancePolicy acceptance;
};
"""


def limits(header):
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "selection_policy.hpp"
        file.write_text(header)
        return write_reference.limits_of(file)


class WriteReference(unittest.TestCase):
    def test_copies_values_units_and_comments(self):
        lines = limits(HEADER % "  /// [1] A share.\n")
        self.assertIn("| `min_evidence` | 25 | evidence | The least evidence, beyond the price. Chosen. |", lines)
        self.assertIn("| `share` | 1 / 3 | - | A share. |", lines)
        self.assertIn("### Acceptance", lines)

    def test_refuses_a_limit_without_a_comment(self):
        with self.assertRaisesRegex(SystemExit, "a member of AcceptancePolicy has no comment of its own"):
            limits(HEADER % "")


if __name__ == "__main__":
    unittest.main()
