#!/usr/bin/env python3
"""Runs the controller for a long time and checks its memory, its clock and its records.

  scripts/soak.py [--virtual-hours 2] [--real-minutes 10] [--seed N] [--rate 200] [--binary PATH] [--keep FOLDER] [--busy]
                  [--stalls PROGRAM --retry-log FILE]

The first part runs in virtual time on the simulated rig, the second in real time over Modbus TCP against
`upright virtual-rig`, whose replies are late, lost, corrupt, old or out of order at random (--seed). Both parts check
the memory of every process after a warm-up, ticks and time stamps of each row, the rows against the counts in run.yaml,
the replay and the report.

--busy      for a machine with other work: a run that stopped with an overrun is restarted until the time is over, and
            the number of restarts is printed
--stalls    (tests/support/stall_answers.cpp) restarts only after an overrun during a stall of the machine; a line in
            the retry log counts it

Prints the measurements. The exit code is 1, with a line for each failed check.
"""
import argparse
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
FAULTS = {"late": 400, "drop": 2000, "corrupt": 4000, "stale": 4000, "reorder": 4000}  # one reply in this number
LATE_MS = 6
MISSED, HELD = 128, 3  # bits of the column flags: see docs/reference/run-directory.md

WARM_SHARE = 0.3           # share of the time in which memory may still grow
MAX_GROWTH_KIB = 512      # of the resident memory after that, in total
MAX_DRIFT_S = 1e-3        # between ticks and time stamps, in real time
READER_MIB = 256           # for replay and report, independent of the length of the run
problems = []


def demand(good, sentence):
    if not good:
        problems.append(sentence)
        print(f"  FAILED: {sentence}", flush=True)


class Watched:
    """A process whose resident memory is monitored while it runs."""

    def __init__(self, command, out=subprocess.PIPE):
        self.started = time.monotonic()
        self.process = subprocess.Popen([str(word) for word in command], stdout=out, stderr=subprocess.PIPE, text=True)
        self.memory = []  # resident: (seconds, KiB)
        self.peak_kib = 0
        self.thread = threading.Thread(target=self.watch)
        self.thread.start()

    def watch(self):
        while self.process.poll() is None:
            try:
                status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
            except OSError:
                return
            kib = dict(re.findall(r"(VmHWM|VmRSS):\s+(\d+) kB", status))
            if len(kib) == 2:  # a process that has ended has none
                self.memory.append((time.monotonic() - self.started, int(kib["VmRSS"])))
                self.peak_kib = int(kib["VmHWM"])
            time.sleep(0.1)

    def finish(self):
        out, err = self.process.communicate()
        self.thread.join()
        self.seconds = time.monotonic() - self.started
        return self.process.returncode, out, err

    def largest_mib(self):
        return self.peak_kib / 1024

    def growth_kib(self):
        """From the largest of the first half of the warm time to the largest of its second half."""
        warm = [kib for at, kib in self.memory if at >= WARM_SHARE * self.memory[-1][0]]
        half = len(warm) // 2
        return max(warm[half:]) - max(warm[:half]) if half > 0 else 0


class Rows:
    """Statistics of samples.csv, which is read once, row by row."""

    def __init__(self, file, rate_hz):
        self.count = self.missed = self.unexplained = self.held = 0
        # The smallest delay of a time stamp behind its tick, at the beginning and at the end. Latency only adds to it.
        self.first_s, self.last_s = [], []
        window = max(1, int(10 * rate_hz))
        expected = 0
        recent = []
        with open(file) as lines:
            header = lines.readline().rstrip("\n").split(",")
            assert header[:2] == ["tick", "time_s"] and header[14:] == ["flags", "sequence"], header
            for line in lines:
                tick_text, time_text, _ = line.split(",", 2)
                flags = int(line.rsplit(",", 2)[1])
                tick = int(tick_text)
                if tick != expected:
                    self.missed += tick - expected
                    self.unexplained += 0 if flags & MISSED else 1
                expected = tick + 1
                if flags & HELD:
                    self.held += 1
                else:
                    behind_s = float(time_text) - tick / rate_hz
                    if len(self.first_s) < window:
                        self.first_s.append(behind_s)
                    recent.append(behind_s)
                    if len(recent) >= 2 * window:
                        recent = recent[window:]
                self.count += 1
        self.last_s = recent[-window:]

    def drift_s(self):
        return min(self.last_s) - min(self.first_s)


class Stalls:
    """Finds runs that stopped with an overrun at most LATE_S after a stall of the machine."""
    LATE_S = 0.05

    def __init__(self, program, log):
        self.log = log
        self.watcher = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) if program else None

    def excuse(self, run, said):
        if self.watcher is None or said["reason"] != "overrun":
            return False
        started_s = float(re.search(r"\n  started_monotonic_s: (\S+)", (run / "run.yaml").read_text())[1])
        stopped_s = started_s + said["time_s"]
        self.watcher.stdin.write(f"{stopped_s - self.LATE_S} {stopped_s}\n")
        self.watcher.stdin.flush()
        stall = self.watcher.stdout.readline().split()
        if len(stall) != 2:
            return False
        with open(self.log, "a") as log:
            log.write(f"retry\tsoak_short\tthe run ended with overrun\t{stall[0]}\t{stall[1]}\n")
        return True

    def end(self):
        if self.watcher is not None:
            self.watcher.stdin.close()
            self.watcher.wait()


def outcome_of(run):
    """The counts of run.yaml's outcome."""
    text = (run / "run.yaml").read_text()
    text = text[text.index("\noutcome:"):]
    numbers = dict(re.findall(r"(\w+): (-?[\d.e+-]+)[,}\n]", re.search(r"counts: {.*}\n", text)[0]))
    numbers.update(re.findall(r"(\w+): (\d+)[,}]", re.search(r"link: {.*}\n", text)[0]))
    numbers["rows_written"] = re.search(r"rows_written: (\d+)", text)[1]
    numbers["rows_dropped"] = re.search(r"rows_dropped: (\d+)", text)[1]
    return {name: int(float(value)) for name, value in numbers.items()}


def judge_readers(options, run):
    """Checks replay and report of a run, and that their memory does not grow with the length of the run."""
    for verb in ("replay", "report"):
        reader = Watched([options.binary, verb, run])
        code, out, err = reader.finish()
        demand(code == 0, f"{verb} of {run} ended with exit code {code}: {err or out}")
        demand(reader.largest_mib() < READER_MIB, f"{verb} used {reader.largest_mib():.0f} MiB, more than {READER_MIB} MiB")
        print(f"  {verb}: {reader.seconds:.1f} s, {reader.largest_mib():.0f} MiB, {out.strip().splitlines()[-1]}", flush=True)
    size = (run / "report.html").stat().st_size
    demand(size < 8 << 20, f"report.html has {size} bytes, more than 8 MiB")
    print(f"  report.html: {size / 1024:.0f} KiB", flush=True)


def judge_run(options, run, rate_hz, virtual):
    rows, counts = Rows(run / "samples.csv", rate_hz), outcome_of(run)
    print(f"  {rows.count} rows, {rows.missed} periods missed, {rows.held} without fresh counts; the clock drifted by "
          f"{1e6 * rows.drift_s():.1f} us", flush=True)
    demand(rows.count == counts["rows_written"], f"the file has {rows.count} rows, but run.yaml counts {counts['rows_written']}")
    demand(counts["rows_dropped"] == 0, f"{counts['rows_dropped']} rows were dropped")
    demand(rows.unexplained == 0, f"{rows.unexplained} gaps between ticks are not flagged as missed periods")
    demand(rows.missed == counts["missed"], f"{rows.missed} ticks are missing, but run.yaml counts {counts['missed']}")
    demand(abs(rows.drift_s()) <= (1e-9 if virtual else MAX_DRIFT_S), f"the clock drifted by {rows.drift_s()} s")
    demand(rows.held == counts["stale"] + counts["faults"], "the number of rows without fresh counts differs from run.yaml")
    judge_readers(options, run)
    return counts


def judge_memory(name, watched):
    print(f"  memory of the {name}: at most {watched.largest_mib():.1f} MiB, {watched.growth_kib():+d} KiB after the warm-up", flush=True)
    demand(watched.growth_kib() <= MAX_GROWTH_KIB, f"the memory of the {name} grew by {watched.growth_kib()} KiB")


def soak_virtual(options, folder):
    seconds = options.virtual_hours * 3600
    print(f"{seconds:.0f} s in virtual time at 1000 Hz", flush=True)
    run = Watched([options.binary, "run", "--rig", ROOT / "config/rigs/simulated.yaml", "--gains",
                   ROOT / "config/gains/exponential.yaml", "--duration", seconds, "--seed", options.seed, "--fast", "--out", folder,
                   "--json"])
    code, out, err = run.finish()
    demand(code == 0, f"the run ended with exit code {code}: {err}")
    print(f"  ran for {run.seconds:.1f} s", flush=True)
    judge_memory("run", run)
    judge_run(options, pathlib.Path(json.loads(out)["run_directory"]), 1000, True)


def rig_and_gains(options, folder, port):
    rig = (ROOT / "config/rigs/modbus-tcp.yaml").read_text().replace("../plants", str(ROOT / "config/plants"))
    # A reply may take most of a period; a late one takes longer.
    rig = rig.replace("response_timeout_s: 0.0008", f"response_timeout_s: {0.6 / options.rate}").replace("port: 1502", f"port: {port}")
    (folder / "rig.yaml").write_text(rig)
    gains = (ROOT / "config/gains/exponential.yaml").read_text()
    (folder / "gains.yaml").write_text(re.sub(r"sample_rate_hz: \d+", f"sample_rate_hz: {options.rate}", gains))


def start_server(options, folder):
    rig_and_gains(options, folder, 1502)
    command = [options.binary, "virtual-rig", "--rig", folder / "rig.yaml", "--tcp", "127.0.0.1:0", "--theta0-deg", "1",
               "--inject-seed", options.seed, "--inject-late-ms", LATE_MS]
    for fault, every in FAULTS.items():
        command += [f"--inject-{fault}-every", every]
    server = Watched(command)
    port = int(server.process.stdout.readline().rsplit(":", 1)[1])
    rig_and_gains(options, folder, port)
    return server


def soak_real(options, folder):
    seconds = options.real_minutes * 60
    faults = ", ".join(f"one in {every} {fault}" for fault, every in FAULTS.items())
    print(f"{seconds:.0f} s in real time over Modbus TCP at {options.rate} Hz, seed {options.seed}; of the replies {faults}", flush=True)
    server = start_server(options, folder)
    left_s, late_stops, troubles = seconds, 0, {}
    stalls = Stalls(options.stalls, options.retry_log)
    try:
        while left_s > 0:
            run = Watched([options.binary, "run", "--rig", folder / "rig.yaml", "--gains", folder / "gains.yaml", "--duration", left_s,
                           "--out", folder, "--unchecked", "--json"])
            code, out, err = run.finish()
            said = json.loads(out)
            run_directory = pathlib.Path(said["run_directory"])
            late = options.busy and said["reason"] == "overrun" or stalls.excuse(run_directory, said)
            late_stops += late
            demand(code == 0 or late, f"the run stopped after {said['time_s']:.1f} s: {said['sentence']} {err}")
            print(f"  {said['sentence']}", flush=True)
            print(f"  wake-up latency {said['timing']['wake_late']['p99_9_us']:.0f} us (99.9 %), "
                  f"{said['timing']['wake_late']['max_us']:.0f} us (max)", flush=True)
            judge_memory("controller", run)
            counts = judge_run(options, run_directory, options.rate, False)
            for cause in ("late_reply", "no_reply", "no_connection", "wrong_reply", "refused", "other", "recoveries"):
                troubles[cause] = troubles.get(cause, 0) + counts[cause]
            left_s = left_s - said["time_s"] if late else 0
            time.sleep(1)  # by then the rig has detected that its master is gone
    finally:
        stalls.end()
        server.process.terminate()
        server.finish()
    judge_memory("virtual rig", server)
    if late_stops:
        print(f"  {late_stops} runs stopped with an overrun on this machine and were restarted", flush=True)
    print("  tolerated faults: " + ", ".join(f"{count} {cause}" for cause, count in troubles.items()), flush=True)
    demand(sum(troubles.values()) > 0, "no fault was injected, so the soak tested nothing")
    demand(troubles.get("recoveries", 0) > 0, "the link was never re-established")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--virtual-hours", type=float, default=2)
    parser.add_argument("--real-minutes", type=float, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rate", type=int, default=200)
    parser.add_argument("--binary", type=pathlib.Path, default=ROOT / "build/release/src/cli/upright")
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("--busy", action="store_true")
    parser.add_argument("--stalls", type=pathlib.Path)
    parser.add_argument("--retry-log", type=pathlib.Path)
    options = parser.parse_args()
    folder = options.keep or pathlib.Path(tempfile.mkdtemp(prefix="upright-soak-"))
    folder.mkdir(parents=True, exist_ok=True)
    try:
        if options.virtual_hours > 0:
            soak_virtual(options, folder)
        if options.real_minutes > 0:
            soak_real(options, folder)
    finally:
        if not options.keep:
            shutil.rmtree(folder, ignore_errors=True)
    print(f"{len(problems)} checks failed" if problems else "all checks passed")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
