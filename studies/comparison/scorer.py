"""The scorer: root mean square of simulated minus measured, over whole records and over pieces.

Whole record: open loop from the position and velocity that fit the first 20 samples best (the protocol of the nonlinear
benchmarks). Pieces: each from the state that fits the whole piece best, so that noise of the initial state does not
count. A plant file is simulated by `upright simulate`, which has this protocol.
"""
import json
import math

from upright_program import run

FIRST_SAMPLES = 20
# Pieces that are a little shorter, by jitter or at the end of a record, count too.
SHARE_OF_PIECE = 0.95


def samples_of_piece(horizon_s, period_s):
    return max(FIRST_SAMPLES, math.floor(SHARE_OF_PIECE * horizon_s / period_s))


def channels_of(record):
    return [name for name, values in (("cart", record.cart_m), ("theta", record.theta_rad)) if values is not None]


def score_plant(upright, plant_file, dataset, record, horizon_s=None):
    """{"cart": metres, "theta": radians} of the channels that are there; `horizon_s` None: the whole record.

    Infinite where the program cannot simulate the plant, for example one whose numbers are out of range."""
    command = [upright, "simulate", plant_file, "--data", dataset, "--json"]
    if horizon_s is not None:
        command += ["--horizon", horizon_s, "--initial-samples", samples_of_piece(horizon_s, record.period_s())]
    try:
        text = run(command)
    except RuntimeError:
        return {channel: math.inf for channel in channels_of(record)}
    found = json.loads(text)["runs"][0]
    keys = {"cart": "cart_rmse_m", "theta": "theta_rmse_rad"}
    values = {channel: found[keys[channel]] for channel in channels_of(record)}
    return {channel: math.inf if value is None else value for channel, value in values.items()}


def mean_log(scores):
    """One number for the choice of settings on training runs: the mean logarithm of all scores."""
    values = [math.log(value) if value > 0.0 else -math.inf for score in scores for value in score.values()]
    return sum(values) / len(values)


def in_text(value, channel):
    """In mm or mrad."""
    if not math.isfinite(value):
        return "fails"
    return f"{1e3 * value:.3g}" if value < 10.0 else f"{1e3 * value:.1e}"


UNIT = {"cart": "mm", "theta": "mrad"}
