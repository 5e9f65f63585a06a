#!/usr/bin/env python3
"""How late the control loop wakes, asleep until the period and awake for its last microseconds (--spin), beside cyclictest at
the same rate, priority and processor.

  tests/bench/timing_bench.py [--seconds 60] [--piece 10] [--spin 100 ...] [--rate 1000] [--priority 80] [--cpu N] [--load]
                              [--binary build/release/src/cli/upright]

All take turns in pieces, so that what else the machine does meets all. The loop is `upright run` on the simulated rig in
real time, its lateness every row's wake_late_us; cyclictest (Debian's rt-tests) counts whole microseconds. The share of a
processor is that of the whole program, its threads without priority included. --load keeps every processor busy meanwhile, without
priority. Needs the release build (scripts/build.sh release upright), and the right to use SCHED_FIFO.
"""
import argparse
import csv
import json
import os
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def loop_piece(options, seconds, folder, spin_us):
    gains = (ROOT / "config/gains/exponential.yaml").read_text()
    gains = re.sub(r"sample_rate_hz: \d+", f"sample_rate_hz: {options.rate}", gains)
    (folder / "gains.yaml").write_text(gains)
    command = [options.binary, "run", "--rig", ROOT / "config/rigs/simulated.yaml", "--gains", folder / "gains.yaml", "--duration",
               str(seconds), "--theta0-deg", "1", "--priority", str(options.priority), "--cpu", str(options.cpu),
               "--spin", str(spin_us), "--json", "--out", folder]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"the loop did not run to its end: {done.stderr or done.stdout}")
    said = json.loads(done.stdout)
    if "SCHED_FIFO priority" not in said["scheduling"]:
        sys.exit(f"run it where SCHED_FIFO is granted: {said['scheduling']}")
    with open(pathlib.Path(said["run_directory"]) / "samples.csv", newline="") as file:
        return [float(row["wake_late_us"]) for row in csv.DictReader(file)]


def cyclictest_piece(options, seconds):
    max_us = 100_000
    command = ["cyclictest", "-q", "-m", "-p", options.priority, "-i", 1_000_000 // options.rate, "-l", seconds * options.rate,
               "-a", options.cpu, "-t", 1, "-h", max_us]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=True)
    late_us = []
    for line in done.stdout.splitlines():
        if found := re.fullmatch(r"(\d{6}) (\d{6})", line.strip()):
            late_us += [float(found[1])] * int(found[2])
    if worst := re.search(r"# Max Latencies: (\d+)", done.stdout):
        late_us += [float(worst[1])] * (seconds * options.rate - len(late_us))
    return late_us


def quantile(sorted_values, share):
    return sorted_values[min(len(sorted_values) - 1, int(share * len(sorted_values)))]


def used_s():
    """The processors' time of the programs that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def take_turns(options, folder):
    """For each of the contestants: every lateness, and the processors' time that it took."""
    contestants = {f"upright, spin {spin_us:g} us": lambda spin_us=spin_us: loop_piece(options, options.piece, folder, spin_us)
                   for spin_us in [0.0] + options.spin}
    contestants["cyclictest"] = lambda: cyclictest_piece(options, options.piece)
    late_us, taken_s = {name: [] for name in contestants}, {name: 0.0 for name in contestants}
    for _ in range(options.seconds // options.piece):
        for name, piece in contestants.items():
            before_s = used_s()
            late_us[name] += piece()
            taken_s[name] += used_s() - before_s
    return late_us, taken_s


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--piece", type=int, default=10)
    parser.add_argument("--spin", type=float, nargs="*", default=[100.0])
    parser.add_argument("--binary", type=pathlib.Path, default=ROOT / "build/release/src/cli/upright")
    parser.add_argument("--rate", type=int, default=1000)
    parser.add_argument("--priority", type=int, default=80)
    parser.add_argument("--cpu", type=int, default=max(os.sched_getaffinity(0)))
    parser.add_argument("--load", action="store_true")
    options = parser.parse_args()
    if shutil.which("cyclictest") is None:
        sys.exit("install Debian's rt-tests: there is no cyclictest")
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"])
            for _ in os.sched_getaffinity(0) if options.load]
    try:
        with tempfile.TemporaryDirectory() as folder:
            late_us, taken_s = take_turns(options, pathlib.Path(folder))
    finally:
        for process in busy:
            process.kill()
    figures = {}
    for name, values in late_us.items():
        values.sort()
        figures[name] = [quantile(values, 0.5), quantile(values, 0.99), quantile(values, 0.999), values[-1]]
        share = taken_s[name] / (options.seconds // options.piece * options.piece)
        print("{:22} {:6} wake-ups, late by {:.1f} us (50 %), {:.1f} (99 %), {:.1f} (99.9 %), {:.1f} at worst; "
              "{:.1f} % of a processor".format(name, len(values), *figures[name], 100 * share))
    theirs = figures["cyclictest"]
    for name, ours in figures.items():
        if name != "cyclictest":
            print(f"{name} to cyclictest: {ours[2] / theirs[2]:.2f} at 99.9 % (bar 1.2), {ours[3] / theirs[3]:.2f} at worst (bar 1.5)")


if __name__ == "__main__":
    main()
