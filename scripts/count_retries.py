#!/usr/bin/env python3
"""Counts what tests in real time tried again, and what tests skipped; fails above the budget.

  scripts/count_retries.py BUILD_FOLDER...

Of each build folder it reads retries_and_skips.log, a line for each retry and skip that a stall of the machine excused
(tests/support/real_time.hpp) and for tests that could not be run at all, and ctest.xml, what ctest said of its last run, if they
are there. No file: nothing to count.
"""
import pathlib
import re
import sys
import xml.etree.ElementTree

# The budgets of one run of all tests, of .ci/run and of scripts/test.sh alike.
MOST_RETRIES = 20        # of some 250 test cases in real time: more says that the machine is too busy to judge by
MOST_STALLED_SKIPS = 2   # of the same: what was skipped was not tested
# Tests that need what is not everywhere, each with its remedy in its output: measured data (1), a second variant of libm (1),
# memory that can be locked (1), a browser (4), MPI (1), pymodbus (7), a mount name space (1), a model of friction (1).
MOST_OTHER_SKIPS = 17


class Counts:
    def __init__(self):
        self.retries, self.stalled, self.other = [], [], []

    def read_log(self, file):
        for line in file.read_text().splitlines():
            kind, test, what = line.split("\t")[:3]
            {"retry": self.retries, "skip": self.stalled, "absent": self.other}[kind].append(f"{test}: {what}")

    def read_ctest(self, file):
        stalled = {entry.split(":")[0] for entry in self.stalled}
        for case in xml.etree.ElementTree.parse(file).getroot().iter("testcase"):
            output = case.findtext("system-out") or ""
            inside = set(re.findall(r"\[  SKIPPED \] ([^\s,]+)(?:, where .*)? \(\d+ ms\)", output))
            self.other += sorted(f"{case.get('name')}: {name}" for name in inside - stalled)
            if case.find("skipped") is not None and not inside:
                self.other.append(case.get("name"))


def main(folders):
    counts = Counts()
    for folder in map(pathlib.Path, folders):
        log, ctest = folder / "retries_and_skips.log", folder / "ctest.xml"
        if log.exists():
            counts.read_log(log)
        if ctest.exists():
            counts.read_ctest(ctest)
    too_many = False
    for what, found, most in (("retries after a stall of the machine", counts.retries, MOST_RETRIES),
                              ("tests skipped, each attempt hit by a stall", counts.stalled, MOST_STALLED_SKIPS),
                              ("tests skipped for what is not here", counts.other, MOST_OTHER_SKIPS)):
        print(f"{len(found)} {what} (at most {most})")
        for entry in found:
            print(f"  {entry[:150]}")
        too_many = too_many or len(found) > most
    if too_many:
        print("FAILED: more retries or skips than the budget at the top of scripts/count_retries.py", file=sys.stderr)
    return 1 if too_many else 0


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        print(__doc__, file=sys.stderr)
        sys.exit(2)
    sys.exit(main(sys.argv[1:]))
