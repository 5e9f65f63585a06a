"""Plain regression: the force that a measured motion needs, by linear least squares on smoothed derivatives.

    cart       force_per_volt V - back_emf v - m l (cos th th'' - sin th th'^2) = M x'' + c v + Fc sgn(v) - F0 + d |v|
    pendulum   th'' = (g sin th - cos th x'') / L - c w - Tc sgn(w) + offset cos th - q w |w|

Positions pass a Butterworth low-pass forward and backward; force and regressors pass the same one, as in the
identification of robots (IDIM-LS: Gautier, Janot and others). Friction, drag and masses are kept positive by bounds.
"""
import copy

import numpy as np
import scipy.optimize
import scipy.signal

CART_TERMS = ("viscous", "coulomb", "constant", "asymmetry")
PENDULUM_TERMS = ("viscous", "coulomb", "offset", "quadratic")
FILTER_ORDER = 4
# A velocity below this share of the fast ones has no certain sign: the filters smear every reversal.
SLOW_SHARE = 0.02


class Smoother:
    def __init__(self, period_s, cutoff_hz):
        self.period_s = period_s
        highest = 0.45 / period_s
        self.sections = scipy.signal.butter(FILTER_ORDER, min(cutoff_hz, highest), fs=1.0 / period_s, output="sos")
        # What the ends of a record disturb.
        self.edge = int(round(1.0 / (min(cutoff_hz, highest) * period_s)))

    def __call__(self, values):
        return scipy.signal.sosfiltfilt(self.sections, values)

    def derivatives(self, values):
        """Position, velocity and acceleration."""
        smooth = self(values)
        velocity = np.gradient(smooth, self.period_s)
        return smooth, velocity, np.gradient(velocity, self.period_s)


def sure(velocity):
    return np.abs(velocity) >= SLOW_SHARE * np.percentile(np.abs(velocity), 95.0)


def solve(columns, sides, bounded):
    """Least squares over all runs. `bounded`: for each unknown whether it must not be negative."""
    matrix = np.vstack(columns)
    size = np.linalg.norm(matrix, axis=0)
    size[size == 0.0] = 1.0
    lower = np.where(bounded, 0.0, -np.inf)
    found = scipy.optimize.lsq_linear(matrix / size, np.concatenate(sides), (lower, np.full(len(size), np.inf)))
    return found.x / size


def cart_equation(record, plant, terms, cutoff_hz):
    record = record.uniform()
    smooth = Smoother(record.period_s(), cutoff_hz)
    _, v, a = smooth.derivatives(record.cart_m)
    motor = plant["motor"]
    # The voltage before and the voltage after a sample act on the two halves of its second difference.
    acting_v = 0.5 * (record.voltage_v + np.concatenate(([0.0], record.voltage_v[:-1])))
    force = motor["force_per_volt_n"] * smooth(acting_v) - motor["back_emf_n_per_mps"] * v
    if record.theta_rad is not None:
        pendulum = plant["pendulum"]
        angle, rate, acceleration = smooth.derivatives(record.theta_rad)
        reaction = np.cos(angle) * acceleration - np.sin(angle) * rate**2
        force -= pendulum["mass_kg"] * pendulum["length_to_com_m"] * reaction
    columns = {"viscous": v, "coulomb": np.sign(v), "constant": -np.ones_like(v), "asymmetry": np.abs(v)}
    matrix = np.column_stack([smooth(a)] + [smooth(columns[term]) for term in terms])
    rows = slice(smooth.edge, len(v) - smooth.edge)
    keep = sure(v)[rows]
    return matrix[rows][keep], smooth(force)[rows][keep]


def pendulum_equation(record, plant, terms, cutoff_hz):
    record = record.uniform()
    smooth = Smoother(record.period_s(), cutoff_hz)
    angle, w, acceleration = smooth.derivatives(record.theta_rad)
    drive = plant["gravity_mps2"] * np.sin(angle)
    if record.cart_m is not None:
        drive = drive - np.cos(angle) * smooth.derivatives(record.cart_m)[2]
    columns = {"viscous": -w, "coulomb": -np.sign(w), "offset": np.cos(angle), "quadratic": -w * np.abs(w)}
    matrix = np.column_stack([smooth(drive)] + [smooth(columns[term]) for term in terms])
    rows = slice(smooth.edge, len(w) - smooth.edge)
    keep = sure(w)[rows]
    return matrix[rows][keep], smooth(acceleration)[rows][keep]


def set_effect(plant, kind, **values):
    plant["effects"] = [effect for effect in plant["effects"] if effect["kind"] != kind]
    plant["effects"].append({"kind": kind, **{name: float(value) for name, value in values.items()}})


def with_cart(plant, terms, found):
    pendulum = plant.get("pendulum", {"mass_kg": 0.0})
    plant["cart_mass_kg"] = float(max(found[0] - pendulum["mass_kg"], 0.01 * plant["cart_mass_kg"]))
    for term, value in zip(terms, found[1:]):
        if term == "viscous":
            set_effect(plant, "viscous_friction", coefficient_n_per_mps=value)
        elif term == "coulomb":
            set_effect(plant, "coulomb_friction", force_n=value)
        elif term == "constant":
            set_effect(plant, "constant_force", force_n=value)
        else:
            set_effect(plant, "viscous_asymmetry", difference_n_per_mps=value)


def with_pendulum(plant, terms, found):
    pendulum = plant["pendulum"]
    inertia = pendulum["mass_kg"] * pendulum["length_to_com_m"] / found[0]
    pendulum["inertia_about_pivot_kgm2"] = float(inertia)
    for term, value in zip(terms, found[1:]):
        if term == "viscous":
            set_effect(plant, "pivot_viscous_friction", coefficient_nms_per_rad=inertia * value)
        elif term == "coulomb":
            set_effect(plant, "pivot_coulomb_friction", torque_nm=inertia * value)
        elif term == "quadratic":
            set_effect(plant, "pivot_quadratic_drag", coefficient_nms2_per_rad2=inertia * value)
        else:  # sin(th - o) is sin th - o cos th
            set_effect(plant, "angle_offset", offset_rad=-value / (found[0] * plant["gravity_mps2"]))


def free_effects(plant, kinds):
    """Without the effects that a fit replaces."""
    plant["effects"] = [effect for effect in plant["effects"] if effect["kind"] not in kinds]


def fit(records, plant, cart_terms, pendulum_terms, cutoff_hz):
    """A plant (the content of the key `plant`) with the numbers that fit `records`."""
    plant = copy.deepcopy(plant)
    carts = [record for record in records if record.cart_m is not None]
    if carts:
        free_effects(plant, ("viscous_friction",))
        rows = [cart_equation(record, plant, cart_terms, cutoff_hz) for record in carts]
        bounded = [True] + [term in ("viscous", "coulomb") for term in cart_terms]
        with_cart(plant, cart_terms, solve(*zip(*rows), bounded))
    pendulums = [record for record in records if record.theta_rad is not None]
    if pendulums:
        free_effects(plant, ("pivot_viscous_friction",))
        rows = [pendulum_equation(record, plant, pendulum_terms, cutoff_hz) for record in pendulums]
        bounded = [True] + [term != "offset" for term in pendulum_terms]
        with_pendulum(plant, pendulum_terms, solve(*zip(*rows), bounded))
    return plant
