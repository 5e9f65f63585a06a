"""The same sampled loop in numba (RK4, three substeps) and scipy (solve_ivp RK45), one core: ms of CPU per run.

Smooth exponential friction, gain (7), 1 kHz, 10 s; the velocity filter as in velocity_estimator.hpp (first-order hold).
"""
import math
import sys
import time

import numba
import numpy as np
from scipy.integrate import solve_ivp
from scipy.signal import cont2discrete

M, MP, L, G, ALPHA, BETA = 0.815, 0.21, 0.305, 9.8, 1.7189, 7.682
EPS, FC, FE, VS, DELTA = 3.0, 0.4306291, 0.4342453, 0.105, 100.0
K = np.array([70.7107, 304.9273, 143.3152, 61.0833])
T, TICKS = 1e-3, 10000
W, Z = 2 * math.pi * 50, 0.9
AD, BD, CD, DD, _ = cont2discrete(
    (np.array([[0.0, 1.0], [-W * W, -2 * Z * W]]), np.array([[0.0], [W * W]]), np.array([[0.0, 1.0]]),
     np.array([[0.0]])), T, "foh")
BD, CD, DD = BD.ravel(), CD.ravel(), float(DD[0, 0])


@numba.njit
def rhs(x, th, v, w, u):
    level = FC + FE * math.exp(-(v / VS) * (v / VS))
    force = ALPHA * u - BETA * v - EPS * v - level * math.tanh(DELTA * v)
    s, c = math.sin(th), math.cos(th)
    push = force + MP * L * s * w * w
    turn = MP * L * G * s
    j = 4.0 / 3.0 * MP * L * L
    off = MP * L * c
    det = (M + MP) * j - off * off
    return v, w, (j * push - off * turn) / det, ((M + MP) * turn - off * push) / det


@numba.njit
def rk4(x, th, v, w, u, h):
    a1, b1, c1, d1 = rhs(x, th, v, w, u)
    a2, b2, c2, d2 = rhs(x + h / 2 * a1, th + h / 2 * b1, v + h / 2 * c1, w + h / 2 * d1, u)
    a3, b3, c3, d3 = rhs(x + h / 2 * a2, th + h / 2 * b2, v + h / 2 * c2, w + h / 2 * d2, u)
    a4, b4, c4, d4 = rhs(x + h * a3, th + h * b3, v + h * c3, w + h * d3, u)
    return (x + h / 6 * (a1 + 2 * (a2 + a3) + a4), th + h / 6 * (b1 + 2 * (b2 + b3) + b4),
            v + h / 6 * (c1 + 2 * (c2 + c3) + c4), w + h / 6 * (d1 + 2 * (d2 + d3) + d4))


@numba.njit
def run_numba(theta0, delay, ad, bd, cd, dd, k, ticks, pieces):
    x, th, v, w = 0.0, theta0, 0.0, 0.0
    s1, s2, g1, g2 = 0.0, 0.0, 0.0, 0.0  # the filters, at rest on the first sample
    ring = np.full(64, k[1] * theta0)
    for tick in range(ticks):
        dth = th - theta0
        vx = cd[0] * s1 + cd[1] * s2 + dd * x
        vt = cd[0] * g1 + cd[1] * g2 + dd * dth
        s1, s2 = ad[0, 0] * s1 + ad[0, 1] * s2 + bd[0] * x, ad[1, 0] * s1 + ad[1, 1] * s2 + bd[1] * x
        g1, g2 = ad[0, 0] * g1 + ad[0, 1] * g2 + bd[0] * dth, ad[1, 0] * g1 + ad[1, 1] * g2 + bd[1] * dth
        ring[tick % 64] = k[0] * x + k[1] * th + k[2] * vx + k[3] * vt
        u = ring[(tick - delay) % 64]
        for _ in range(pieces):
            x, th, v, w = rk4(x, th, v, w, u, 1e-3 / pieces)
    return th


def run_scipy(theta0, delay, ticks):
    y = np.array([0.0, theta0, 0.0, 0.0])
    s, g = np.zeros(2), np.zeros(2)
    ring = np.full(64, K[1] * theta0)
    for tick in range(ticks):
        x, dth = y[0], y[1] - theta0
        vx, vt = CD @ s + DD * x, CD @ g + DD * dth
        s, g = AD @ s + BD * x, AD @ g + BD * dth
        ring[tick % 64] = K[0] * y[0] + K[1] * y[1] + K[2] * vx + K[3] * vt
        u = ring[(tick - delay) % 64]
        y = solve_ivp(lambda t, q: rhs(q[0], q[1], q[2], q[3], u), (0.0, T), y, rtol=1e-8, atol=1e-8).y[:, -1]
    return y[1]


def main():
    lanes_ms = float(sys.argv[1])
    run_numba(0.05, 3, AD, BD, CD, DD, K, 10, 3)
    cases = [(0.005 + 0.003 * i, d) for d in range(15) for i in range(0, 16, 4)]
    begin = time.process_time()
    for theta0, delay in cases:
        run_numba(theta0, delay, AD, BD, CD, DD, K, TICKS, 3)
    numba_ms = 1e3 * (time.process_time() - begin) / len(cases)
    begin = time.process_time()
    run_scipy(0.05, 5, TICKS // 10)
    scipy_ms = 1e4 * (time.process_time() - begin)
    print(f"  numba RK4 x3   {numba_ms:8.3f} ms per run ({numba_ms / lanes_ms:.1f} times the lanes)")
    print(f"  scipy RK45     {scipy_ms:8.3f} ms per run ({scipy_ms / lanes_ms:.0f} times the lanes)")


main()
