#!/usr/bin/env python3
"""Checks that no source or function is too long to read, and that the names of tests fit into a line of ctest's output.

A function of the program that has more lines or parameters than here must say why in the comment above it, with one of the
words "lines", "split" and "parameters".

  scripts/check_sizes.py [--root FOLDER]

The exit code is 1, with a line for each finding.
"""
import argparse
import pathlib
import re
import sys

MAX_LINES = 600  # of a source: a longer one holds more than one concept
MAX_FUNCTION_LINES = 60  # of a function of the program, with its head
MAX_PARAMETERS = 6
MAX_TEST_NAME = 60  # characters of Suite.Name: a longer one is a sentence, which belongs into a comment
SOURCES = (".cpp", ".hpp", ".c", ".h", ".S", ".py", ".sh", ".cmake")
PROGRAM = ("include", "src", "sim", "hal", "studies")
FOLDERS = ("include", "src", "sim", "hal", "studies", "firmware", "tests", "examples", "scripts", "cmake")
TEST = re.compile(r"^\s*(?:TYPED_)?TEST(?:_F|_P)?\(\s*(\w+)\s*,\s*(\w+)\s*\)", re.MULTILINE)
REASON = re.compile(r"\b(lines|split|parameters)\b")
# As clang-format writes the head of a function: at most one level deep, without `=`, `[` (a lambda) or a keyword of a statement.
HEAD = re.compile(r"(?:template <.*?> )?(?!(?:namespace|struct|class|enum|union|if|for|while|switch|return|else|do|case)\b)"
                  r"(?:[^=\[({.]*[ &*>])?([\w:~]+|operator\S+)\((.*)\)[^()]*(?: : .*)?\{")


def parameters_in(text):
    """The number of parameters in a list of them."""
    depth = commas = 0
    for character in text:
        if depth < 0:
            break  # of what follows the list: initialisers of a constructor
        depth += (character in "<({[") - (character in ">)}]")
        commas += character == "," and depth == 0
    return commas + bool(text.strip())


def functions_in(lines):
    """Each function: number of its first line, its name, its lines and its parameters."""
    for opened, line in enumerate(lines):
        if not line.endswith("{") or line.lstrip().startswith("//"):
            continue
        first = opened
        while first > 0 and not re.search(r"(^\s*|[;{}]\s*|^\s*//.*|^#.*|\w:|; +///?<?.*)$", lines[first - 1]):
            first -= 1
        indent = len(lines[first]) - len(lines[first].lstrip())
        head = HEAD.fullmatch(" ".join(part.strip() for part in lines[first : opened + 1]))
        if not head or indent > 2:
            continue
        end = " " * indent + "}"
        last = next((number for number in range(opened + 1, len(lines)) if lines[number].startswith(end)), opened)
        yield first, head.group(1), last - first + 1, parameters_in(head.group(2))


def has_reason(lines, first):
    while first > 0 and lines[first - 1].lstrip().startswith("//"):
        first -= 1
        if REASON.search(lines[first]):
            return True
    return False


def large_functions(path, text):
    lines = text.split("\n")
    for first, name, length, parameters in functions_in(lines):
        for count, most, what in ((length, MAX_FUNCTION_LINES, "lines"), (parameters, MAX_PARAMETERS, "parameters")):
            if count > most and not has_reason(lines, first):
                yield f"{path}:{first + 1}: {name} has {count} {what}, more than {most}: split it, or say why not in the comment above"


def findings_in(path, text):
    lines = text.count("\n")
    if path.endswith("pp") and path.split("/")[0] in PROGRAM:
        yield from large_functions(path, text)
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
