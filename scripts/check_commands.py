#!/usr/bin/env python3
"""Runs the commands of pages and compares what they print with the page: the tutorial, and guides whose commands need no rig.

  scripts/check_commands.py --upright PROGRAM PAGE... [--write]

- Each block ```sh runs in bash, in the order of the page, in a scratch folder that holds a copy of config/. It must end with 0.
- The block ```text that follows it is its standard output. Standard error is not compared.
- The block ```csv or ```yaml after <!-- file NAME --> is written to that file first.
- Other blocks (```console: cloning and building, and what needs a rig) are not run.
Three things may differ: UTC stamps in names of runs, how much faster than real time a run was, and numbers by 1 % or one
unit of their last digit after the point, since fits differ in their last digits between processors. `--write` puts the real output into the page.
Ends with 1 and the difference when the page and the program disagree.
"""
import argparse
import difflib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
BLOCK = re.compile(
    r"^<!-- file (?P<file>[\w./-]+) -->\n+^```\w+\n(?P<content>.*?)^```\n"
    r"|^```sh\n(?P<command>.*?)^```\n(?:\n^```text\n(?P<output>.*?)^```\n)?", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:e[-+]?\d+)?")
LARGEST_DIFFERENCE = 0.01  # of numbers, relative: fits agree to about 1e-3 between processors
TIME_LIMIT_S = 200  # of one block, on a busy machine: the slowest, a diagnosis, takes some 10 s of processor time


def masked(text):
    """The text without what is different in every run."""
    text = re.sub(r"\b\d{8}T\d{6}Z", "<UTC>", text)
    return re.sub(r"(Virtual time: )\S+( times)", r"\1<N>\2", text)


def tolerance_of(number):
    """Also one unit of the last digit after a point, by which rounding may differ. Whole numbers are counts."""
    last_digit = 1.001 * 10.0 ** -len(number.partition(".")[2]) if "." in number and "e" not in number else 0.0
    return max(LARGEST_DIFFERENCE * abs(float(number)), last_digit)


def same(shown, printed):
    """Whether two outputs agree: the same words, and numbers that differ by little."""
    shown, printed = masked(shown), masked(printed)
    if re.sub(r"\s+", " ", NUMBER.sub("#", shown)) != re.sub(r"\s+", " ", NUMBER.sub("#", printed)):
        return False
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(printed))
    return all(abs(float(a) - float(b)) <= tolerance_of(a) for a, b in pairs)


def run(command, folder, program):
    environment = dict(os.environ, PATH=f"{program.parent}:{os.environ['PATH']}", LC_ALL="C")
    return subprocess.run(["bash", "-u", "-c", command], cwd=folder, env=environment, capture_output=True,
                          text=True, timeout=TIME_LIMIT_S)


def check(page, program):
    """The page as it should be, and what is wrong with it."""
    text = page.read_text()
    findings = []

    def replaced(match):
        if match["file"]:
            (folder / match["file"]).write_text(match["content"])
            return match[0]
        line = text[: match.start()].count("\n") + 1
        done = run(match["command"], folder, program)
        if done.returncode != 0:
            findings.append(f"{page}:{line}: ends with {done.returncode}: {done.stderr.strip()}")
        if match["output"] is None or same(match["output"], done.stdout):
            return match[0]
        difference = difflib.unified_diff(match["output"].splitlines(), done.stdout.splitlines(), "page", "program", lineterm="")
        findings.append(f"{page}:{line}: prints something else (--write puts it into the page):\n" + "\n".join(difference))
        return match[0][: match.start("output") - match.start()] + done.stdout + "```\n"

    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        shutil.copytree(ROOT / "config", folder / "config")
        return BLOCK.sub(replaced, text), findings


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--upright", type=pathlib.Path, required=True, help="the program")
    parser.add_argument("--write", action="store_true", help="put the real output into the pages")
    parser.add_argument("pages", type=pathlib.Path, nargs="+", metavar="PAGE")
    arguments = parser.parse_args()
    findings = []
    for page in arguments.pages:
        written, found = check(page, arguments.upright.resolve())
        findings += found
        if arguments.write:
            page.write_text(written)
    for finding in findings:
        print(finding, file=sys.stderr)
    sys.exit(1 if findings and not arguments.write else 0)


if __name__ == "__main__":
    main()
