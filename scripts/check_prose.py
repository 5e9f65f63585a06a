#!/usr/bin/env python3
"""Checks README.md, CONTRIBUTING.md and docs/ for sentences and words that readers have to read twice.

  scripts/check_prose.py [--root FOLDER]

- A sentence has at most 40 words. Tables, listings and headings are not counted.
- Words of the list below are not used; each has a plain replacement.
Ends with 1 and a line for each finding.
"""
import argparse
import pathlib
import re
import sys

MOST_WORDS = 40  # plain English style guides ask for 25; a technical sentence with an example in brackets needs more
PLAIN = {
    r"what is left": "the residual, the remainder",
    r"(?:tell|tells|told) (?:\w+ )?apart": "distinguish",
    r"dearest": "slowest",
    r"aloud": "say what is reported and where",
    r"to and fro": "back and forth",
    r"for ever": "permanently",
    r"earlier sessions?": "nothing: the reader does not need the history",
    r"all the same": "nevertheless",
    r"a thing of its own": "separate",
    r"goes? with nothing": "depends on no measured quantity",
    r"knows? nothing of": "does not model",
    r"(?:there|where|here)(?:of|in|upon|by|with)": "a plain pronoun",
    r"utili[sz]e[sd]?": "use",
    r"in order to": "to",
    r"obviously|of course|simply|very": "nothing",
    r"e\.g\.": "for example",
    r"i\.e\.": "that is",
}
FENCE = re.compile(r"^ *```.*?^ *```", re.MULTILINE | re.DOTALL)
NOT_PROSE = re.compile(r"^(?:\||#|    |<!--|<img|!\[).*$", re.MULTILINE)
LIST_ITEM = re.compile(r"^\s*(?:[-*]|\d+\.)\s+", re.MULTILINE)
SENTENCE_END = re.compile(r"(?<=[.!?:;])(?:\*\*)?\s+|\n\s*\n")


def blank(match):
    """As many lines as before, so that the numbers of lines stay."""
    return "\n" * match[0].count("\n")


def findings_of(name, text):
    prose = FENCE.sub(blank, text)
    # In quotation marks and code style stands what the program says.
    quoted = re.sub(r"`[^`\n]*`|\"[^\"\n]*\"", "code", prose)
    for pattern, plain in PLAIN.items():
        for match in re.finditer(rf"(?<![\w-])(?:{pattern})(?![\w-])", quoted, re.IGNORECASE):
            if not quoted[quoted.rfind("\n", 0, match.start()) + 1 :].startswith("|"):
                yield f"{name}:{quoted[:match.start()].count(chr(10)) + 1}: says '{match[0]}': write {plain}"
    flat = NOT_PROSE.sub("", re.sub(r"\]\([^)\n]*\)", "]", quoted))
    flat = LIST_ITEM.sub("\n\n", flat)
    start = 0
    for end in [*(match.start() for match in SENTENCE_END.finditer(flat)), len(flat)]:
        words = flat[start:end].split()
        if len(words) > MOST_WORDS:
            yield f"{name}: a sentence of {len(words)} words ('{' '.join(words[:6])} ...'): make two of it"
        start = end


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent)
    root = parser.parse_args().root.resolve()
    pages = sorted([*(root / name for name in ("README.md", "CONTRIBUTING.md")), *(root / "docs").rglob("*.md")])
    findings = []
    for page in pages:
        name = page.relative_to(root).as_posix()
        if page.exists():
            findings += findings_of(name, page.read_text())
    for finding in findings:
        print(finding, file=sys.stderr)
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
