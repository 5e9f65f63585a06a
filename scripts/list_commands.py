#!/usr/bin/env python3
"""Lists every command line of README.md, CONTRIBUTING.md and docs/, and which test runs it.

  scripts/list_commands.py [PAGE...]

- A command is a line of a block ```sh, or inline code that begins with a command and has arguments. It is run by the test
  of tests/**/CMakeLists.txt that gives its page to check_commands.py, or by what tests/pages/stages.py names.
- Inline code without arguments is the name of a command: a test has to run some command of this name.
- A command that is indented, or that is in a block of another kind, is not run by anything and is an error.
Ends with 1 and a line for each command that no test runs.
"""
import argparse
import pathlib
import re
import sys

from page_commands import ROOT, commands_of_page, hidden_commands, pages

sys.path.insert(0, str(ROOT / "tests" / "pages"))
from stages import ELSEWHERE, STAGES  # noqa: E402


def tests_of_pages():
    """Which test runs the commands of a page, as tests/**/CMakeLists.txt say."""
    found = {}
    for file in (ROOT / "tests").rglob("CMakeLists.txt"):
        text = file.read_text()
        for name, words in re.findall(r"add_test\(NAME (\w+) COMMAND \$\{check_commands\}([^()]*)\)", text):
            for page in re.findall(r"\$\{(?:docs|PROJECT_SOURCE_DIR)\}/([\w./-]+\.md)", words):
                found[page if (ROOT / page).exists() else f"docs/{page}"] = name
    return found


def elsewhere(command):
    """Who runs a command by other means; a name, and what is wrong with the entry, if anything is."""
    for pattern, test, file, evidence in ELSEWHERE:
        if match := re.fullmatch(pattern, command):
            if match.expand(evidence) in (ROOT / file).read_text():
                return test, None
            return test, (f"tests/pages/stages.py says that {file} contains '{match.expand(evidence)}': "
                          "correct the entry")
    return None, None


class Listing:
    def __init__(self):
        self.tests = tests_of_pages()
        self.rows, self.findings, self.names = [], [], []
        self.run = {}  # command: the test that runs it

    def add_page(self, page):
        name = page.resolve().relative_to(ROOT).as_posix() if page.resolve().is_relative_to(ROOT) else page.name
        text = page.read_text()
        for line, command in hidden_commands(text):
            self.findings.append(f"{name}:{line}: '{command}' is a command in no block ```sh: make it one")
        for command in commands_of_page(text):
            where = f"{name}:{command.line}"
            test, problem = elsewhere(command.text)
            if problem:
                self.findings.append(f"{where}: {problem}")
            if test:
                self.rows.append((where, command.text, test))
            elif command.is_name():
                self.names.append((where, command.text))
            elif name in self.tests:
                self.rows.append((where, command.text, self.tests[name]))
                # Also as a reader sees it who has not put the program into his path.
                self.run[re.sub(r"^\$upright\b", "upright", command.text)] = self.tests[name]
            else:
                self.findings.append(f"{where}: no test runs '{command.text}': give its page to a test with "
                                     "scripts/check_commands.py, or name in tests/pages/stages.py who runs it")

    def judge_names(self):
        """Names are judged when all commands are known."""
        for where, name in self.names:
            within = re.compile(rf"(?:^|[\s|&;]){re.escape(name)}(?![\w-])")
            test = next((test for command, test in self.run.items() if within.search(command)), None)
            if test:
                self.rows.append((where, name, test))
            else:
                self.findings.append(f"{where}: no test runs a command '{name}': let a page show one, or name in "
                                     "tests/pages/stages.py who runs it")

    def judge_entries(self):
        """Entries of stages.py that nothing needs any more."""
        shown = {command for _, command, _ in self.rows}
        for entry in ELSEWHERE:
            if not any(re.fullmatch(entry[0], command) for command in shown):
                self.findings.append(f"tests/pages/stages.py: no page shows '{entry[0]}': remove it from ELSEWHERE")
        for page in STAGES:
            if page not in self.tests:
                self.findings.append(f"tests/pages/stages.py: no test runs the commands of {page}: remove its stage")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pages", type=pathlib.Path, nargs="*", metavar="PAGE", help="these instead of all")
    chosen = parser.parse_args().pages
    listing = Listing()
    for page in chosen or pages():
        listing.add_page(page)
    listing.judge_names()
    if not chosen:
        listing.judge_entries()
    for where, command, test in listing.rows:
        print(f"{where}\t{command}\t{test}")
    for finding in listing.findings:
        print(finding, file=sys.stderr)
    sys.exit(1 if listing.findings else 0)


if __name__ == "__main__":
    main()
