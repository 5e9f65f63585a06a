"""The scorer and the methods of this folder on a record whose truth is known: comparison_test.py BUILD FOLDER."""
import os
import pathlib
import subprocess
import sys
import unittest

import numpy as np
import yaml

import equations
import inverse_model
import record
import scorer
import sindy
import upright_program

BUILD, FOLDER = (pathlib.Path(argument).resolve() for argument in sys.argv[1:3])
ROOT = pathlib.Path(__file__).resolve().parents[2]
UPRIGHT = BUILD / "src/cli/upright"
MASS_KG, VISCOUS, COULOMB_N, FORCE_PER_VOLT_N = 2.0, 5.0, 1.5, 3.0
STEP_M = 1e-5
FLOOR_M = STEP_M / np.sqrt(12.0)
HORIZON_S = 2.0
TERMS = ("viscous", "coulomb")


def truth(q, v, d, u):
    return (FORCE_PER_VOLT_N * u - VISCOUS * v - COULOMB_N * d) / MASS_KG


def plant_of(viscous, coulomb):
    effects = [{"kind": "viscous_friction", "coefficient_n_per_mps": viscous}]
    if coulomb > 0.0:
        effects.append({"kind": "coulomb_friction", "force_n": coulomb})
    return {"cart_mass_kg": MASS_KG, "gravity_mps2": 9.81, "effects": effects,
            "motor": {"force_per_volt_n": FORCE_PER_VOLT_N, "back_emf_n_per_mps": 0.0}}


def write(name, plant):
    file = FOLDER / f"{name}.yaml"
    file.write_text(yaml.safe_dump({"plant": plant}))
    return file


def make_record():
    """Steps of the voltage of both signs, 500 Hz, 12 s, seen by an encoder."""
    random = np.random.default_rng(7)
    time = np.arange(6000) / 500.0
    voltage = np.repeat(random.choice([-3.0, -1.5, 1.5, 3.0], size=24), 250)
    cart = equations.Equations(truth, ["cart"], [True]).simulate(np.zeros((2, 1)), time[:, None], voltage[:, None])[:, 0, 0]
    file = FOLDER / "record.csv"
    rows = np.column_stack([time, voltage, np.round(cart / STEP_M) * STEP_M])
    np.savetxt(file, rows, delimiter=",", header="time_s,voltage_v,cart_m", comments="", fmt="%.9g")
    return file


class ComparisonTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.data = make_record()
        cls.true_plant = write("truth", plant_of(VISCOUS, COULOMB_N))
        cls.record = record.read(UPRIGHT, cls.true_plant, cls.data)

    def score(self, file, horizon_s=HORIZON_S):
        return scorer.score_plant(UPRIGHT, file, self.data, self.record, horizon_s)["cart"]

    def assert_near(self, value, expected, share):
        self.assertLess(abs(value / expected - 1.0), share, f"{value} against {expected}")

    def test_truth_scores_at_the_noise_floor(self):
        self.assert_near(self.score(self.true_plant), FLOOR_M, 0.05)
        # The initial velocity of 20 quantised samples is a little off, and friction forgets it.
        self.assertLess(self.score(self.true_plant, None), 3.0 * FLOOR_M)

    def test_wrong_model_scores_worse(self):
        wrong = write("wrong", plant_of(VISCOUS, 0.0))
        for horizon in (HORIZON_S, None):
            self.assertGreater(self.score(wrong, horizon), 100.0 * self.score(self.true_plant, horizon))

    def assert_score_alike(self, viscous, coulomb, horizons):
        def formula(q, v, d, u):
            return (FORCE_PER_VOLT_N * u - viscous * v - coulomb * d) / MASS_KG

        file = write("alike", plant_of(viscous, coulomb))
        for horizon in horizons:
            by_formula = equations.score_equations(equations.Equations(formula, ["cart"], [True]), self.record, horizon)
            self.assert_near(by_formula["cart"], self.score(file, horizon), 0.02)

    def test_formulas_and_plant_files_score_alike(self):
        # The whole record of the true model shows the noise of 20 samples, which the program weighs in its own way.
        self.assert_score_alike(VISCOUS, COULOMB_N, (HORIZON_S,))
        self.assert_score_alike(0.8 * VISCOUS, 1.1 * COULOMB_N, (HORIZON_S, None))

    def test_plant_that_cannot_be_simulated_fails(self):
        self.assertEqual(self.score(write("negative", plant_of(-1.0, 0.0))), np.inf)

    def assert_is_truth(self, plant, share):
        numbers = {effect["kind"]: effect for effect in plant["effects"]}
        self.assert_near(plant["cart_mass_kg"], MASS_KG, share)
        self.assert_near(numbers["viscous_friction"]["coefficient_n_per_mps"], VISCOUS, share)
        self.assert_near(numbers["coulomb_friction"]["force_n"], COULOMB_N, share)

    def test_regression_finds_the_numbers(self):
        self.assert_is_truth(inverse_model.fit([self.record], plant_of(1.0, 0.0), TERMS, (), 50.0), 0.05)

    def test_grey_box_fit_finds_the_numbers(self):
        start, out = write("start", plant_of(0.5 * VISCOUS, 0.5 * COULOMB_N)), FOLDER / "fitted.yaml"
        upright_program.run([BUILD / "studies/comparison/grey_box_fit", start, "--data", self.data, "--out", out,
                             "--free", "cart_mass_kg", "viscous_friction.coefficient_n_per_mps",
                             "coulomb_friction.force_n"])
        self.assert_is_truth(yaml.safe_load(out.read_text())["plant"], 0.002)
        self.assert_near(self.score(out), FLOOR_M, 0.05)

    def test_sindy_finds_the_formula(self):
        for model in sindy.models_of([self.record], "low-pass 50 Hz", ("cart",)):
            if model.settings.endswith("4 functions, STLSQ 0.03"):
                break
        self.assertEqual(set(model.terms[0]), {"V", "v", "sgn v"})
        self.assert_near(model.terms[0]["V"], FORCE_PER_VOLT_N / MASS_KG, 0.05)
        self.assert_near(model.terms[0]["v"], -VISCOUS / MASS_KG, 0.05)
        self.assert_near(model.terms[0]["sgn v"], -COULOMB_N / MASS_KG, 0.05)


def run_script(name, *arguments):
    """A script of the pages, with this build and this Python."""
    environment = os.environ | {"UPRIGHT": str(UPRIGHT), "UPRIGHT_BUILD": str(BUILD),
                                "UPRIGHT_COMPARISON_VENV": str(pathlib.Path(sys.prefix))}
    done = subprocess.run([ROOT / name, *arguments], env=environment, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise AssertionError(done.stderr)
    return done.stdout


def make_free_swing(file):
    """A pendulum with dry friction from 1.2 rad off its rest, 100 Hz, 55 s: what the rig uw measures, but slower."""
    def swing(q, v, d, u):
        return 64.3 * np.sin(q) - 0.2 * d

    equation = equations.Equations(swing, ["theta"], [True])
    time = np.arange(5500) * 1e-2
    angle = equation.simulate(np.array([[np.pi - 1.2], [0.0]]), time[:, None], np.zeros((len(time), 1)))[:, 0, 0]
    file.parent.mkdir(parents=True)
    rows = np.column_stack([time, np.round(angle / 1e-4) * 1e-4])
    np.savetxt(file, rows, delimiter=",", header="t_s,theta_rad", comments="", fmt="%.9g")


class ScriptsTest(unittest.TestCase):
    def test_cross_tables_score_each_half_on_the_other(self):
        make_free_swing(FOLDER / "data/uw/single_pendulum_free_swing.csv")
        said = run_script("scripts/cross-tables.sh", FOLDER / "data", FOLDER / "crossed", "uw")
        rows = [line.split("|")[1:-1] for line in said.splitlines() if line.startswith(("| plant", "| diagnosis"))]
        pieces = {row[0].strip(): [float(cell.strip(" *")) for cell in row[1:]] for row in rows[:3]}
        for model in ("diagnosis, first-half", "diagnosis, second-half"):
            for found, given in zip(pieces[model], pieces["plant file"]):
                self.assertLess(found, 0.2 * given)
        self.assertIn("| pivot_coulomb_friction | all |", said)

    def test_side_by_side_ends_with_the_truth(self):
        said = run_script("scripts/side-by-side.sh", FOLDER, FOLDER / "sides", "coulomb_friction", "--without-sindy")
        scores = {row[0].strip(): float(row[2]) for row in (line.split("|")[1:-1] for line in said.splitlines())
                  if len(row) == 5 and row[0].strip() not in ("method", "---")}
        self.assertLess(scores["the truth"], 0.5 * scores["plant file"])
        self.assertLess(scores["upright diagnose"], 1.2 * scores["the truth"])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
