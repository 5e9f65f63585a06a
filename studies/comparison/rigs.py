"""The rigs of other laboratories with several runs, and halves of the records of which there is only one.

Plant files and their sources are those of scripts/real_data.py.
"""
import dataclasses
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))
import real_data  # noqa: E402


@dataclasses.dataclass(frozen=True)
class Rig:
    plant: str  # the text of the plant file that a diagnosis starts from
    runs: dict  # name: text of a dataset file
    horizon_s: float  # length of the pieces in which a model is simulated
    trained_on: dict  # name of a model: names of the runs from which it is made
    falls: tuple = ()  # runs with an upright pendulum: it falls in an open-loop simulation of the whole record


WHOLE = "whole"  # the record of which other runs are parts


def share_data(runs, others):
    """Whether two lists of runs have samples in common."""
    return bool(set(runs) & set(others)) or WHOLE in runs or WHOLE in others


def from_each(runs, **more):
    return {name: [name] for name in runs} | more


def emps(data):
    def part(**stretch):
        return real_data.dataset(data / "emps" / "DATA_EMPS.csv",
                                 {"time_s": "t_s", "cart_m": "qm_m", "voltage_v": "vir_V"}, **stretch)

    runs = {WHOLE: part(), "first-half": part(to_s=12.42), "second-half": part(from_s=12.42)}
    return Rig(real_data.EMPS_PLANT, runs, 2.0, from_each(runs))


def aau_cart(data):
    names = ["0m10", "0m11", "0m20", "0m30", "0m50", "0m60"]
    runs = dict(zip(names, real_data.aau_cart(data, names)))
    return Rig(real_data.AAU_CART_PLANT, runs, 2.0, from_each(names, three_places=["0m10", "0m30", "0m50"]))


def aau_pendulum(data):
    def decay(**stretch):
        return real_data.dataset(data / "aau" / "test1pend1.csv", {"time_s": 1, "theta_rad": 2}, header="false",
                                 cart_locked="true", **stretch)

    # The angle of swing1 is positive toward -x. Columns 2 and 5 are smoothed; 4 and 6 move in encoder steps. Column 12
    # is the current that was applied.
    swing = real_data.dataset(data / "aau" / "swing1.csv",
                              {"time_s": 1, "voltage_v": 12, "cart_m": 6, "theta_rad": "{column: 4, scale: -1}"},
                              header="false")
    runs = {"decay-early": decay(from_s=10, to_s=40), "decay-late": decay(from_s=40), "swing1": swing}
    return Rig(real_data.AAU_PENDULUM_PLANT, runs, 2.0, from_each(runs), falls=("swing1",))


def uw(data):
    def part(**stretch):
        return real_data.dataset(data / "uw" / "single_pendulum_free_swing.csv",
                                 {"time_s": "t_s", "theta_rad": "theta_rad"}, cart_locked="true", **stretch)

    runs = {"first-half": part(to_s=27.5), "second-half": part(from_s=27.5)}
    return Rig(real_data.UW_PLANT, runs, 2.0, from_each(runs))


def canterbury(data):
    def run(name, **stretch):
        return real_data.dataset(data / "canterbury" / f"{name}.csv", real_data.CANTERBURY_COLUMNS, **stretch)

    runs = {"csm102set1": run("csm102set1"), "csm102set3": run("csm102set3"), "adm101s2": run("adm101s2", to_s=5.6)}
    return Rig(real_data.CANTERBURY_PLANT, runs, 0.5, from_each(runs), falls=tuple(runs))


RIGS = {"emps": emps, "aau-cart": aau_cart, "aau-pendulum": aau_pendulum, "uw": uw, "canterbury": canterbury}
