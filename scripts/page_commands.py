"""The command lines of pages: what is in blocks ```sh, and inline code that begins with a command.

Used by scripts/check_commands.py, which runs them, and by scripts/list_commands.py, which says who runs which.
"""
import dataclasses
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Inline code that begins with one of these is a command, or the name of one. The name of a program alone is neither.
STARTS = r"(?:(?:upright|ctest|cmake|make|sudo|mpirun|ssh|pip|pre-commit)(?=[ \n])|scripts/|\.ci/)"
PART = re.compile(
    r"^<!-- file (?P<file>[\w./-]+) -->\n+^```\w+\n(?P<content>.*?)^```\n"
    r"|^```sh\n(?P<block>.*?)^```\n(?:\n^```text\n(?P<output>.*?)^```\n)?"
    r"|^```(?P<kind>\w*)\n(?P<other>.*?)^```\n"
    rf"|(?<!`)`(?P<inline>{STARTS}[^`]*)`", re.MULTILINE | re.DOTALL)
# A command in a block that is indented, or in a block of another kind, is not run: such a block has to be ```sh.
HIDDEN = re.compile(rf"^ {{4,}}{STARTS} *\S.*$", re.MULTILINE)
HIDDEN_IN_BLOCK = re.compile(rf"^{STARTS}.*$", re.MULTILINE)
NAME = re.compile(r"upright [a-z]+(?:-[a-z]+)*|scripts/[\w.-]+|\.ci/run")


@dataclasses.dataclass
class Command:
    line: int
    text: str  # without comment, in one line
    inline: bool = False

    def is_name(self):
        """Inline code that names a command and gives no argument."""
        return self.inline and NAME.fullmatch(self.text) is not None


def plain(text):
    """A command as it is compared: without comment, and with single spaces."""
    text = re.sub(r"\\\n", " ", text)
    text = re.sub(r"(?:^|\s)#\s.*$", "", text, flags=re.MULTILINE)
    return " ".join(text.split())


def is_complete(text):
    return not text.endswith("\\") and subprocess.run(["bash", "-n", "-c", text], capture_output=True).returncode == 0


def commands_of(block):
    """The commands of a block: the number of the first line of each, from 0, and its text as it stands."""
    lines = block.splitlines()
    begin = 0
    while begin < len(lines):
        end = begin + 1
        while end < len(lines) and not is_complete("\n".join(lines[begin:end])):
            end += 1
        text = "\n".join(lines[begin:end])
        if plain(text):
            yield begin, text
        begin = end


def commands_of_page(text):
    for match in PART.finditer(text):
        line = text[: match.start()].count("\n") + 1
        if match["block"] is not None:
            for begin, command in commands_of(match["block"]):
                yield Command(line + 1 + begin, plain(command))
        elif match["inline"] is not None:
            yield Command(line, plain(match["inline"]), True)


def hidden_commands(text):
    """Lines that are commands to a reader and are in no block ```sh: their numbers and texts."""
    outside = PART.sub(lambda match: "\n" * match[0].count("\n"), text)
    for match in HIDDEN.finditer(outside):
        yield outside[: match.start()].count("\n") + 1, match[0].strip()
    for block in PART.finditer(text):
        if block["kind"] in ("", "console", "bash", "shell"):
            for match in HIDDEN_IN_BLOCK.finditer(block["other"] or ""):
                yield text[: block.start("other") + match.start()].count("\n") + 1, match[0].strip()


def pages():
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
