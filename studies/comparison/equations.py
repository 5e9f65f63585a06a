"""Simulation of accelerations that are given as formulas, in many pieces side by side, and their score.

The scorer of models that are no plant files: pieces, initial states and error are those of `upright simulate`
(scorer.py). comparison_test compares the two on the same model.
"""
import numpy as np

import scorer

STEP_S = 2e-3  # no longer steps of Runge-Kutta
ITERATIONS = 3  # of Gauss-Newton for initial states: the problem is nearly linear


class Equations:
    """State: position and velocity of each channel. `accelerations(position, velocity, direction, voltage)` takes and
    gives one row for each channel; `direction` stands where a formula has the sign of a velocity."""

    def __init__(self, accelerations, channels, has_sign):
        self.accelerations = accelerations
        self.channels = channels
        self.has_sign = np.array(has_sign)  # for each channel: whether dry friction can hold it

    def directions(self, q, v, u):
        """The signs of the velocities; at rest those of the motion that begins, and 0 where friction holds."""
        direction = np.sign(v)
        for channel in np.flatnonzero(self.has_sign):
            rest = v[channel] == 0.0
            if not rest.any():
                continue
            ahead, back = direction.copy(), direction.copy()
            ahead[channel], back[channel] = 1.0, -1.0
            starts = self.accelerations(q, v, ahead, u)[channel] > 0.0
            returns = self.accelerations(q, v, back, u)[channel] < 0.0
            direction[channel] = np.where(rest, np.where(starts, 1.0, np.where(returns, -1.0, 0.0)), direction[channel])
        return direction

    def runge_kutta(self, q, v, direction, u, h):
        held = self.has_sign[:, None] & (direction == 0.0)

        def rate(q, v):
            return np.where(held, 0.0, self.accelerations(q, v, direction, u))

        a1 = rate(q, v)
        v2 = v + 0.5 * h * a1
        a2 = rate(q + 0.5 * h * v, v2)
        v3 = v + 0.5 * h * a2
        a3 = rate(q + 0.5 * h * v2, v3)
        v4 = v + h * a3
        a4 = rate(q + h * v3, v4)
        return (q + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4))

    def step(self, q, v, u, h):
        """Dry friction ends a motion at rest, at the time when its velocity is zero; from there on, either it holds or
        the motion returns. One such reversal in a step."""
        direction = self.directions(q, v, u)
        new_q, new_v = self.runge_kutta(q, v, direction, u, h)
        turned = self.has_sign[:, None] & (new_v * direction < 0.0)
        if not turned.any():
            return new_q, new_v
        share = np.where(turned, v / np.where(turned, v - new_v, 1.0), 1.0).min(axis=0)
        mid_q, mid_v = self.runge_kutta(q, v, direction, u, share * h)
        mid_v = np.where(turned & (np.abs(mid_v) <= np.abs(new_v)), 0.0, mid_v)
        return self.runge_kutta(mid_q, mid_v, self.directions(mid_q, mid_v, u), u, (1.0 - share) * h)

    def simulate(self, starts, time_s, voltage_v):
        """Positions [samples, channels, pieces]; `starts` [2 channels, pieces], the others [samples, pieces]."""
        count = len(self.channels)
        q, v = starts[:count].copy(), starts[count:].copy()
        shown = np.empty((len(time_s), *q.shape))
        shown[0] = q
        with np.errstate(all="ignore"):  # a bad model may run away: its score says so
            for k in range(1, len(time_s)):
                span = time_s[k] - time_s[k - 1]
                parts = max(1, int(np.ceil(span.max() / STEP_S - 1e-9)))
                for _ in range(parts):
                    q, v = self.step(q, v, voltage_v[k - 1], span / parts)
                shown[k] = q
        return shown


def measured(record, channels):
    return np.array([record.cart_m if channel == "cart" else record.theta_rad for channel in channels])


def noise(values):
    """Standard deviation of white noise on a smooth signal, from fourth differences."""
    return max(np.std(np.diff(values, 4)) / np.sqrt(70.0), 1e-9)


def initial_states(equations, time_s, voltage_v, shown, scale):
    """Gauss-Newton from the line through the first samples. `shown`: measured [samples, channels, pieces]."""
    count, pieces = shown.shape[1:]
    first = min(scorer.FIRST_SAMPLES, len(time_s))
    slope = np.empty((count, pieces))
    for piece in range(pieces):
        slope[:, piece] = np.polyfit(time_s[:first, piece], shown[:first, :, piece], 1)[0]
    starts = np.concatenate([shown[0], slope])
    size = 2 * count
    step = np.concatenate([scale, scale / max(time_s[-1, 0] - time_s[0, 0], 1e-9)])
    for _ in range(ITERATIONS):
        # The state itself, then one perturbed state for each of its numbers.
        wide = np.tile(starts, size + 1)
        for i in range(size):
            wide[i, (i + 1) * pieces:(i + 2) * pieces] += step[i]
        found = equations.simulate(wide, np.tile(time_s, size + 1), np.tile(voltage_v, size + 1))
        found = found.reshape(len(time_s), count, size + 1, pieces) / scale[:, None, None]
        for piece in range(pieces):
            base = found[:, :, 0, piece]
            with np.errstate(all="ignore"):  # of models that run away
                off = (shown[:, :, piece] / scale - base).ravel()
                jacobian = np.stack([(found[:, :, i + 1, piece] - base).ravel() for i in range(size)], axis=1)
            if not (np.isfinite(jacobian).all() and np.isfinite(off).all()):
                continue
            starts[:, piece] += step * np.linalg.lstsq(jacobian, off, rcond=None)[0]
    return starts


def cut(record, horizon_s):
    """First and one past the last sample of each piece, as `upright simulate --horizon` cuts them."""
    time = record.time_s
    if horizon_s is None:
        return [(0, len(time))]
    slack = 0.01 * record.period_s()
    edges = np.searchsorted(time, np.arange(time[0], time[-1] + horizon_s, horizon_s) - slack)
    edges = np.append(edges[edges < len(time)], len(time))
    least = scorer.samples_of_piece(horizon_s, record.period_s())
    return [(a, b) for a, b in zip(edges[:-1], edges[1:]) if b - a >= least]


class Pieces:
    """Pieces of records side by side; a shorter one repeats its last sample."""

    def __init__(self, records, channels, horizon_s):
        spans = [(record, first, end) for record in records for first, end in cut(record, horizon_s)]
        longest = max(end - first for _, first, end in spans)

        def rows(values_of):
            return np.stack([values_of(record)[np.minimum(np.arange(first, first + longest), end - 1)]
                             for record, first, end in spans], axis=1)

        self.time_s = rows(lambda record: record.time_s)
        self.voltage_v = rows(lambda record: record.voltage_v)
        self.shown = np.stack([rows(lambda record, i=i: measured(record, channels)[i]) for i in range(len(channels))], axis=1)
        self.counted = np.array([np.arange(longest) < end - first for _, first, end in spans]).T
        self.noise = np.mean([[noise(values) for values in measured(record, channels)] for record in records], axis=0)


def score_together(equations, records, horizon_s=None):
    """As scorer.score_plant, over all samples of several records."""
    pieces = Pieces(records, equations.channels, horizon_s)
    until = scorer.FIRST_SAMPLES if horizon_s is None else len(pieces.time_s)
    starts = initial_states(equations, pieces.time_s[:until], pieces.voltage_v[:until], pieces.shown[:until], pieces.noise)
    off = equations.simulate(starts, pieces.time_s, pieces.voltage_v) - pieces.shown
    with np.errstate(all="ignore"):
        squares = (np.where(pieces.counted[:, None, :], off, 0.0) ** 2).sum(axis=(0, 2)) / pieces.counted.sum()
    errors = np.where(np.isfinite(squares), np.sqrt(squares), np.inf)
    return {channel: float(error) for channel, error in zip(equations.channels, errors)}


def score_equations(equations, record, horizon_s=None):
    return score_together(equations, [record], horizon_s)
