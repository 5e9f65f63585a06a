#!/usr/bin/env python3
"""Finds long sentences and unclear words in the documents, and unclear words in the program's own texts.

  scripts/check_prose.py [--root FOLDER]

- README.md, CONTRIBUTING.md and docs/: a sentence must have at most 40 words. Tables, listings and headings are not
  checked.
- There, in the comments of include/, in the string literals of the C++ sources (help texts, messages, reports) and in the
  comments of config/: words of the lists below must not be used. Each has a plain replacement.
The exit code is 1, with a line for each finding.
"""
import argparse
import pathlib
import re
import sys

from fixed_phrases import fixed_phrases

MAX_WORDS = 40  # plain English style guides ask for 25; a technical sentence with an example in brackets needs more
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
# Checked only in the program's texts: the documents use some of these words in other meanings.
PLAIN_IN_TEXTS = {
    r"stands? twice": "appears twice",
    r"(?:goes?|went) on from (?:there|where)": "continue, resume",
    r"whoever": "every machine that, every person that",
    r"cannot be had": "is not available",
    r"anew": "again",
    r"held against": "compared with",
    r"ma[kd]es? up for": "compensate",
    r"bears?|borne": "tolerate",
    r"reckons?": "assume, expect",
    r"nobody|somebody": "an operator, or the cause without a person",
}
# The comment that `design` writes into a gain file: YAML outputs do not change.
KEPT = re.compile(r"it bears \S+ ms more of delay")
TEXT_FOLDERS = ("hal", "include", "sim", "src", "studies")
CPP_TOKEN = re.compile(
    r"//[^\n]*|/\*.*?\*/|(?<!\w)'(?:\\.|[^'\\\n])+'"
    r"|R\"(?P<mark>[^(\s]*)\((?P<raw>.*?)\)(?P=mark)\"|\"(?P<text>(?:\\.|[^\"\\\n])*)\"", re.DOTALL)
CPP_INCLUDE = re.compile(r"^\s*#\s*include.*$", re.MULTILINE)
YAML_COMMENT = re.compile(r"(?:^|\s)#(.*)$")
COMMENT_BLOCK = re.compile(r"^[ \t]*//[^\n]*(?:\n[ \t]*//[^\n]*)*|//[^\n]*", re.MULTILINE)
COMMENT_MARK = re.compile(r"\s*//[/<]*")
FENCE = re.compile(r"^ *```.*?^ *```", re.MULTILINE | re.DOTALL)
NOT_PROSE = re.compile(r"^(?:\||#|    |<!--|<img|!\[).*$", re.MULTILINE)
LIST_ITEM = re.compile(r"^\s*(?:[-*]|\d+\.)\s+", re.MULTILINE)
SENTENCE_END = re.compile(r"(?<=[.!?:;])(?:\*\*)?\s+|\n\s*\n")


def blank(match):
    """As many lines as before, so that line numbers do not change."""
    return "\n" * match[0].count("\n")


def unclear_words(text, words):
    """Each word of a list that a text uses: its position, the word, and what to write instead."""
    for pattern, plain in words.items():
        for match in re.finditer(rf"(?<![\w-])(?:{pattern})(?![\w-])", text, re.IGNORECASE):
            yield match.start(), match[0], plain


def findings_of(name, text):
    prose = FENCE.sub(blank, text)
    # Text in quotation marks and code style is output of the program.
    quoted = re.sub(r"`[^`\n]*`|\"[^\"\n]*\"", "code", prose)
    for start, word, plain in unclear_words(quoted, PLAIN):
        if not quoted[quoted.rfind("\n", 0, start) + 1 :].startswith("|"):
            yield f"{name}:{quoted[:start].count(chr(10)) + 1}: says '{word}': write {plain}"
    flat = NOT_PROSE.sub("", re.sub(r"\]\([^)\n]*\)", "]", quoted))
    flat = LIST_ITEM.sub("\n\n", flat)
    start = 0
    for end in [*(match.start() for match in SENTENCE_END.finditer(flat)), len(flat)]:
        words = flat[start:end].split()
        if len(words) > MAX_WORDS:
            yield f"{name}: a sentence has {len(words)} words ('{' '.join(words[:6])} ...'): split it"
        start = end


def findings_in_comments(name, source):
    for block in COMMENT_BLOCK.finditer(source):
        text = " ".join(COMMENT_MARK.sub("", line).strip() for line in block[0].splitlines())
        for _, word, plain in unclear_words(text, PLAIN):
            line = source[: block.start()].count("\n") + 1
            yield f"{name}:{line}: says '{word}': write {plain}"


def literals_of(source):
    """The string literals of a C++ source, each with its line. Adjacent literals are one, as for the compiler."""
    source = CPP_INCLUDE.sub("", source)
    line, text, end = 0, "", 0
    for match in CPP_TOKEN.finditer(source):
        part = match["raw"] if match["text"] is None else match["text"]
        if part is None:
            continue
        if not text or source[end : match.start()].strip():
            yield line, text
            line, text = source.count("\n", 0, match.start()) + 1, ""
        text += part
        end = match.end()
    yield line, text


def yaml_comments_of(document):
    """The comments of a YAML document, each with its line."""
    for number, line in enumerate(document.splitlines(), 1):
        if match := YAML_COMMENT.search(line):
            yield number, match[1]


def kept_phrases(root):
    """What the program's texts may say, because their values in output files do not change."""
    return re.compile("|".join([KEPT.pattern, *(re.escape(fixed) for fixed, _ in fixed_phrases(root))]))


def findings_in_texts(name, texts, kept=KEPT):
    for line, text in texts:
        for _, word, plain in unclear_words(kept.sub("", text).replace("\\n", "\n"), PLAIN | PLAIN_IN_TEXTS):
            yield f"{name}:{line}: says '{word}': write {plain}"


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
    for header in sorted((root / "include").rglob("*.hpp")):
        findings += findings_in_comments(header.relative_to(root).as_posix(), header.read_text())
    kept = kept_phrases(root)
    for folder in TEXT_FOLDERS:
        for file in sorted([*(root / folder).rglob("*.cpp"), *(root / folder).rglob("*.hpp")]):
            findings += findings_in_texts(file.relative_to(root).as_posix(), literals_of(file.read_text()), kept)
    for file in sorted((root / "config").rglob("*.yaml")):
        findings += findings_in_texts(file.relative_to(root).as_posix(), yaml_comments_of(file.read_text()))
    for finding in findings:
        print(finding, file=sys.stderr)
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
