#!/usr/bin/env python3
"""How late the control loop wakes, beside cyclictest at the same rate, priority and processor.

  tests/bench/timing_bench.py [--seconds 60] [--piece 10] [--rate 1000] [--priority 80] [--cpu N] [--load]

Both take turns in pieces, so that what else the machine does meets both. The loop is `upright run` on the simulated rig in
real time, its lateness every row's wake_late_us; cyclictest (Debian's rt-tests) counts whole microseconds. --load keeps every
processor busy meanwhile, without priority. Needs the release build (scripts/build.sh release upright), and the right to use
SCHED_FIFO.
"""
import argparse
import csv
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BINARY = ROOT / "build/release/src/cli/upright"


def loop_piece(options, seconds, folder):
    gains = (ROOT / "config/gains/exponential.yaml").read_text()
    gains = re.sub(r"sample_rate_hz: \d+", f"sample_rate_hz: {options.rate}", gains)
    (folder / "gains.yaml").write_text(gains)
    command = [BINARY, "run", "--rig", ROOT / "config/rigs/simulated.yaml", "--gains", folder / "gains.yaml", "--duration",
               str(seconds), "--theta0-deg", "1", "--priority", str(options.priority), "--cpu", str(options.cpu), "--json",
               "--out", folder]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"the loop did not run to its end: {done.stderr or done.stdout}")
    said = json.loads(done.stdout)
    if "SCHED_FIFO priority" not in said["scheduling"]:
        sys.exit(f"run it where SCHED_FIFO is granted: {said['scheduling']}")
    with open(pathlib.Path(said["run_directory"]) / "samples.csv", newline="") as file:
        return [float(row["wake_late_us"]) for row in csv.DictReader(file)]


def cyclictest_piece(options, seconds):
    most_us = 100_000
    command = ["cyclictest", "-q", "-m", "-p", options.priority, "-i", 1_000_000 // options.rate, "-l", seconds * options.rate,
               "-a", options.cpu, "-t", 1, "-h", most_us]
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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--piece", type=int, default=10)
    parser.add_argument("--rate", type=int, default=1000)
    parser.add_argument("--priority", type=int, default=80)
    parser.add_argument("--cpu", type=int, default=max(os.sched_getaffinity(0)))
    parser.add_argument("--load", action="store_true")
    options = parser.parse_args()
    if shutil.which("cyclictest") is None:
        sys.exit("install Debian's rt-tests: there is no cyclictest")
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"])
            for _ in os.sched_getaffinity(0) if options.load]
    late_us = {"upright": [], "cyclictest": []}
    try:
        with tempfile.TemporaryDirectory() as folder:
            for _ in range(options.seconds // options.piece):
                late_us["upright"] += loop_piece(options, options.piece, pathlib.Path(folder))
                late_us["cyclictest"] += cyclictest_piece(options, options.piece)
    finally:
        for process in busy:
            process.kill()
    figures = {}
    for name, values in late_us.items():
        values.sort()
        figures[name] = [quantile(values, 0.5), quantile(values, 0.99), quantile(values, 0.999), values[-1]]
        print("{:10} {:6} wake-ups, late by {:.1f} us (50 %), {:.1f} (99 %), {:.1f} (99.9 %), {:.1f} at worst".format(
            name, len(values), *figures[name]))
    ours, theirs = figures["upright"], figures["cyclictest"]
    print(f"upright to cyclictest: {ours[2] / theirs[2]:.2f} at 99.9 % (bar 1.2), {ours[3] / theirs[3]:.2f} at worst (bar 1.5)")


if __name__ == "__main__":
    main()
