#!/usr/bin/env python3
"""Writes plant and dataset files for measurements of other laboratories, and the table of their diagnoses.

  real_data.py prepare DATA OUT    writes OUT/<name>/plant.yaml and data*.yaml for the files below DATA
  real_data.py table OUT           prints a Markdown table of every OUT/<name>/diagnosis

Uses the standard library only. See scripts/real-data.sh.
"""
import csv
import json
import math
import pathlib
import sys

from fixed_phrases import in_plain_words

EMPS_PLANT = """plant:
  cart_mass_kg: 95.1089
  gravity_mps2: 9.81
  motor: {force_per_volt_n: 35.15065, back_emf_n_per_mps: 0.0}
  effects:
    - {kind: viscous_friction, coefficient_n_per_mps: 203.5034}
"""
# The current in ampere replaces the voltage: k_tau / r = 0.0934 / 0.028 N/A, and no back-EMF.
AAU_CART_PLANT = """plant:
  cart_mass_kg: 6.28
  gravity_mps2: 9.82
  motor: {force_per_volt_n: 3.336, back_emf_n_per_mps: 0.0}
  effects: []
"""
# A slender rod about its pivot; the thesis gives mass and length.
AAU_PENDULUM_PLANT = """plant:
  cart_mass_kg: 6.28
  pendulum: {mass_kg: 0.2235, length_to_com_m: 0.3169, inertia_about_pivot_kgm2: 0.0225}
  gravity_mps2: 9.82
  motor: {force_per_volt_n: 3.336, back_emf_n_per_mps: 0.0}
  effects: []
"""
AAU_PENDULUM_VISCOUS_PLANT = AAU_PENDULUM_PLANT.replace(
    "effects: []", "effects: [{kind: pivot_viscous_friction, coefficient_nms_per_rad: 5.0e-4}]")
# m a^2 + I of the authors' EstimatedParameters.
UW_PLANT = """plant:
  cart_mass_kg: 1.0
  pendulum: {mass_kg: 0.14775, length_to_com_m: 0.14758, inertia_about_pivot_kgm2: 0.0033271}
  gravity_mps2: 9.81
  motor: {force_per_volt_n: 1.0, back_emf_n_per_mps: 0.0}
  effects:
    - {kind: pivot_viscous_friction, coefficient_nms_per_rad: 2.2394e-4}
"""
# The lab sheet (Kg 3.71, Km 0.0168, r 0.0184 m, I0 about the centre), with the armature resistance that the cart's
# inertia in the data asks for, 1.6 Ohm: the sheet's 0.16 Ohm would make the motor ten times as strong.
CANTERBURY_PLANT = """plant:
  cart_mass_kg: 1.608
  pendulum: {mass_kg: 0.215, length_to_com_m: 0.314, inertia_about_pivot_kgm2: 0.028258}
  gravity_mps2: 9.81
  motor: {force_per_volt_n: 2.117, back_emf_n_per_mps: 7.171}
  effects: []
"""


def dataset(file, columns, **more):
    lines = ["dataset:", f"  file: {file}"]
    lines += [f"  {key}: {value}" for key, value in more.items()]
    lines.append("  columns: {" + ", ".join(f"{name}: {column}" for name, column in columns.items()) + "}")
    return "\n".join(lines) + "\n"


AAU_CART_COLUMNS = {"time_s": 1, "voltage_v": 2, "cart_m": 3}
CANTERBURY_COLUMNS = {"time_s": "t_s", "voltage_v": "RMV", "cart_m": "CP", "theta_rad": "PPU"}


def aau_cart(data, names):
    return [dataset(data / "aau" / f"{name}.csv", AAU_CART_COLUMNS, header="false") for name in names]


def aau_decay(data):
    return [dataset(data / "aau" / "test1pend1.csv", {"time_s": 1, "theta_rad": 2}, header="false",
                    cart_locked="true", from_s=10)]


def sources(data):
    """Name: plant file, dataset files, and the findings of the authors or of the ladder in SOURCE.md."""
    return {
        "emps": (
            EMPS_PLANT,
            [dataset(data / "emps" / "DATA_EMPS.csv", {"time_s": "t_s", "cart_m": "qm_m", "voltage_v": "vir_V"})],
            "M 95.1089 kg, viscous 203.5034 N/(m/s), Coulomb 20.3935 N, constant force -3.1648 N; then asymmetric"
            " friction. Open loop, whole train run: viscous 43.8 mm, with Coulomb and offset 2.4 mm"),
        "aau-cart-0m10": (
            AAU_CART_PLANT, aau_cart(data, ["0m10"]),
            "1 s pieces: mass only 49.0 mm, viscous 12.3, Coulomb and offset 3.9 with 6.23 kg; authors 6.28 kg,"
            " Coulomb 1.9 to 5.6 N by place and direction"),
        "aau-cart-0m30": (
            AAU_CART_PLANT, aau_cart(data, ["0m30"]),
            "1 s pieces: mass only 52.3 mm, viscous 12.5, Coulomb and offset 5.9 with 6.49 kg"),
        "aau-cart-all": (
            AAU_CART_PLANT, aau_cart(data, ["0m10", "0m11", "0m30", "0m50"]),
            "authors: Coulomb friction depends on place and direction, 2.05 to 3.2 N one way, 1.9 to 5.6 N the other"),
        "aau-pendulum": (
            AAU_PENDULUM_PLANT, aau_decay(data),
            "10 to 71 s: viscous 145 mrad, with Coulomb 11.4, Coulomb and quadratic 2.2 (viscous then about 0)"),
        "aau-pendulum-viscous": (
            AAU_PENDULUM_VISCOUS_PLANT, aau_decay(data), "author: Coulomb 4.1e-3 N m, viscous 0.5e-3 N m s"),
        "uw": (
            UW_PLANT,
            [dataset(data / "uw" / "single_pendulum_free_swing.csv", {"time_s": "t_s", "theta_rad": "theta_rad"},
                     cart_locked="true")],
            "55 s: viscous 27.9 mrad, with Coulomb 19.4, with quadratic 23.4, with both 2.9"),
        "canterbury-balance": (
            CANTERBURY_PLANT, [dataset(data / "canterbury" / "csm102set1.csv", CANTERBURY_COLUMNS)],
            "stiction hunting, about 0.45 V offset, 0.2 to 0.25 V Coulomb; the 67 ms velocity lag is the controller's"),
        "canterbury-fall": (
            CANTERBURY_PLANT, [dataset(data / "canterbury" / "adm101s2.csv", CANTERBURY_COLUMNS, to_s=5.6)],
            "unexplained share of a regression: no friction 19.0 %, offset 16.2, Coulomb 9.6, both 7.1 (Coulomb 0.66 V,"
            " offset 0.17 V)"),
    }


def prepare(data, out):
    for name, (plant, datasets, _) in sources(data).items():
        folder = out / name
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "plant.yaml").write_text(plant)
        for number, text in enumerate(datasets):
            (folder / f"data{number}.yaml").write_text(text)


def rms_off(file):
    """Root mean square of measured minus simulated on held-out segments: {quantity: (before, after)}."""
    sums = {"cart": [0.0, 0.0, 0], "theta": [0.0, 0.0, 0]}
    with open(file, newline="") as rows:
        for row in csv.DictReader(rows):
            for quantity, unit in (("cart", "m"), ("theta", "rad")):
                measured = row[f"{quantity}_{unit}"]
                if not measured:
                    continue
                for place, step in enumerate(("before", "after")):
                    sums[quantity][place] += (float(measured) - float(row[f"{quantity}_{step}_{unit}"])) ** 2
                sums[quantity][2] += 1
    return {q: (math.sqrt(b / n), math.sqrt(a / n)) for q, (b, a, n) in sums.items() if n}


# What a force_table lies over, in a sentence.
CURVE_OVER = {"velocity": "velocity", "position": "position", "position_and_direction": "position, against the motion",
              "position_and_velocity": "position, times the velocity"}


def curve_in_words(over, begin, end, forces):
    """A force_table by what it lies over, where, and its extremes: 13 nodes do not fit into a table."""
    return (f"force_table over the {CURVE_OVER[over]}, from {begin:.4g} to {end:.4g}"
            f" {'m/s' if over == 'velocity' else 'm'}, of {min(forces):.3g} to {max(forces):.3g} N")


def in_words(effect):
    if "curve" in effect:
        curve = effect["curve"]
        return curve_in_words(curve["over"], curve["at"][0], curve["at"][-1], curve["force_n"])
    values = []
    for name, p in effect["parameters"].items():
        low, high = p["ci95"]
        unit = "" if p["unit"] == "1" else " " + p["unit"]
        values.append(f"{name} {p['value']:.4g} ({low:.4g} to {high:.4g}){unit}")
    return f"{effect['kind']} {', '.join(values)}"


def with_alternatives(effect):
    others = effect["confusable_with"]
    return in_words(effect) + (f" [or {', '.join(others)}]" if others else "")


def table(out):
    rows = []
    for name, (_, _, said) in sources(pathlib.Path("/")).items():
        file = out / name / "diagnosis" / "diagnosis.json"
        if not file.exists():
            continue
        rows.append((name, said, json.loads(file.read_text()), rms_off(out / name / "diagnosis" / "traces.csv"),
                     (out / name / "seconds.txt").read_text().strip()))
    print("| data | gap before | gap after | RMS error before | RMS error after | verdict | seconds |")
    print("|---|---|---|---|---|---|---|")
    for name, _, found, off, seconds in rows:
        text = [" and ".join(f"{1e3 * pair[step]:.3g} {'mm' if q == 'cart' else 'mrad'}" for q, pair in off.items())
                for step in (0, 1)]
        print(f"| {name} | {found['gap']['before']:.3g} | {found['gap']['after']:.3g} | {text[0]} | {text[1]} |"
              f" {found['verdict']} | {seconds} |")
    print("\n| data | effects found, with 95 % intervals | residual | authors, or the ladder of SOURCE.md |")
    print("|---|---|---|---|")
    for name, said, found, _, _ in rows:
        named = "; ".join(with_alternatives(effect) for effect in found["effects"]) or "nothing"
        print(f"| {name} | {named} | {in_plain_words(found['residual'])} | {said} |")


def main():
    if len(sys.argv) == 4 and sys.argv[1] == "prepare":
        prepare(pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3]))
    elif len(sys.argv) == 3 and sys.argv[1] == "table":
        table(pathlib.Path(sys.argv[2]))
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
