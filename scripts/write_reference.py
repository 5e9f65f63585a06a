#!/usr/bin/env python3
"""Compares the generated parts of docs/reference with the program, or writes them.

  scripts/write_reference.py --upright PROGRAM [--write]

- docs/reference/effects.md: every effect of the registry, from `upright effects --json`.
- docs/reference/commands.md: the options of every command, from its `--help`.
- docs/reference/diagnosis-rules.md: every limit of SelectionPolicy with its comment, from src/diagnosis/selection_policy.hpp.
- docs/reference/library.md: every header of include/upright with the first sentence of its comment.
The parts are between two marker lines. The exit code is 1, with a line for each page that differs.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys

BEGIN = "<!-- written by scripts/write_reference.py --write -->"
END = "<!-- end -->"


def said_by(program, *words):
    return subprocess.run([program, *words], capture_output=True, text=True, check=True).stdout


def range_of(parameter):
    low, high = parameter["minimum"], parameter["maximum"]
    least = "" if low is None else f"{'above' if parameter['minimum_excluded'] else 'at least'} {low:g}"
    most = "" if high is None else f"at most {high:g}"
    return ", ".join(part for part in (least, most) if part) or "any"


def cell(text):
    return text.replace("|", "\\|")


def effects_of(program):
    lines = []
    for effect in json.loads(said_by(program, "effects", "--json"))["effects"]:
        dry = ", dry friction" if effect["dry"] else ""
        lines += ["", f"### {effect['kind']}", "", f"{effect['meaning'][0].upper()}{effect['meaning'][1:]}. Enters: {effect['enters']}{dry}.", "",
                  f"    {effect['equation']}", "", "| parameter | unit | range | no effect at | meaning |", "|---|---|---|---|---|"]
        for p in effect["parameters"]:
            neutral = "-" if p["neutral"] is None else f"{p['neutral']:g}"
            lines.append(f"| `{p['name']}` | {p['unit']} | {range_of(p)} | {neutral} | {cell(p['meaning'])} |")
    return lines


def commands_of(program):
    listed = said_by(program, "--help").split("Subcommands:\n")[1].split("\n\n")[0]
    lines = []
    for name in re.findall(r"^  (\S+)", listed, re.MULTILINE):
        lines += ["", f"### {name}", "", "```text", *(line.rstrip() for line in said_by(program, name, "--help").rstrip("\n").split("\n")), "```"]
    return lines


def value_of(expression):
    """A number or a list of names of C++ as readers write it; of a ratio, as it stands."""
    if expression.startswith("{"):
        return ", ".join(f"`{name}`" for name in re.findall(r'"(.*?)"', expression))
    return f"{float(expression):g}" if re.fullmatch(r"[\d.e+-]+", expression) else re.sub(r"(\d)\.0\b", r"\1", expression)


def limits_of(header):
    """A table for each part of SelectionPolicy. Every member needs a comment of its own that begins with its unit."""
    text = header.read_text()
    parts = dict(re.findall(r"^struct (\w+) \{\n(.*?)^\};", text, re.MULTILINE | re.DOTALL))
    comments = dict((name, comment) for comment, name in re.findall(r"((?:^/// .*\n)+)^struct (\w+)", text, re.MULTILINE))
    member_line = r"^  (?:double|int|std::size_t|std::array<std::string_view, \d+>) (\w+) =\s+([^;]*);"
    lines = []
    for part, name in re.findall(r"^  (\w+) (\w+);$", parts["SelectionPolicy"], re.MULTILINE):
        lines += ["", f"### {name.capitalize()}", "", plain(comments[part]), "", "| limit | value | unit | meaning |", "|---|---|---|---|"]
        members = re.findall(member_line, parts[part], re.MULTILINE)
        commented = re.findall(rf"((?:^  /// .*\n)+){member_line}", parts[part], re.MULTILINE)
        if [member for member, _ in members] != [member for _, member, _ in commented]:
            sys.exit(f"{header}: a member of {part} has no comment of its own")
        for comment, member, value in commented:
            unit, meaning = re.fullmatch(r"\[(.*?)\] (.*)", plain(comment)).groups()
            lines.append(f"| `{member}` | {value_of(value)} | {'-' if unit == '1' else unit} | {cell(meaning)} |")
    return lines


# The libraries that users link, and the folders of include/upright that each adds to those before.
LIBRARIES = (("model", ("base", "model")), ("sim", ("sim",)), ("control", ("control",)), ("hal", ("hal",)),
             ("runtime", ("record", "runtime")), ("diagnosis", ("measurement", "estimation", "diagnosis")))


def first_sentence(header):
    comment = []
    for line in header.read_text().splitlines():
        if not line.startswith("// "):
            break
        comment.append(line.removeprefix("// "))
    return re.split(r"\. |\.$", " ".join(comment))[0]


def headers_of(include):
    lines, listed = [], set()
    for library, folders in LIBRARIES:
        lines += ["", f"### upright::{library}", "", "| header | holds |", "|---|---|"]
        for header in (header for folder in folders for header in sorted((include / folder).glob("*.hpp"))):
            listed.add(header)
            lines.append(f"| `include/upright/{header.relative_to(include).as_posix()}` | {cell(first_sentence(header))} |")
    # One header for each effect, which registry.hpp includes.
    left = set(include.rglob("*.hpp")) - listed - set((include / "model" / "effects").glob("*.hpp"))
    if left:
        sys.exit(f"{sorted(left)[0]}: belongs to no library of docs/reference/library.md: add its folder to LIBRARIES")
    return lines


def plain(comment):
    return " ".join(line.strip().removeprefix("///").strip() for line in comment.strip().split("\n"))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--upright", type=pathlib.Path, required=True, help="the program")
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent)
    parser.add_argument("--write", action="store_true", help="write the pages")
    arguments = parser.parse_args()
    wrong = 0
    limits = limits_of(arguments.root / "src" / "diagnosis" / "selection_policy.hpp")
    for name, lines in (("effects", effects_of(arguments.upright)), ("commands", commands_of(arguments.upright)),
                        ("diagnosis-rules", limits), ("library", headers_of(arguments.root / "include" / "upright"))):
        page = arguments.root / "docs" / "reference" / f"{name}.md"
        text = page.read_text()
        begin, end = text.index(BEGIN), text.index(END)
        made = text[:begin] + "\n".join([BEGIN, *lines, ""]) + "\n" + text[end:]
        if made == text:
            continue
        if arguments.write:
            page.write_text(made)
            continue
        wrong += 1
        print(f"{page}: differs from the program: run scripts/write_reference.py --upright {arguments.upright} --write",
              file=sys.stderr)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
