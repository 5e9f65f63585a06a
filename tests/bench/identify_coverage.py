#!/usr/bin/env python3
"""How often the intervals of `upright identify` hold, over seeds of the sensors' noise.

For each seed: the experiments of config/experiments on a simulated rig with the paper's Tables 2 and 3, encoders' steps and
white noise on top, in virtual time; then one identification. Not in ctest, for an identification takes about a minute.

    tests/bench/identify_coverage.py [--upright PROGRAM] [--seeds 30] [--first 1] [--plant table-2|tables-2-3] [--keep FOLDER]

Prints a line per identification while it goes on, then per parameter: largest and root-mean-square error, mean half width of
the interval, and how many of the intervals held the truth.
"""
import argparse
import json
import math
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

BODY = """plant:
  cart_mass_kg: 0.815
  pendulum: {mass_kg: 0.21, length_to_com_m: 0.305}
  gravity_mps2: 9.8
  motor: {force_per_volt_n: 1.7189, back_emf_n_per_mps: 7.682}
  effects:
    - {kind: viscous_friction, coefficient_n_per_mps: 3.0}
    - {kind: coulomb_friction, force_n: 0.4306291}
    - {kind: stribeck_friction, extra_force_n: 0.4342453, velocity_mps: 0.105, shape: 2.0}
"""
BRISTLES = "    - {kind: bristle_friction, stiffness_n_per_m: 121.0, damping_n_per_mps: 70.0}\n"
PIVOT = """    - {kind: pivot_viscous_friction, coefficient_nms_per_rad: 0.0008}
    - {kind: pivot_coulomb_friction, torque_nm: 0.0015}
"""
CART = {
    "viscous_friction.coefficient_n_per_mps": 3.0,
    "coulomb_friction.force_n": 0.4306291,
    "stribeck_friction.extra_force_n": 0.4342453,
    "stribeck_friction.velocity_mps": 0.105,
    "stribeck_friction.shape": 2.0,
    "breakaway_n": 0.8648744,
    "cart_mass_kg": 0.815,
}
TABLE_3 = {
    "bristle_friction.stiffness_n_per_m": 121.0,
    "bristle_friction.damping_n_per_mps": 70.0,
    "pivot_viscous_friction.coefficient_nms_per_rad": 0.0008,
    "pivot_coulomb_friction.torque_nm": 0.0015,
    "pendulum.length_to_com_m": 0.305,
}
PLANTS = {
    "table-2": (BODY, ["friction"], CART),
    "tables-2-3": (BODY + BRISTLES + PIVOT, ["friction", "pivot"], {**CART, **TABLE_3}),
}


def run(command):
    """The program's output; ends this one, with what was said, where the program fails."""
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return done.stdout


def rig_file(folder, plant):
    text = (ROOT / "config/rigs/simulated.yaml").read_text()
    for old, new in (
        ("../plants/exponential.yaml", str(plant)),
        ("noise: {cart_m: 0.0, theta_rad: 0.0}", "noise: {cart_m: 1.0e-5, theta_rad: 5.0e-4}"),
    ):
        if old not in text:
            sys.exit(f"config/rigs/simulated.yaml has no longer: {old}")
        text = text.replace(old, new)
    file = folder / "rig.yaml"
    file.write_text(text)
    return file


def runs_of(experiments, shuffle, seed):
    """The run directories, in the order of the trials or in any."""
    runs = []
    for folder in experiments:
        lines = (folder / "trials.csv").read_text().splitlines()
        column = lines[0].split(",").index("run_directory")
        runs += [folder / line.split(",")[column] for line in lines[1:]]
    if shuffle:
        random.Random(seed).shuffle(runs)
    return runs


def identify(arguments, seed, folder):
    text, experiments, _ = PLANTS[arguments.plant]
    plant = folder / "plant.yaml"
    plant.write_text(text)
    rig = rig_file(folder, plant)
    made = []
    for name in experiments:
        out = folder / name
        run([arguments.upright, "experiment", ROOT / f"config/experiments/{name}.yaml", "--rig", rig, "--fast",
             "--seed", str(seed), "--out", out])
        made.append(out)
    data = [str(r) for r in runs_of(made, arguments.shuffle, seed)]
    begun = time.monotonic()
    document = json.loads(run([arguments.upright, "identify", "--data", *data, "--plant",
                               ROOT / "config/plants/viscous.yaml", "--json"]))
    return {p["name"]: p for p in document["parameters"]}, document["notes"], time.monotonic() - begun


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--upright", default=str(ROOT / "build/release/src/cli/upright"))
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--plant", choices=PLANTS, default="tables-2-3")
    parser.add_argument("--shuffle", action="store_true", help="give the runs in an order of chance")
    parser.add_argument("--keep", type=Path, help="folder that keeps the data of each seed")
    arguments = parser.parse_args()
    truth = PLANTS[arguments.plant][2]
    found = {name: [] for name in truth}
    for seed in range(arguments.first, arguments.first + arguments.seeds):
        folder = Path(tempfile.mkdtemp(prefix="identify-", dir=arguments.keep))
        try:
            parameters, notes, seconds = identify(arguments, seed, folder)
        finally:
            if arguments.keep is None:
                shutil.rmtree(folder)
        outside, worst = [], ("", 0.0)
        for name, true in truth.items():
            p = parameters.get(name)
            found[name].append(p)
            error = math.inf if p is None else p["value"] / true - 1.0
            if p is None or not p["ci95"][0] <= true <= p["ci95"][1]:
                outside.append(name)
            if abs(error) > abs(worst[1]):
                worst = (name, error)
        print(f"seed {seed}: {seconds:.0f} s, worst {worst[0]} {100 * worst[1]:+.2f} %, outside: {outside or 'none'}",
              flush=True)
        if math.isinf(worst[1]):
            print("  " + "; ".join(notes), flush=True)
    print(f"\n| parameter ({arguments.plant}, {arguments.seeds} seeds) | true | rms error | largest error | "
          "mean half width of the interval | holds |\n|---|---|---|---|---|---|")
    for name, list_of in found.items():
        true = truth[name]
        have = [p for p in list_of if p is not None]
        if not have:
            print(f"| `{name}` | {true:g} | not found | | | 0 of {len(list_of)} |")
            continue
        errors = [p["value"] / true - 1.0 for p in have]
        rms = math.sqrt(sum(e * e for e in errors) / len(errors))
        half = sum(p["ci95"][1] - p["ci95"][0] for p in have) / (2 * len(have)) / true
        holds = sum(p["ci95"][0] <= true <= p["ci95"][1] for p in have)
        print(f"| `{name}` | {true:g} | {100 * rms:.2f} % | {100 * max(map(abs, errors)):.2f} % | "
              f"{100 * half:.2f} % | {holds} of {len(list_of)} |")


if __name__ == "__main__":
    main()
