#!/usr/bin/env python3
"""Checks that the reference has every key that a reader of files accepts, and no other.

  scripts/check_keys.py [--root FOLDER]

- A key is a word that a reader requests from its YAML map, as in `map.number("delay_s", ...)`.
- It must appear in the reference, in code style or in a listing.
- Each name in the first column of a table of keys must be a key of a reader.
The exit code is 1, with a line for each finding.
"""
import argparse
import pathlib
import re
import sys

# Folders and files of the readers. In a folder, the sources that name YamlMap, YamlKeys or PieceKeys are readers.
READERS = ("src/model", "src/control", "src/sweep", "src/experiment", "hal", "src/measurement/dataset_file.cpp")
JOURNAL = ("src/experiment/servo_model.cpp", "src/experiment/experiment.cpp")  # they read files that the program wrote
PAGES = ("docs/reference/files.md", "docs/reference/rig-files.md", "docs/reference/dataset-files.md",
         "docs/reference/experiment-files.md", "docs/reference/effects.md", "docs/explanation/quiet-control.md",
         "docs/how-to/run-sweeps.md")
ASKED = re.compile(r'(?:\.|->)(?:number|number_or|optional_number|numbers|choice|flag|flag_or|integer|text|text_or|path|map|'
                   r'optional_map|deciding_map|decides_by_presence|maps|has|is_map|one_of|optional_integer|usual_map|section|section_of|items|given)'
                   r'\(\s*(?:is_cart \? )?"([a-z0-9_]+)"(?: : "([a-z0-9_]+)")?')
HELPED = re.compile(r'\b\w+(?:<\w+>)?\((?:map|keys|grid|document), "([a-z0-9_]+)"|\bencoder\("([a-z0-9_]+)"'
                    r'|\bkeys\.\w+\("([a-z0-9_]+)"')
LISTED = re.compile(r'^\s*\{"([a-z0-9_]+)", &\w+::', re.MULTILINE)  # tables of keys and their destinations


def keys_of(root):
    found = {}
    for reader in READERS:
        path = root / reader
        for file in sorted(path.rglob("*.?pp")) if path.is_dir() else [path]:
            text = file.read_text() if file.exists() else ""
            if path.is_dir() and not re.search("YamlMap|YamlKeys|PieceKeys", text) or file.relative_to(root).as_posix() in JOURNAL:
                continue
            for match in [*ASKED.finditer(text), *HELPED.finditer(text), *LISTED.finditer(text)]:
                for key in filter(None, match.groups()):
                    found.setdefault(key, file.relative_to(root).as_posix())
    return found


def named_in(text):
    """All words in code style and in listings."""
    words = set()
    for part in re.findall(r"^ *```.*?^ *```", text, re.MULTILINE | re.DOTALL) + re.findall(r"`[^`\n]+`", text):
        words |= set(re.findall(r"[a-z0-9_]+", part))
    return words


def table_keys(text):
    """Keys in the first column of tables of keys, with their line numbers."""
    in_table = False
    for number, line in enumerate(text.split("\n"), 1):
        if not line.startswith("|"):
            in_table = False
        elif re.match(r"\| key\b", line):
            in_table = True
        elif in_table and not line.startswith("|---"):
            for code in re.findall(r"`([^`]+)`", line.split("|")[1]):
                yield number, re.split(r"[:{]", code)[0].strip().split(".")[-1]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent)
    root = parser.parse_args().root.resolve()
    keys = keys_of(root)
    pages = {page: (root / page).read_text() for page in PAGES if (root / page).exists()}
    named = set().union(*(named_in(text) for text in pages.values()))
    findings = [f"{file}: reads {key}, which the reference does not have: describe it in docs/reference"
                for key, file in sorted(keys.items()) if key not in named]
    for page, text in pages.items():
        findings += [f"{page}:{line}: has the key {key}, which no reader accepts: correct it"
                     for line, key in table_keys(text) if key not in keys]
    for finding in findings:
        print(finding, file=sys.stderr)
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
