#!/usr/bin/env python3
"""Cross tables: models from each run of a rig, scored on each other run of that rig.

  cross_tables.py UPRIGHT DATA OUT [RIG...]

DATA holds the folders emps, aau, uw and canterbury; OUT keeps plant files, dataset files and diagnoses, which are not
computed again. Each model is beside the plant file it started from and a plain regression. scripts/cross-tables.sh
makes the environment for it. Prints Markdown.
"""
import argparse
import dataclasses
import itertools
import pathlib
import sys

import yaml

import inverse_model
import record
import rigs
import scorer
import upright_program
from rigs import real_data

# The textbook terms of a regression. The cut-off of its filters is chosen on the training runs.
CART_TERMS = ("viscous", "coulomb", "constant")
PENDULUM_TERMS = ("viscous", "coulomb", "offset")
CUTOFFS_HZ = (5.0, 10.0, 20.0, 50.0)


@dataclasses.dataclass
class Bench:
    """One rig with its files."""
    upright: str
    folder: pathlib.Path
    rig: rigs.Rig

    def __post_init__(self):
        self.folder.mkdir(parents=True, exist_ok=True)
        self.plant = self.folder / "plant.yaml"
        self.plant.write_text(self.rig.plant)
        self.data = {name: self.folder / f"{name}.yaml" for name in self.rig.runs}
        for name, text in self.rig.runs.items():
            self.data[name].write_text(text)
        self.records = {name: record.read(self.upright, self.plant, file) for name, file in self.data.items()}

    def score(self, plant_file, name, horizon_s):
        return scorer.score_plant(self.upright, plant_file, self.data[name], self.records[name], horizon_s)

    def regression(self, model):
        """The plant file of the regression whose cut-off simulates its own runs best in pieces."""
        start = yaml.safe_load(self.rig.plant)["plant"]
        names = self.rig.trained_on[model]
        best = None
        for cutoff in CUTOFFS_HZ:
            plant = inverse_model.fit([self.records[name] for name in names], start, CART_TERMS, PENDULUM_TERMS, cutoff)
            file = self.folder / f"regression-{model}-{cutoff:g}hz.yaml"
            file.write_text(yaml.safe_dump({"plant": plant}))
            value = scorer.mean_log([self.score(file, name, self.rig.horizon_s) for name in names])
            if best is None or value < best[0]:
                best = (value, file)
        return best[1]

    def diagnosis(self, model):
        names = self.rig.trained_on[model]
        folder = self.folder / f"model-{model}"
        others = [self.data[name] for name in self.data if name not in names]
        found = upright_program.diagnose(self.upright, self.plant, [self.data[name] for name in names], folder, others)
        return found, folder


def score_rows(bench, models, horizon_s, names):
    """(name of the model, runs it was made from, {run: scores}), the plant file first."""
    return [(name, trained, {run: bench.score(file, run, horizon_s) for run in names})
            for name, trained, file in models]


def print_scores(rows, names, channel):
    plant = rows[0][2]
    print(f"| model, RMS error in {scorer.UNIT[channel]} on | " + " | ".join(names) + " |")
    print("|---|" + "---|" * len(names))
    for model, trained, scores in rows:
        cells = []
        for name in names:
            value = scores[name].get(channel)
            if value is None:
                cells.append("")
                continue
            text = scorer.in_text(value, channel)
            if name in trained:
                text = f"*{text}*"
            elif value > plant[name][channel] and model != "plant file":
                text = f"**{text}**"
            cells.append(text)
        print(f"| {model} | " + " | ".join(cells) + " |")
    print()


def print_named(found):
    print("| from | verdict | named, with 95 % intervals | numbers of the file, fitted | helps here only | CPU seconds |")
    print("|---|---|---|---|---|---|")
    for model, (result, folder) in found.items():
        named = "; ".join(real_data.in_words(effect) for effect in result["effects"]) or "nothing"
        numbers = "; ".join(f"{n['number']} {n['fitted']:.4g}" for n in result["numbers"])
        here_only = ", ".join(effect["kind"] for effect in result["helps_here_only"])
        print(f"| {model} | {result['verdict']} | {named} | {numbers} | {here_only} |"
              f" {upright_program.seconds_of(folder):.0f} |")
    print()


def print_agreement(found, trained_on):
    """Which models name an effect, and how many pairs of intervals from disjoint data overlap."""
    by_kind = {}
    for model, (result, _) in found.items():
        for effect in result["effects"]:
            by_kind.setdefault(effect["kind"], {})[model] = effect["parameters"]
    print("| effect | named from | intervals from disjoint runs that overlap |")
    print("|---|---|---|")
    for kind, models in by_kind.items():
        pairs = [(a, b) for a, b in itertools.combinations(models, 2)
                 if not rigs.share_data(trained_on[a], trained_on[b])]
        shares = []
        # The nodes of two force tables lie at different places, so their intervals are not compared.
        comparable = pairs and kind != "force_table"
        for name in next(iter(models.values())) if comparable else []:
            intervals = [(models[a][name]["ci95"], models[b][name]["ci95"]) for a, b in pairs]
            overlapping = sum(a[0] <= b[1] and b[0] <= a[1] for a, b in intervals)
            shares.append(f"{name} {overlapping} of {len(pairs)}")
        where = "all" if len(models) == len(found) else f"{', '.join(models)} ({len(models)} of {len(found)})"
        print(f"| {kind} | {where} | {'; '.join(shares)} |")
    print()


def print_rig(name, bench):
    found = {model: bench.diagnosis(model) for model in bench.rig.trained_on}
    models = [("plant file", [], bench.plant)]
    for model, trained in bench.rig.trained_on.items():
        models.append((f"regression, {model}", trained, bench.regression(model)))
        models.append((f"diagnosis, {model}", trained, found[model][1] / "model.yaml"))
    runs = list(bench.rig.runs)
    print(f"### {name}\n")
    for title, horizon, names in ((f"Pieces of {bench.rig.horizon_s:g} s:", bench.rig.horizon_s, runs),
                                  ("Whole records, open loop:", None,
                                   [run for run in runs if run not in bench.rig.falls])):
        if not names:
            continue
        print(f"{title}\n")
        rows = score_rows(bench, models, horizon, names)
        for channel in ("cart", "theta"):
            measured = [run for run in names if channel in rows[0][2][run]]
            if measured:
                print_scores(rows, measured, channel)
    print_named(found)
    print_agreement(found, bench.rig.trained_on)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("upright", type=pathlib.Path)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("rigs", nargs="*", metavar="RIG", help=", ".join(rigs.RIGS))
    given = parser.parse_args()
    unknown = [name for name in given.rigs if name not in rigs.RIGS]
    if unknown:
        parser.error(f"there is no rig {unknown[0]}: choose from {', '.join(rigs.RIGS)}")
    for name in given.rigs or rigs.RIGS:
        bench = Bench(str(given.upright.resolve()), given.out.resolve() / name, rigs.RIGS[name](given.data.resolve()))
        print_rig(name, bench)
        sys.stdout.flush()


if __name__ == "__main__":
    main()
