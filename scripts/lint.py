"""Runs clang-tidy on the sources in the given folders: lint.py COMPILE_COMMANDS FOLDER...

Parsing headers takes nearly all of the time, so the sources of one library are checked as one translation unit.
Sources that do not compile together, because both define the same name, go into separate units.
"""
import collections
import concurrent.futures
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile

TOOLS = {"compiler": "clang++-14", "tidy": "clang-tidy-14"}
# Options of g++ that clang does not support.
FOREIGN = re.compile(r"--param|ggc-min-heapsize=.*|-fno-gnu-unique|-fno-sanitize-recover.*|-ffp-contract=.*|-mmemset-strategy=.*|-Wno-maybe-uninitialized|-W(all|extra|pedantic|shadow|error)")


def flags_of(command):
    """The flags of a compile command, less compiler, output and source."""
    words = shlex.split(command)[1:]
    flags, skip = [], False
    for word in words:
        if skip or word in ("-o", "-c", "-MD"):
            skip = not skip and word in ("-o", "-c")
            continue
        if not FOREIGN.fullmatch(word):
            flags.append(word)
    return tuple(flags)


def libraries(commands, folders):
    """Lists of sources that are compiled with the same flags."""
    groups = collections.defaultdict(list)
    for entry in commands:
        name = os.path.relpath(entry["file"])
        if name.split(os.sep)[0] in folders:
            groups[flags_of(entry["command"])].append(name)
    return groups


def text_of(sources):
    return "".join(f'#include "{os.path.abspath(source)}"\n' for source in sources)


def read_as_one(sources, flags, folder):
    """Splits sources into lists that compile together; also returns the errors of sources that do not compile alone."""
    lists, problems, left = [], "", sources
    while left:
        file = os.path.join(folder, f"{len(os.listdir(folder))}.cpp")
        together = left
        while True:
            with open(file, "w") as out:
                out.write(text_of(together))
            command = [TOOLS["compiler"], "-fsyntax-only", "-w", "-ferror-limit=0", *flags, file]
            said = subprocess.run(command, capture_output=True, text=True).stderr
            bad = [s for s in together if re.search(re.escape(os.path.abspath(s)) + r":\d+:\d+: (fatal )?error:", said)]
            if len(together) == 1 or not said:
                problems += said
                break
            # An error in a header names no source: then try half of the sources.
            kept = [s for s in together if s not in bad] if bad else together[:len(together) // 2]
            together = kept or together[:1]
        lists.append(file)
        left = [s for s in left if s not in together]
    return lists, problems


def tidy(file, flags):
    command = [TOOLS["tidy"], "--config-file=.clang-tidy", "-quiet", file, "--", "-Wno-unknown-warning-option", *flags]
    done = subprocess.run(command, capture_output=True, text=True)
    return "" if done.returncode == 0 else done.stdout + done.stderr


def main(database, folders):
    with open(database) as commands:
        groups = libraries(json.load(commands), folders)
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        def lint(number, flags, sources):
            own = os.path.join(folder, str(number))
            os.mkdir(own)
            files, problems = read_as_one(sources, flags, own)
            return [(file, flags) for file in files], problems

        read = list(pool.map(lambda group: lint(group[0], *group[1]), enumerate(groups.items())))
        problems = [said for _, said in read if said]
        texts = [text for files, _ in read for text in files]
        problems += [said for said in pool.map(lambda text: tidy(*text), texts) if said]
    sys.stderr.write("\n".join(problems))
    count = sum(len(sources) for sources in groups.values())
    print(f"{count} sources in {len(texts)} units: {'findings above' if problems else 'no findings'}")
    return 1 if problems or not count else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
