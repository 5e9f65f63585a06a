#!/usr/bin/env python3
"""Checks that each folder includes only what its CMake target may use, and that docs/architecture.md agrees.

  scripts/check_includes.py [--root FOLDER] [--write]

The targets are read from the CMakeLists.txt of their folders: `upright_library(NAME SOURCES ... OFFERS ... LINK ...)`.
A file may include
  - any header of its own folder,
  - of a target that its own links, directly or through others: a header in include/upright/FOLDER, or one that the
    target lists under OFFERS.
Tests may include every header. Two targets may not use each other. `--write` writes the table of folders into
docs/architecture.md instead of comparing it. The exit code is 1, with a line for each finding.
"""
import argparse
import pathlib
import re
import sys
from dataclasses import dataclass, field

API = pathlib.PurePosixPath("include/upright")
TABLE_BEGIN = "<!-- written by scripts/check_includes.py --write -->"
TABLE_END = "<!-- end -->"
ROOTS = ("src", "sim", "hal", "studies")
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)


@dataclass
class Target:
    name: str
    folder: str  # "src/model"
    holds: str  # the sentence at the top of its CMakeLists.txt
    links: list = field(default_factory=list)
    offers: set = field(default_factory=set)

    @property
    def short(self):  # "model": as includes name it
        return self.folder.removeprefix("src/")


def words_after(keyword, text):
    """The words of a CMake call between `keyword` and the next keyword in capitals."""
    match = re.search(rf"\b{keyword}\b(.*?)(?=\b(?:SOURCES|OFFERS|LINK|PRIVATE|PUBLIC)\b|$)", text, re.DOTALL)
    return match.group(1).split() if match else []


def read_target(root, file):
    text = file.read_text()
    folder = file.parent.relative_to(root).as_posix()
    holds = re.match(r"# Holds: ((?:.*\n)(?:#   .*\n)*)", text)
    holds = " ".join(re.sub(r"^#\s*", "", line) for line in holds.group(1).splitlines()) if holds else ""
    code = re.sub(r"#.*", "", text)
    library = re.search(r"upright_library\((\w+)(.*?)\)", code, re.DOTALL)
    if library:
        body = library.group(2)
        return Target(library.group(1), folder, holds, words_after("LINK", body) + words_after("PRIVATE", body),
                      set(words_after("OFFERS", body)))
    program = re.search(r"add_executable\((\w+)", code)
    if not program:
        return None
    links = re.search(rf"target_link_libraries\({program.group(1)}\s+PRIVATE(.*?)\)", code, re.DOTALL)
    return Target(program.group(1), folder, holds, links.group(1).split() if links else [])


def read_targets(root):
    files = sorted(file for top in ROOTS for file in (root / top).rglob("CMakeLists.txt"))
    return [target for target in (read_target(root, file) for file in files) if target]


def used_by(target, by_name):
    """All targets that this one links, directly or through others."""
    found, open_ = {}, list(target.links)
    while open_:
        name = open_.pop()
        if name in by_name and name not in found:
            found[name] = by_name[name]
            open_ += by_name[name].links
    return found


def cycles(targets):
    by_name = {target.name: target for target in targets}
    return [f"{target.folder}/CMakeLists.txt: {target.name} links itself through others: cut the cycle"
            for target in targets if target.name in used_by(target, by_name)]


def owner_of(path, targets):
    """The target whose folder, or whose part of include/upright, contains a path."""
    def holds(target):
        api = (API / target.short).as_posix()
        return any(path.startswith(folder + "/") for folder in (target.folder, api))
    return max((target for target in targets if holds(target)), key=lambda target: len(target.folder), default=None)


def resolve(root, file, include):
    for candidate in (file.parent / include, root / "include" / include, root / "src" / include, root / include):
        if candidate.exists():
            return candidate.resolve().relative_to(root).as_posix()
    return None  # of another library, or written by the build


def wrong_includes(root, targets):
    by_name = {target.name: target for target in targets}
    findings = []
    for top in ("include", *ROOTS):
        for file in sorted((root / top).rglob("*.?pp")):
            path = file.relative_to(root).as_posix()
            owner = owner_of(path, targets)
            if not owner:
                findings.append(f"{path}: is in no target's folder: move it to one")
                continue
            may_use = used_by(owner, by_name)
            for match in INCLUDE.finditer(file.read_text()):
                header = resolve(root, file, match.group(1))
                other = owner_of(header, targets) if header else None
                line = file.read_text()[: match.start(1)].count("\n") + 1
                where = f"{path}:{line}: includes {match.group(1)}"
                is_api = bool(header) and header.startswith(API.as_posix() + "/")
                if path.startswith(API.as_posix() + "/") and header and not is_api:
                    findings.append(f"{where}, which is not part of the supported API: move it to {API}, or this out of it")
                if not other or other is owner:
                    continue
                if other.name not in may_use:
                    findings.append(f"{where} of {other.name}, which {owner.name} does not link: link it, or move what is shared")
                elif not is_api and header.removeprefix(other.folder + "/") not in other.offers:
                    findings.append(f"{where}, which {other.name} does not offer: list it under OFFERS in "
                                    f"{other.folder}/CMakeLists.txt, or remove the include")
    return findings


def unused_offers(root, targets):
    """Headers that are offered but not included elsewhere, or that do not exist."""
    taken = set()
    for top in ("include", *ROOTS, "tests"):
        for file in (root / top).rglob("*.?pp"):
            path = file.relative_to(root).as_posix()
            for include in INCLUDE.findall(file.read_text()):
                header = resolve(root, file, include)
                if header and owner_of(header, targets) is not owner_of(path, targets):
                    taken.add(header)
    return [f"{target.folder}/CMakeLists.txt: offers {header}, which no other folder includes: remove it from OFFERS"
            for target in targets for header in sorted(target.offers) if f"{target.folder}/{header}" not in taken]


def in_order(targets):
    """Lower targets come first."""
    by_name = {target.name: target for target in targets}
    return sorted(targets, key=lambda target: (len(used_by(target, by_name)), target.folder))


def table_of(targets):
    by_name = {target.name: target for target in targets}
    lines = [TABLE_BEGIN, "| folder | holds | uses | other libraries |", "|---|---|---|---|"]
    for target in in_order(targets):
        below = [by_name[name].short for name in target.links if name in by_name]
        foreign = [name.removeprefix("PkgConfig::").split("::")[0].replace("${CMAKE_DL_LIBS}", "dl") for name in target.links
                   if name not in by_name and name != "upright_options"]
        lines.append(f"| `{target.folder}` | {target.holds} | {', '.join(below) or '-'} | {', '.join(dict.fromkeys(foreign)) or '-'} |")
    return "\n".join(lines + [TABLE_END])


def check_table(root, targets, write):
    page = root / "docs" / "architecture.md"
    text = page.read_text()
    begin, end = text.find(TABLE_BEGIN), text.find(TABLE_END)
    if begin < 0 or end < 0:
        return [f"docs/architecture.md: has no table between '{TABLE_BEGIN}' and '{TABLE_END}': insert the two lines"]
    table = table_of(targets)
    if text[begin:end + len(TABLE_END)] == table:
        return []
    if not write:
        return ["docs/architecture.md: the table of folders differs from the targets: run scripts/check_includes.py --write"]
    page.write_text(text[:begin] + table + text[end + len(TABLE_END):])
    return []


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent)
    parser.add_argument("--write", action="store_true", help="write the table of docs/architecture.md")
    arguments = parser.parse_args()
    root = arguments.root.resolve()
    targets = read_targets(root)
    findings = cycles(targets) or wrong_includes(root, targets) + unused_offers(root, targets)
    findings += [f"{target.folder}/CMakeLists.txt: the first line does not say what the folder holds: begin it with '# Holds: ...'"
                 for target in targets if not target.holds]
    findings += check_table(root, targets, arguments.write)
    for finding in findings:
        print(finding, file=sys.stderr)
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
