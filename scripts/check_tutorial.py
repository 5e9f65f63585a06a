#!/usr/bin/env python3
"""Runs the commands of docs/tutorial/first-hour.md and compares what they print with the page.

  scripts/check_tutorial.py --upright PROGRAM [--page PAGE] [--write]

- Each block ```sh runs in bash, in the order of the page, in one scratch folder that holds a copy of config/. It must end with 0.
- The block ```text that follows it is its standard output. Standard error is not compared.
- Other blocks (```console: cloning and building) are not run.
Three things may differ: UTC stamps in names of runs, how much faster than real time a run was, and numbers by 1 %, since
fits differ in their last digits between processors. `--write` puts the real output into the page.
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
BLOCK = re.compile(r"^```sh\n(?P<command>.*?)^```\n(?:\n^```text\n(?P<output>.*?)^```\n)?", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:e[-+]?\d+)?")
LARGEST_DIFFERENCE = 0.01  # of numbers, relative: fits agree to about 1e-3 between processors
TIME_LIMIT_S = 80  # of one block: the slowest, the diagnosis, takes some 10 s of processor time


def masked(text):
    """The text without what is different in every run."""
    text = re.sub(r"\b\d{8}T\d{6}Z", "<UTC>", text)
    return re.sub(r"(Virtual time: )\S+( times)", r"\1<N>\2", text)


def same(shown, printed):
    """Whether two outputs agree: the same words, and numbers that differ by little."""
    shown, printed = masked(shown), masked(printed)
    if re.sub(r"\s+", " ", NUMBER.sub("#", shown)) != re.sub(r"\s+", " ", NUMBER.sub("#", printed)):
        return False
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(printed))
    return all(abs(float(a) - float(b)) <= LARGEST_DIFFERENCE * abs(float(a)) for a, b in pairs)


def run(command, folder, program):
    environment = dict(os.environ, PATH=f"{program.parent}:{os.environ['PATH']}", LC_ALL="C")
    return subprocess.run(["bash", "-uo", "pipefail", "-c", command], cwd=folder, env=environment, capture_output=True,
                          text=True, timeout=TIME_LIMIT_S)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--upright", type=pathlib.Path, required=True, help="the program")
    parser.add_argument("--page", type=pathlib.Path, default=ROOT / "docs" / "tutorial" / "first-hour.md")
    parser.add_argument("--write", action="store_true", help="put the real output into the page")
    arguments = parser.parse_args()
    program = arguments.upright.resolve()
    text = arguments.page.read_text()
    findings = []

    def replaced(match):
        line = text[: match.start()].count("\n") + 1
        done = run(match["command"], folder, program)
        if done.returncode != 0:
            findings.append(f"{arguments.page}:{line}: ends with {done.returncode}: {done.stderr.strip()}")
        if match["output"] is None or same(match["output"], done.stdout):
            return match[0]
        difference = difflib.unified_diff(match["output"].splitlines(), done.stdout.splitlines(), "page", "program", lineterm="")
        findings.append(f"{arguments.page}:{line}: prints something else (--write puts it into the page):\n" + "\n".join(difference))
        return match[0][: match.start("output") - match.start()] + done.stdout + "```\n"

    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        shutil.copytree(ROOT / "config", folder / "config")
        written = BLOCK.sub(replaced, text)
    if arguments.write:
        arguments.page.write_text(written)
    for finding in findings:
        print(finding, file=sys.stderr)
    sys.exit(1 if findings and not arguments.write else 0)


if __name__ == "__main__":
    main()
