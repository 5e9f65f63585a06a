"""A measured run as the program reads it: SI units, unfolded angles, the pieces of its simulation."""
import csv
import dataclasses
import pathlib
import tempfile

import numpy as np

from upright_program import run


@dataclasses.dataclass(frozen=True)
class Record:
    time_s: np.ndarray
    voltage_v: np.ndarray  # held until the next sample
    cart_m: np.ndarray | None  # None: the cart was held
    theta_rad: np.ndarray | None

    def period_s(self):
        return float(np.median(np.diff(self.time_s)))

    def part(self, first, end):
        def cut(values):
            return None if values is None else values[first:end]

        return Record(self.time_s[first:end], self.voltage_v[first:end], cut(self.cart_m), cut(self.theta_rad))

    def uniform(self):
        """The same at equidistant times: what filters of samples need."""
        period = self.period_s()
        time = np.arange(self.time_s[0], self.time_s[-1] + 0.5 * period, period)

        def between(values):
            return None if values is None else np.interp(time, self.time_s, values)

        held = np.clip(np.searchsorted(self.time_s, time + 0.5 * period, side="right") - 1, 0, None)
        return Record(time, self.voltage_v[held], between(self.cart_m), between(self.theta_rad))


def column(rows, name):
    values = [row[name] for row in rows]
    return np.array(values, dtype=float) if all(values) else None


def read(upright, plant_file, dataset):
    """By `upright simulate`, which writes what it read beside what it simulated."""
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "simulated"
        run([upright, "simulate", plant_file, "--data", dataset, "--out", out])
        with open(out / "simulated.csv", newline="") as file:
            rows = list(csv.DictReader(file))
    locked = column(rows, "simulated_cart_m") is None
    voltage = column(rows, "voltage_v")
    return Record(column(rows, "time_s"), np.zeros(len(rows)) if voltage is None else voltage,
                  None if locked else column(rows, "cart_m"), column(rows, "theta_rad"))
