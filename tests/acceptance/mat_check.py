#!/usr/bin/env python3
"""MATLAB files between upright and scipy, which knows nothing of upright.

  mat_check.py UPRIGHT CONFIG FOLDER

scipy reads what `export --mat` wrote, with the same bits; upright reads vectors, matrices and structures of scipy.
Ends with 1 and a line for each finding.
"""
import csv
import pathlib
import subprocess
import sys

import numpy
import scipy.io

upright, config, folder = sys.argv[1], pathlib.Path(sys.argv[2]).resolve(), pathlib.Path(sys.argv[3]).resolve()
findings = []


def run_upright(*words):
    done = subprocess.run([upright, *map(str, words)], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{words}: {done.stderr}")
    return done.stdout.split("\n")


def expect(condition, text):
    if not condition:
        findings.append(text)


run = pathlib.Path(run_upright("run", "--fast", "--rig", config / "rigs/simulated.yaml", "--gains",
                               config / "gains/exponential.yaml", "--duration", 2, "--out", folder)[-2])
run_upright("export", run, "--mat", "--out", folder / "run.mat")
table = scipy.io.loadmat(folder / "run.mat")
rows = list(csv.DictReader(open(run / "samples.csv")))
for name in ("time_s", "voltage_v", "cart_m", "theta_rad", "cart_velocity_mps", "tick", "flags"):
    logged = numpy.array([float(row[name]) for row in rows])
    expect(table[name].shape == (len(rows), 1) and (table[name][:, 0] == logged).all(), f"{name} differs in scipy")

time = numpy.arange(0, 4, 0.002)
cart, voltage = 0.1 * numpy.sin(3 * time), numpy.sign(numpy.sin(4 * time))
signals = numpy.zeros((1, 2), dtype=[("values", object), ("label", object)])
signals[0, 0], signals[0, 1] = (cart.reshape(-1, 1), "x"), (voltage.reshape(1, 1, -1), "u")
log = {"time": time.reshape(-1, 1), "signals": signals}
files = {
    "v4": ({"t": time, "x": cart, "u": voltage}, {"format": "4"}, ("t", "x", "u")),
    "v5": ({"t": time, "x": cart.astype(numpy.float64), "u": voltage.astype(numpy.int8), "text": "no vector"}, {},
           ("t", "x", "u")),
    "matrix": ({"data": numpy.column_stack([time, cart, voltage])}, {"do_compression": True},
               ("data(:,1)", "data(:,2)", "data(:,3)")),
    "simulink": ({"out": log}, {}, ("out.time", "out.signals(1).values", "out.signals(2).values")),
}
for name, (content, options, columns) in files.items():
    scipy.io.savemat(folder / f"{name}.mat", content, **options)
    (folder / f"{name}.yaml").write_text(
        f"dataset:\n  file: {name}.mat\n  columns: {{time_s: '{columns[0]}', cart_m: '{columns[1]}', voltage_v: '{columns[2]}'}}\n")
    run_upright("export", folder / f"{name}.yaml", "--csv", "--out", folder / f"{name}.csv")
    back = list(csv.DictReader(open(folder / f"{name}.csv")))
    for column, values in (("time_s", time), ("cart_m", cart), ("voltage_v", voltage)):
        expect([float(row[column]) for row in back] == list(values), f"{name}: {column} differs in upright")
for finding in findings:
    print(finding)
sys.exit(1 if findings else 0)
