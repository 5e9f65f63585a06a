#!/usr/bin/env python3
"""Prints a SHA-256 for each output of upright, or compares the outputs of builds on one machine.

  output_manifest.py BUILD MATRIX WORK [--against BUILD] [--threads N,M] [--cases N] [--samples N] [--data DIR] [--only WORD]

BUILD is a build folder (build/ci). MATRIX is the build whose diagnosis_matrix makes the cases: use the same one for all
manifests. WORK is a folder for intermediate files, which may be reused. Values that always differ between calls (times of
day, durations, the commit, folders) are removed first.
--against BUILD  the build to compare with
--threads N,M    threads of each search (UPRIGHT_THREADS); of several numbers, each is compared
--cases N        number of cases of the matrix to diagnose (100)
--samples N      samples of each case, all runs together (12000)
--data DIR       also diagnose the measurements of other laboratories (../shared/data)
--only WORD      only outputs whose name begins with WORD: design, margin, sweep, run, identify, diagnose, data
One build with one number of threads prints "SHA256  NAME" lines. Several are compared with the first: how many outputs are
equal and different, and the names of those that differ (exit code 1). Their manifests are in WORK.
"""
import collections
import argparse
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
CONFIG = ROOT / "config"
BY_NATURE = [
    (re.compile(rb"\d{8}T\d{6}Z"), b"TIME"),
    (re.compile(rb"\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\dZ?( UTC)?"), b"TIME"),
    (re.compile(rb"\b[0-9a-f]{40}\b"), b"COMMIT"),
    (re.compile(rb"\b[0-9a-f]{7,12}\b(?=[^\n]{0,40}(changed|commit|dirty))"), b"COMMIT"),
    (re.compile(rb'("?git_dirty"?: ?)(true|false)'), rb"\1DIRTY"),
    (re.compile(rb'("(elapsed|cpu|search|wall)_s": ?)[0-9.e+-]+'), rb"\1SECONDS"),
]


class Manifest:
    def __init__(self, arguments, build, threads):
        self.program = build.resolve() / "src" / "cli" / "upright"
        self.matrix = arguments.matrix.resolve() / "tests" / "bench" / "diagnosis_matrix"
        self.work = arguments.work.resolve()
        self.only = arguments.only
        self.cases = arguments.cases
        self.samples = arguments.samples
        self.data = arguments.data
        self.environment = dict(os.environ)
        self.label = str(build)
        if threads:
            self.environment["UPRIGHT_THREADS"] = threads
            self.label += f", {threads} threads"
        self.sums = {}

    def wants(self, kind):
        return not self.only or kind.startswith(self.only)

    def add(self, name, data):
        data = data.replace(str(self.program).encode(), b"upright").replace(str(self.work).encode(), b"WORK")
        for pattern, instead in BY_NATURE:
            data = pattern.sub(instead, data)
        self.sums[name] = hashlib.sha256(data).hexdigest()

    def call(self, name, *words, keep_output=True):
        done = subprocess.run([self.program, *map(str, words)], capture_output=True, cwd=self.work, env=self.environment)
        if keep_output or done.returncode not in (0, 2, 3):
            self.add(f"{name}/stdout", done.stdout + b"exit code %d" % done.returncode)
        return done

    def fresh(self, name):
        folder = self.work / "out" / name
        shutil.rmtree(folder, ignore_errors=True)
        folder.parent.mkdir(parents=True, exist_ok=True)
        return folder

    def add_files(self, name, folder, *skip):
        for file in sorted(folder.rglob("*")):
            if file.is_file() and file.name not in skip:
                inside = re.sub(r"\d{8}T\d{6}Z-?", "", file.relative_to(folder).as_posix())
                self.add(f"{name}/{inside}", file.read_bytes())

    def designs(self):
        plants = sorted((CONFIG / "plants").glob("*.yaml"))
        for plant in plants:
            for options in ([], ["--delay", "0.05", "--rate", "1000"], ["--estimator", "kalman"], ["--estimator", "extended_kalman"]):
                name = "-".join(["design", plant.stem, *[word.strip("-") for word in options]])
                self.call(name, "design", plant, *options, "--json")
            for gains in sorted((CONFIG / "gains").glob("*.yaml")):
                self.call(f"margin-{plant.stem}-{gains.stem}", "margin", plant, gains, "--json")

    def sweeps(self):
        for sweep in sorted((CONFIG / "sweeps").glob("*.yaml")):
            folder = self.fresh(f"sweep-{sweep.stem}")
            self.call("sweep", "sweep", sweep, "--out", folder, "--overwrite", keep_output=False)
            self.call("report", "report", folder, keep_output=False)
            self.add_files(f"sweep-{sweep.stem}", folder)

    def runs(self):
        for gains in sorted((CONFIG / "gains").glob("*.yaml")):
            for seed in (1, 2):
                folder = self.fresh(f"run-{gains.stem}-{seed}")
                self.call("run", "run", "--rig", CONFIG / "rigs" / "simulated.yaml", "--gains", gains, "--fast", "--seed", seed,
                          "--duration", "10", "--theta0-deg", "3", "--out", folder, keep_output=False)
                for run in folder.iterdir():
                    self.add(f"run-{gains.stem}-{seed}/samples.csv", (run / "samples.csv").read_bytes())
                    self.call(f"run-{gains.stem}-{seed}/replay", "replay", run)

    def identifications(self):
        for name in ("friction", "pivot"):
            made = self.work / "experiments" / name
            if not made.exists():
                self.call("experiment", "experiment", CONFIG / "experiments" / f"{name}.yaml", "--rig",
                          CONFIG / "rigs" / "simulated.yaml", "--fast", "--out", made, keep_output=False)
            folder = self.fresh(f"identify-{name}")
            self.call(f"identify-{name}", "identify", "--data", made, "--plant", CONFIG / "plants" / "viscous.yaml", "--out", folder)
            self.add_files(f"identify-{name}", folder)

    def diagnosis(self, name, model, data):
        folder = self.fresh(name)
        self.call(name, "diagnose", "--model", model, "--data", *data, "--out", folder, "--trials")
        if folder.exists():
            self.call("report", "report", folder, keep_output=False)
            self.add_files(name, folder)

    def diagnoses(self):
        for number in range(self.cases):
            made = self.work / f"cases-{self.samples}" / str(number)
            if not made.exists():
                subprocess.run([self.matrix, "--case", str(number), "--keep", made, "--seed", "20261123", "--samples",
                                str(self.samples), "--data-only"], check=True, capture_output=True)
            self.diagnosis(f"diagnose-{number}", made / "believed.yaml", sorted(made.glob("run*.csv")))

    def measurements(self):
        made = self.work / "data"
        if not made.exists():
            subprocess.run([sys.executable, ROOT / "scripts" / "real_data.py", "prepare", self.data.resolve(), made], check=True,
                           capture_output=True)
        for folder in sorted(made.iterdir()):
            self.diagnosis(f"data-{folder.name}", folder / "plant.yaml", sorted(folder.glob("data*.yaml")))

    def make(self):
        if self.wants("design") or self.wants("margin"):
            self.designs()
        for kind, make in (("sweep", self.sweeps), ("run", self.runs), ("identify", self.identifications),
                           ("diagnose", self.diagnoses)):
            if self.wants(kind):
                make()
        if self.data and self.wants("data"):
            self.measurements()

    def lines(self):
        return "".join(f"{value}  {name}\n" for name, value in self.sums.items())


def compare(first, other):
    """Prints how many outputs of each kind are equal; returns whether all are."""
    equal, different = collections.Counter(), collections.Counter()
    print(f"{first.label} and {other.label}:")
    for name in sorted(first.sums.keys() | other.sums.keys()):
        same = first.sums.get(name) == other.sums.get(name)
        (equal if same else different)[name.split("-")[0]] += 1
        if not same:
            print(f"  differs: {name}")
    for kind in sorted(equal.keys() | different.keys()):
        print(f"  {kind}: {equal[kind]} equal, {different[kind]} different")
    print(f"  all: {equal.total()} equal, {different.total()} different", flush=True)
    return not different


def read_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("matrix", type=pathlib.Path)
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--against", type=pathlib.Path)
    parser.add_argument("--threads", default="")
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--samples", type=int, default=12000)
    parser.add_argument("--data", type=pathlib.Path)
    parser.add_argument("--only", default="")
    return parser.parse_args()


def main():
    arguments = read_arguments()
    arguments.work.mkdir(parents=True, exist_ok=True)
    builds = [arguments.build, *([arguments.against] if arguments.against else [])]
    manifests = [Manifest(arguments, build, threads) for build in builds for threads in arguments.threads.split(",")]
    for number, manifest in enumerate(manifests):
        manifest.make()
        (arguments.work / f"manifest-{number}.txt").write_text(manifest.lines())
    if len(manifests) == 1:
        print(manifests[0].lines(), end="")
        return
    if not all([compare(manifests[0], other) for other in manifests[1:]]):
        sys.exit(1)


if __name__ == "__main__":
    main()
