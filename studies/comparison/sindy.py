"""PySINDy on measured runs: accelerations as sparse sums of a library of functions.

Everything that a user can choose is tried, and the model that simulates the training runs best is taken: the
differentiation (finite differences smoothed by Savitzky-Golay, Savitzky-Golay's own derivative, smoothing splines, a
low-pass forward and backward), its window, the library (small or large), the optimiser (STLSQ, SR3) and its threshold.
Kinematics are given: only the accelerations are sought. Features and accelerations are scaled to an RMS of 1, so that a
threshold is a share of the acceleration.
"""
import dataclasses
import warnings

import numpy as np
import pysindy

import equations
import scorer
from inverse_model import Smoother, sure

WINDOWS_S = (0.02, 0.05, 0.1, 0.2)
SPLINE_NOISES = (1.0, 30.0, 1000.0)  # smoothing, relative to the noise of the sensor
CUTOFFS_HZ = (5.0, 10.0, 20.0, 50.0)
THRESHOLDS = (0.0, 0.003, 0.01, 0.03, 0.1)
FEWEST_SAMPLES = 7  # of a window
FINALISTS = 8  # models that are scored on all training runs
TRIAL_SAMPLES = 6000  # of the training runs together, on which all are scored


# Libraries: expressions of positions q, velocities v, their signs d, and the voltage u. The small ones are their beginnings.
CART = {"1": "1.0", "V": "u", "v": "v[0]", "sgn v": "d[0]", "|v|": "np.abs(v[0])", "v|v|": "v[0] * np.abs(v[0])",
        "x": "q[0]"}
PENDULUM = {"1": "1.0", "V": "u", "v": "v[0]", "sgn v": "d[0]", "sin th": "np.sin(q[1])", "w": "v[1]", "sgn w": "d[1]",
            "sin th cos th": "0.5 * np.sin(2.0 * q[1])", "w^2 sin th": "v[1] * v[1] * np.sin(q[1])",
            "V cos th": "u * np.cos(q[1])", "v cos th": "v[0] * np.cos(q[1])", "sgn v cos th": "d[0] * np.cos(q[1])",
            "w cos th": "v[1] * np.cos(q[1])", "cos th": "np.cos(q[1])", "v|v|": "v[0] * np.abs(v[0])",
            "w|w|": "v[1] * np.abs(v[1])", "x": "q[0]"}
LIBRARIES = {("cart",): (CART, (4, 7)), ("cart", "theta"): (PENDULUM, (7, 13, 17))}
# The term that is the sign of a channel's own velocity.
SIGN_TERMS = ("sgn v", "sgn w")


@dataclasses.dataclass
class Model:
    terms: list  # for each channel {term: coefficient}
    settings: str
    channels: tuple

    def equations(self):
        """Compiled, since a simulation evaluates them 10,000 times."""
        library, _ = LIBRARIES[self.channels]
        sums = ["u * 0.0 + " + " + ".join(f"{c!r} * ({library[name]})" for name, c in terms.items())
                for terms in self.terms]
        accelerations = eval(f"lambda q, v, d, u: np.stack([{', '.join(sums)}])", {"np": np})
        has_sign = [SIGN_TERMS[i] in terms for i, terms in enumerate(self.terms)]
        return equations.Equations(accelerations, list(self.channels), has_sign)

    def key(self):
        """The support: unbiased coefficients follow from it and the differentiation."""
        return self.settings.split(",")[0], tuple(tuple(sorted(terms)) for terms in self.terms)

    def in_words(self):
        names = {"cart": "x''", "theta": "th''"}
        return "; ".join(f"{names[channel]} = " + " ".join(f"{c:+.3g} {name}" for name, c in terms.items())
                         for channel, terms in zip(self.channels, self.terms))


def by_pysindy(kind, **settings):
    method = pysindy.SINDyDerivative(kind=kind, **settings)
    return lambda values, time: method(values[:, None], time)[:, 0]


def smoothed_differences(samples):
    method = pysindy.SmoothedFiniteDifference(smoother_kws={"window_length": samples, "polyorder": 3})
    return lambda values, time: method(values[:, None], time)[:, 0]


def differentiations(record):
    """Name: a function of a channel's positions that gives position, velocity and acceleration."""
    period, time = record.period_s(), record.time_s

    def twice(method):
        def derivatives(values):
            velocity = method(values, time)
            return values, velocity, method(velocity, time)
        return derivatives

    found = {}
    for window in WINDOWS_S:
        samples = 2 * int(round(0.5 * window / period)) + 1
        if samples >= FEWEST_SAMPLES:
            found[f"smoothed differences {window:g} s"] = twice(smoothed_differences(samples))
            half = 0.5 * samples * period
            found[f"Savitzky-Golay {window:g} s"] = twice(by_pysindy("savitzky_golay", left=half, right=half, order=3))
    for factor in SPLINE_NOISES:
        found[f"spline {factor:g}"] = spline(factor, time)
    for cutoff in CUTOFFS_HZ:
        found[f"low-pass {cutoff:g} Hz"] = Smoother(period, cutoff).derivatives
    return found


def spline(factor, time):
    """Smoothed once; the acceleration is the second derivative of the same spline."""
    def derivatives(values):
        smoothing = factor * len(time) * equations.noise(values) ** 2
        velocity = by_pysindy("spline", s=smoothing)(values, time)
        return values, velocity, np.gradient(velocity, time)
    return derivatives


def samples_of(record, method_name, channels):
    """Positions, velocities, accelerations and voltage where they are not disturbed by the ends."""
    record = record.uniform()
    method = differentiations(record)[method_name]
    triples = [method(values) for values in equations.measured(record, channels)]
    voltage = 0.5 * (record.voltage_v + np.concatenate(([0.0], record.voltage_v[:-1])))
    edge = int(round(0.2 / record.period_s()))
    rows = slice(edge, len(voltage) - edge)
    q, v, a = (np.array([triple[i][rows] for triple in triples]) for i in range(3))
    keep = np.logical_and.reduce([sure(velocity) for velocity in v])
    return q[:, keep], v[:, keep], a[:, keep], voltage[rows][keep]


def optimisers():
    for threshold in THRESHOLDS:
        yield f"STLSQ {threshold:g}", pysindy.STLSQ(threshold=threshold, alpha=1e-6)
        if threshold > 0.0:  # SR3 with L0 keeps what is above sqrt(2 lam nu)
            yield f"SR3 {threshold:g}", pysindy.SR3(reg_weight_lam=0.5 * threshold**2, regularizer="L0",
                                                   relax_coeff_nu=1.0, unbias=True, max_iter=1000)


def models_of(records, method, channels):
    """Those of one differentiation, with every library, optimiser and threshold."""
    library, sizes = LIBRARIES[channels]
    parts = [samples_of(record, method, channels) for record in records]
    q, v, a, u = (np.concatenate([part[i] for part in parts], axis=-1) for i in range(4))
    known = {"np": np, "q": q, "v": v, "d": np.sign(v), "u": u}
    values = {name: np.broadcast_to(eval(text, known), u.shape) for name, text in library.items()}
    scale = {name: np.sqrt(np.mean(column**2)) for name, column in values.items()}
    target = np.sqrt(np.mean(a**2, axis=1))
    for size in sizes:
        names = list(values)[:size]
        columns = np.stack([values[name] / scale[name] for name in names], axis=1)
        # The library is evaluated above: PySINDy's takes it as it is. The states it differentiates are the accelerations.
        as_they_are = pysindy.PolynomialLibrary(degree=1, include_bias=False)
        for name, optimiser in optimisers():
            found = pysindy.SINDy(optimizer=optimiser, feature_library=as_they_are)
            state = np.zeros_like(columns)
            state[:, :len(channels)] = (a / target[:, None]).T
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of thresholds that leave nothing
                found.fit(columns, t=1.0, x_dot=state)
            rows = found.coefficients()[:len(channels)]
            terms = [{term: float(c * target[i] / scale[term]) for term, c in zip(names, row) if c != 0.0}
                     for i, row in enumerate(rows)]
            if all(terms):
                yield Model(terms, f"{method}, {size} functions, {name}", channels)


def fit(records, horizon_s, whole):
    """The best model on the training runs, and how many were tried."""
    channels = tuple(scorer.channels_of(records[0]))
    trials = [record.part(0, min(TRIAL_SAMPLES // len(records), len(record.time_s))) for record in records]
    scored = {}
    for method in differentiations(records[0].uniform()):
        for model in models_of(records, method, channels):
            if model.key() not in scored:
                score = equations.score_together(model.equations(), trials, horizon_s)
                scored[model.key()] = (scorer.mean_log([score]), model)
    best = sorted(scored.values(), key=lambda pair: pair[0])[:FINALISTS]

    def training_score(model):
        horizons = (horizon_s, None) if whole else (horizon_s,)
        return scorer.mean_log([equations.score_together(model.equations(), records, horizon) for horizon in horizons])

    return min((model for _, model in best), key=training_score), len(scored)
