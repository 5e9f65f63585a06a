#!/usr/bin/env python3
"""Runs the commands of documentation pages and compares their output with the pages.

  scripts/check_commands.py --upright PROGRAM PAGE... [--write] [--stalls PROGRAM --retry-log FILE]

- Each block ```sh runs in bash, in the order of the page, in a temporary folder like a clone in which the program is built.
  Each command must exit with 0, unless the next one prints $?. So must inline code that is a command with arguments.
- The block ```text that follows a block is its standard output. Standard error is not compared.
- The block ```csv or ```yaml after <!-- file NAME --> is written to that file first.
- tests/pages/stages.py says, for a page, which virtual rig is there, which names, devices and durations are replaced, and
  which commands are left out. scripts/list_commands.py lists which test runs each command.
Differences are allowed in UTC stamps in names of runs, in how much faster than real time a run was, and in numbers by
1 % or one unit of their last digit after the point, since fits differ slightly between processors. `--write` writes the
real output into the pages. The exit code is 1, with the difference, if a page and the program disagree. A failed block in
real time is repeated, at most twice, if --stalls (tests/support/stall_answers.cpp) saw a stall of the machine during the
block. A line in the retry log counts it.
"""
import argparse
import difflib
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from page_commands import PART, ROOT, commands_of, Command, plain

sys.path.insert(0, str(ROOT / "tests" / "pages"))
from stages import ELSEWHERE, STAGES, Stage  # noqa: E402

NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:e[-+]?\d+)?")
LARGEST_DIFFERENCE = 0.01  # of numbers, relative: fits agree to about 1e-3 between processors
TIME_LIMIT_S = 200  # of one block, on a busy machine: the slowest, a diagnosis, takes some 10 s of processor time
MAX_RETRIES = 2
STOPPED = (3, 4)  # exit codes of what no human, card or real-time kernel is there for


def masked(text):
    """The text without the parts that differ in every run."""
    text = re.sub(r"\b\d{8}T\d{6}Z", "<UTC>", text)
    return re.sub(r"(Virtual time: )\S+( times)", r"\1<N>\2", text)


def tolerance_of(number):
    """Allows one unit of the last digit after a point for rounding. Whole numbers are counts."""
    last_digit = 1.001 * 10.0 ** -len(number.partition(".")[2]) if "." in number and "e" not in number else 0.0
    return max(LARGEST_DIFFERENCE * abs(float(number)), last_digit)


def same(shown, printed):
    """Whether two outputs agree: the same words, and nearly the same numbers."""
    shown, printed = masked(shown), masked(printed)
    if re.sub(r"\s+", " ", NUMBER.sub("#", shown)) != re.sub(r"\s+", " ", NUMBER.sub("#", printed)):
        return False
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(printed))
    return all(abs(float(a) - float(b)) <= tolerance_of(a) for a, b in pairs)


def left_out(command):
    """Whether something else runs it."""
    return any(re.fullmatch(entry[0], command) for entry in ELSEWHERE)


class Stalls:
    """What the machine did meanwhile, as tests/support/stall_answers.cpp saw it."""

    def __init__(self, program, log):
        self.log = log
        self.watcher = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) if program else None

    def excuse(self, where, begin_s, end_s):
        if self.watcher is None:
            return False
        self.watcher.stdin.write(f"{begin_s} {end_s}\n")
        self.watcher.stdin.flush()
        stall = self.watcher.stdout.readline().split()
        if len(stall) != 2:
            return False
        with open(self.log, "a") as log:
            log.write(f"retry\t{where}\ta block stopped\t{stall[0]}\t{stall[1]}\n")
        return True

    def end(self):
        if self.watcher is not None:
            self.watcher.stdin.close()
            self.watcher.wait()


class Scene:
    """The scratch folder of a page, and what stands in for a rig."""

    def __init__(self, scratch, stage, program):
        self.stage = stage
        self.bench = pathlib.Path(scratch) / "bench"
        self.folder = pathlib.Path(scratch) / "clone"
        self.bench.mkdir()
        shutil.copytree(ROOT / "config", self.folder / "config")
        shutil.copytree(ROOT / "firmware", self.folder / "firmware", ignore=shutil.ignore_patterns("build"))
        shutil.copytree(ROOT / "scripts", self.folder / "scripts")
        built = self.folder / "build" / "release" / "src" / "cli"
        built.mkdir(parents=True)
        (built / "upright").symlink_to(program)
        for script in ("install-deps.sh", "build.sh"):  # all is installed and built here
            (self.folder / "scripts" / script).write_text("#!/bin/sh\n")
        self.environment = dict(
            os.environ, PATH=f"{ROOT / 'tests' / 'pages' / 'bin'}:{built}:{os.environ['PATH']}", LC_ALL="C",
            bench=str(self.bench), source=str(ROOT))

    def run(self, command):
        text = f"source '{ROOT / 'tests' / 'pages' / 'bench.sh'}'\n{command}"
        words = ["bash", "-u", "-c", text]
        with subprocess.Popen(words, cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True) as shell:
            try:
                output, errors = shell.communicate(timeout=TIME_LIMIT_S)
            except subprocess.TimeoutExpired:
                os.killpg(shell.pid, signal.SIGKILL)  # what it started too
                output, errors = shell.communicate()
                errors += f"\nnot done after {TIME_LIMIT_S} s"
            return subprocess.CompletedProcess(words, shell.returncode, output, errors)

    def staged(self, block):
        """The block as it is run here: what is run elsewhere is left out, and names are replaced."""
        commands = [text for _, text in commands_of(block) if not left_out(plain(text))]
        kept = []
        for text, after in zip(commands, commands[1:] + [""]):
            staged = text
            for shown, run in self.stage.replaced:
                staged = re.sub(shown, run, staged, flags=re.MULTILINE)
            kept.append(staged)
            if any(re.fullmatch(pattern, plain(text)) for pattern in self.stage.stopped):
                kept.append("case $? in 0 | %s) ;; *) exit 1 ;; esac" % " | ".join(map(str, STOPPED)))
            elif "$?" not in after:
                kept.append('ended=$?; [ "$ended" -eq 0 ] || exit "$ended"')
        return "\n".join(kept)


def check(page, program, stalls):
    """The corrected page, and the findings."""
    text = page.read_text()
    findings = []
    name = page.resolve().relative_to(ROOT).as_posix() if page.resolve().is_relative_to(ROOT) else page.name
    stage = STAGES.get(name, Stage())

    def perform(block, line):
        command = scene.staged(block)
        for attempt in range(MAX_RETRIES + 1):
            begin_s = time.monotonic()
            done = scene.run(command)
            late = stage.real_time and done.returncode != 0 and attempt < MAX_RETRIES
            if not late or not stalls.excuse(f"{name}:{line}", begin_s, time.monotonic()):
                break
        if done.returncode != 0:
            findings.append(f"{page}:{line}: the command ended with exit code {done.returncode}: {done.stderr.strip()}\n{done.stdout.strip()}\n"
                            f"run was:\n{command}")
        return done

    def replaced(match):
        line = text[: match.start()].count("\n") + 1
        if match["file"]:
            (scene.folder / match["file"]).write_text(match["content"])
        elif match["inline"]:
            command = Command(line, plain(match["inline"]), True)
            if not command.is_name() and not left_out(command.text):
                perform(command.text, line)
        elif match["block"] is not None:
            done = perform(match["block"], line)
            if match["output"] is None or same(match["output"], done.stdout):
                return match[0]
            difference = difflib.unified_diff(match["output"].splitlines(), done.stdout.splitlines(), "page", "program", lineterm="")
            findings.append(f"{page}:{line}: the output differs from the page (--write updates the page):\n"
                            + "\n".join(difference))
            return match[0][: match.start("output") - match.start()] + done.stdout + "```\n"
        return match[0]

    with tempfile.TemporaryDirectory() as scratch:
        scene = Scene(scratch, stage, program)
        try:
            if stage.setup:
                done = scene.run(f"set -e; {stage.setup}")
                if done.returncode != 0:
                    return text, [f"{page}: its stage does not begin: {done.stderr.strip()}"]
            return PART.sub(replaced, text), findings
        finally:
            scene.run("end_servers")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--upright", type=pathlib.Path, required=True, help="the program")
    parser.add_argument("--write", action="store_true", help="write the real output into the pages")
    parser.add_argument("--stalls", type=pathlib.Path, help="the program that watches for stalls of the machine")
    parser.add_argument("--retry-log", type=pathlib.Path, help="where a block that is run again is counted")
    parser.add_argument("pages", type=pathlib.Path, nargs="+", metavar="PAGE")
    arguments = parser.parse_args()
    findings = []
    stalls = Stalls(arguments.stalls, arguments.retry_log)
    for page in arguments.pages:
        written, found = check(page, arguments.upright.resolve(), stalls)
        findings += found
        if arguments.write:
            page.write_text(written)
    stalls.end()
    for finding in findings:
        print(finding, file=sys.stderr)
    sys.exit(1 if findings and not arguments.write else 0)


if __name__ == "__main__":
    main()
