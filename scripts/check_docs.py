#!/usr/bin/env python3
"""Checks the links, anchors and names of source files in README.md, the pages beside it, and docs/.

  scripts/check_docs.py [--root FOLDER]

- A link to a file of the repository must lead to a file, and its anchor to a heading of that page.
- After `<!-- quoted from PAGE -->` every line of the next listing must be in that page, whose listings tests compare.
- `name.cpp` in code style must be a source of that name, and `src/folder/name.hpp` a file at that path.
The exit code is 1, with a line for each finding. Links to the web are not followed.
"""
import argparse
import pathlib
import re
import subprocess
import sys

LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
SOURCE = re.compile(r"`([\w./-]+\.(?:cpp|hpp|py|sh))`")
QUOTED = re.compile(r"^<!-- quoted from (\S+) -->\n+```\w*\n(.*?)^```", re.MULTILINE | re.DOTALL)
FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)


def anchors_of(text):
    """The anchors that GitHub creates for the headings of a page."""
    found = set()
    for heading in re.findall(r"^#+ +(.*)$", FENCE.sub("", text), re.MULTILINE):
        words = re.sub(r"[`*]|\[([^\]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
        found.add(re.sub(r"\s", "-", re.sub(r"[^\w\- ]", "", words)))
    return found


def files_of(root):
    listed = subprocess.run(["git", "-C", root, "ls-files", "-co", "--exclude-standard"], capture_output=True, text=True)
    if listed.returncode == 0:
        return set(listed.stdout.split("\n"))
    return {file.relative_to(root).as_posix() for file in root.rglob("*") if file.is_file()}


def findings_of(page, root, files):
    text = page.read_text()
    prose = FENCE.sub(lambda fence: "\n" * fence.group(0).count("\n"), text)
    where = lambda match: f"{page.relative_to(root)}:{prose[:match.start()].count(chr(10)) + 1}"
    for match in LINK.finditer(prose):
        target = match.group(1)
        if re.match(r"[a-z]+:", target):
            continue
        name, _, anchor = target.partition("#")
        file = (page.parent / name).resolve() if name else page
        if not file.exists():
            yield f"{where(match)}: links to {target}, which does not exist: correct the link"
        elif anchor and file.suffix == ".md" and anchor not in anchors_of(file.read_text()):
            yield f"{where(match)}: links to {target}, but that page has no such heading: correct the anchor"
    for match in QUOTED.finditer(text):
        source = page.parent / match.group(1)
        lines = source.read_text().splitlines() if source.exists() else []
        for number, line in enumerate(match.group(2).splitlines(), text[: match.start(2)].count("\n") + 1):
            if line not in lines:
                yield f"{page.relative_to(root)}:{number}: is not a line of {match.group(1)}: copy the listing again"
    names = {pathlib.PurePosixPath(file).name for file in files}
    for match in SOURCE.finditer(prose):
        name = match.group(1)
        here = (page.parent / name).resolve()
        if name not in files and not here.exists() and ("/" in name or name not in names):
            yield f"{where(match)}: names {name}, which is not a file of the repository: correct the name"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent)
    root = parser.parse_args().root.resolve()
    files = files_of(root)
    pages = sorted([*root.glob("*.md"), *(root / "docs").rglob("*.md")])
    findings = [finding for page in pages for finding in findings_of(page, root, files)]
    for finding in findings:
        print(finding, file=sys.stderr)
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
