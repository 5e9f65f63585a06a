#!/usr/bin/env python3
"""Methods side by side on the same files, scored on runs that none of them saw.

  side_by_side.py BUILD DATA OUT [CASE...] [--without-sindy]

BUILD is a build folder with upright, grey_box_fit and diagnosis_matrix; DATA holds the folders emps and aau; OUT keeps
models and diagnoses, and what it holds is not computed again. scripts/side-by-side.sh makes the environment for it.
Prints Markdown.
"""
import argparse
import copy
import dataclasses
import json
import math
import pathlib

import yaml

import equations
import inverse_model
import record
import rigs
import scorer
import sindy
import upright_program
from rigs import real_data

CUTOFFS_HZ = (5.0, 10.0, 20.0, 50.0)
# Steps of the ladder of plain regression: how many of the terms, in order.
LADDER = (("mass", 0), ("and viscous", 1), ("and Coulomb", 2), ("and constant", 3), ("and asymmetric or quadratic", 4))
TEXTBOOK_TERMS = 3
# Simulated cases of tests/bench/diagnosis_matrix: one seed, one number after the other, so that none is chosen.
SIMULATED = (("coulomb_friction", 0), ("quadratic_drag", 1), ("motor_lag", 2))
SEED = 2026
# What a user would start from who knows which effect is missing, but not how large it is: its order of magnitude.
GUESSES = {"coulomb_friction": {"force_n": 0.1}, "quadratic_drag": {"coefficient_n_per_mps2": 1.0},
           "motor_lag": {"time_constant_s": 0.005}, "viscous_asymmetry": {"difference_n_per_mps": -10.0}}


@dataclasses.dataclass
class Case:
    name: str
    plant: pathlib.Path
    data: dict  # name: file
    held_out: list
    horizon_s: float
    whole: bool  # whether whole records can be simulated
    extra: str  # the effect that one who knows the answer adds to the textbook structure
    truth: pathlib.Path | None = None

    def trained_on(self):
        return [name for name in self.data if name not in self.held_out]


def real_case(name, data, folder, trained, held_out, extra):
    rig = rigs.RIGS[name](data)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "plant.yaml").write_text(rig.plant)
    files = {}
    for run in trained + held_out:
        files[run] = folder / f"{run}.yaml"
        files[run].write_text(rig.runs[run])
    return Case(name, folder / "plant.yaml", files, held_out, rig.horizon_s, True, extra)


def simulated_case(build, kind, number, folder):
    if not (folder / "truth.yaml").exists():
        upright_program.run([build / "tests/bench/diagnosis_matrix", "--case", number, "--only", kind, "--size", "typical",
                             "--disturbed", "--seed", SEED, "--keep", folder, "--data-only"])
    files = {file.stem: file for file in sorted(folder.glob("run*.csv"))}
    about = json.loads((folder / "case.json").read_text())
    balances = "balance" in about["experiments"]
    held_out = list(files)[-max(1, len(files) // 3):]
    return Case(f"simulated, {kind}", folder / "believed.yaml", files, held_out, 0.5 if balances else 2.0, not balances,
                kind, folder / "truth.yaml")


class Bench:
    def __init__(self, build, folder, case):
        self.upright, self.grey_box_fit = build / "src/cli/upright", build / "studies/comparison/grey_box_fit"
        self.folder, self.case = folder, case
        self.records = {name: record.read(self.upright, case.plant, file) for name, file in case.data.items()}
        self.horizons = (case.horizon_s, None) if case.whole else (case.horizon_s,)

    def score(self, plant_file, name, horizon_s):
        return scorer.score_plant(self.upright, plant_file, self.case.data[name], self.records[name], horizon_s)

    def training_score(self, plant_file):
        return scorer.mean_log([self.score(plant_file, name, horizon)
                                for name in self.case.trained_on() for horizon in self.horizons])

    def start(self):
        return yaml.safe_load(self.case.plant.read_text())["plant"]

    def write(self, name, plant):
        file = self.folder / f"{name}.yaml"
        file.write_text(yaml.safe_dump({"plant": plant}))
        return file

    def regression(self, count):
        """With the first terms of the ladder; the cut-off that simulates the training runs best."""
        records = [self.records[name] for name in self.case.trained_on()]
        files = [self.write(f"regression-{count}-{cutoff:g}hz",
                            inverse_model.fit(records, self.start(), inverse_model.CART_TERMS[:count],
                                              inverse_model.PENDULUM_TERMS[:count], cutoff)) for cutoff in CUTOFFS_HZ]
        return min(files, key=self.training_score)

    def grey_box(self, name, plant):
        """All numbers of `plant` free, from whole records or pieces, with free or fixed initial states."""
        free = ["cart_mass_kg"] + (["pendulum.inertia_about_pivot_kgm2"] if "pendulum" in plant else [])
        free += [f"{effect['kind']}.{number}" for effect in plant["effects"] for number in effect if number != "kind"]
        start, files = self.write(f"{name}-start", plant), []
        for horizon in self.horizons:
            for fixed in (False, True):
                out = self.folder / f"{name}-{horizon or 'whole'}-{'fixed' if fixed else 'free'}.yaml"
                command = [self.grey_box_fit, start, "--out", out, "--free", *free, "--data",
                           *(self.case.data[run] for run in self.case.trained_on())]
                command += ["--horizon", horizon] if horizon else []
                upright_program.run(command + (["--fixed-starts"] if fixed else []))
                files.append(out)
        return min(files, key=self.training_score)


def textbook_start(bench):
    """The regression's numbers, none of them 0."""
    plant = yaml.safe_load(bench.regression(TEXTBOOK_TERMS).read_text())["plant"]
    least = {"coefficient_n_per_mps": 0.1, "force_n": 0.05, "torque_nm": 1e-4, "coefficient_nms_per_rad": 1e-5,
             "offset_rad": 1e-3}
    for effect in plant["effects"]:
        for number, value in effect.items():
            if number != "kind" and abs(value) < least[number]:
                effect[number] = least[number]
    return plant


def with_effect(plant, kind):
    plant = copy.deepcopy(plant)
    if all(effect["kind"] != kind for effect in plant["effects"]):
        plant["effects"].append({"kind": kind, **GUESSES[kind]})
    return plant


@dataclasses.dataclass
class Row:
    method: str
    knows: str
    scores: dict  # (run, horizon): {channel: value}
    seconds: float  # of processor time, to choose and fit
    found: str = ""


def plant_rows(bench):
    case = bench.case

    def row(method, knows, make):
        start = upright_program.processor_seconds()
        file = make()
        seconds = upright_program.processor_seconds() - start
        scores = {(name, horizon): bench.score(file, name, horizon) for name in case.held_out for horizon in bench.horizons}
        found = yaml.safe_load(file.read_text())["plant"]
        return Row(method, knows, scores, seconds, in_words(found))

    yield row("plant file", "its own numbers", lambda: case.plant)
    for step, count in LADDER:
        yield row(f"regression, {step}", "these terms", lambda count=count: bench.regression(count))
    yield row("grey box, textbook", "the terms up to constant", lambda: bench.grey_box("grey-textbook", textbook_start(bench)))
    knows = "which effect is hidden" if case.truth else "what the authors suspect"
    told = with_effect(bench.start() if case.truth else textbook_start(bench), case.extra)
    yield row(f"grey box, {case.extra}", knows, lambda: bench.grey_box("grey-told", told))
    diagnosis = bench.folder / "diagnosis"
    upright_program.diagnose(bench.upright, case.plant, [case.data[name] for name in case.trained_on()], diagnosis)
    found = row("upright diagnose", "the plant file, all effects of the program", lambda: diagnosis / "model.yaml")
    found.seconds = upright_program.seconds_of(diagnosis)
    yield found
    if case.truth:
        yield row("the truth", "everything", lambda: case.truth)


def sindy_row(bench):
    case = bench.case
    start = upright_program.processor_seconds()
    model, tried = sindy.fit([bench.records[name] for name in case.trained_on()], case.horizon_s, case.whole)
    seconds = upright_program.processor_seconds() - start
    scores = {(name, horizon): equations.score_equations(model.equations(), bench.records[name], horizon)
              for name in case.held_out for horizon in bench.horizons}
    return Row("PySINDy", "a library of functions", scores, seconds,
               f"{model.settings} (best of {tried}): {model.in_words()}")


def in_words(plant):
    parts = [f"M {plant['cart_mass_kg']:.4g}"]
    for effect in plant["effects"]:
        if effect["kind"] == "force_table":
            forces = [value for key, value in effect.items() if key.startswith("force_")]
            parts.append(real_data.curve_in_words(effect["over"], effect["from"], effect["to"], forces))
            continue
        numbers = [value for key, value in effect.items() if key != "kind"]
        parts.append(f"{effect['kind']} " + ", ".join(f"{x:.4g}" if isinstance(x, float) else str(x) for x in numbers))
    return "; ".join(parts)


def over_runs(row, case, horizon, channel):
    """Root mean square over the held-out runs."""
    values = [row.scores[name, horizon][channel] for name in case.held_out]
    return scorer.in_text(math.sqrt(sum(value**2 for value in values) / len(values)), channel)


def print_case(bench, rows):
    case = bench.case
    channels = scorer.channels_of(next(iter(bench.records.values())))
    print(f"### {case.name}\n")
    print(f"Fitted to {', '.join(case.trained_on())}; scored on {', '.join(case.held_out)}.\n")
    titles = [(f"{'whole' if horizon is None else f'{horizon:g} s'} [{scorer.UNIT[channel]}]", horizon, channel)
              for horizon in reversed(bench.horizons) for channel in channels]
    print("| method | knows beforehand | " + " | ".join(title for title, _, _ in titles) + " | CPU seconds |")
    print("|---|---|" + "---|" * len(titles) + "---|")
    for row in rows:
        cells = [over_runs(row, case, horizon, channel) for _, horizon, channel in titles]
        print(f"| {row.method} | {row.knows} | " + " | ".join(cells) + f" | {row.seconds:.1f} |")
    print("\n| method | model |\n|---|---|")
    for row in rows[1:]:
        print(f"| {row.method} | {row.found.replace('|', chr(92) + '|')} |")
    print(flush=True)


def cases_of(build, data, out):
    yield "emps", lambda: real_case("emps", data, out / "emps", ["first-half"], ["second-half"], "viscous_asymmetry")
    yield "aau-cart", lambda: real_case("aau-cart", data, out / "aau-cart", ["0m10", "0m30", "0m50"],
                                        ["0m11", "0m20", "0m60"], "viscous_asymmetry")
    for kind, number in SIMULATED:
        yield kind, lambda kind=kind, number=number: simulated_case(build, kind, number, out / kind)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("cases", nargs="*", metavar="CASE")
    parser.add_argument("--without-sindy", action="store_true", help="leave out the method that takes minutes")
    given = parser.parse_args()
    build, out = given.build.resolve(), given.out.resolve()
    cases = dict(cases_of(build, given.data.resolve(), out))
    unknown = [name for name in given.cases if name not in cases]
    if unknown:
        parser.error(f"there is no case {unknown[0]}: choose from {', '.join(cases)}")
    for name in given.cases or cases:
        (out / name).mkdir(parents=True, exist_ok=True)
        bench = Bench(build, out / name, cases[name]())
        print_case(bench, [*plant_rows(bench), *([] if given.without_sindy else [sindy_row(bench)])])


if __name__ == "__main__":
    main()
