#!/usr/bin/env python3
"""Checks that no source is too long to read, and that the names of tests fit into a line of ctest's output.

  scripts/check_sizes.py [--root FOLDER]

The exit code is 1, with a line for each finding.
"""
import argparse
import pathlib
import re
import sys

MAX_LINES = 600  # of a source: a longer one holds more than one concept
MAX_TEST_NAME = 60  # characters of Suite.Name: a longer one is a sentence, which belongs into a comment
SOURCES = (".cpp", ".hpp", ".c", ".h", ".S", ".py", ".sh", ".cmake")
FOLDERS = ("include", "src", "sim", "hal", "studies", "firmware", "tests", "examples", "scripts", "cmake")
TEST = re.compile(r"^\s*(?:TYPED_)?TEST(?:_F|_P)?\(\s*(\w+)\s*,\s*(\w+)\s*\)", re.MULTILINE)


def findings_in(path, text):
    lines = text.count("\n")
    if lines > MAX_LINES:
        yield f"{path}: has {lines} lines, more than {MAX_LINES}: split it by its concepts"
    for match in TEST.finditer(text):
        name = f"{match.group(1)}.{match.group(2)}"
        if len(name) > MAX_TEST_NAME:
            line = text[: match.start(1)].count("\n") + 1
            yield f"{path}:{line}: {name} has {len(name)} characters, more than {MAX_TEST_NAME}: shorten it"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent)
    root = parser.parse_args().root.resolve()
    found = [finding for folder in FOLDERS for file in sorted((root / folder).rglob("*"))
             if file.suffix in SOURCES and file.is_file()
             for finding in findings_in(file.relative_to(root).as_posix(), file.read_text(errors="replace"))]
    for finding in found:
        print(finding, file=sys.stderr)
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
