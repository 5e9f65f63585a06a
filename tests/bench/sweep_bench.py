"""The same sampled loops in numba and scipy, one core: ms of CPU per run.

Gain (7), 1 kHz, 10 s; the velocity filter as in velocity_estimator.hpp (first-order hold). With smooth exponential
friction by numba (RK4, three substeps) and scipy (solve_ivp RK45); as the rig is, with encoders and true
stick-slip, by numba (RK4, one step from event to event). Each of numba's programs runs as compiled by default and
with fastmath.
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
CART_STEP, ANGLE_STEP = 2.27485e-5, 1.5339808e-3
W, Z = 2 * math.pi * 50, 0.9
AD, BD, CD, DD, _ = cont2discrete(
    (np.array([[0.0, 1.0], [-W * W, -2 * Z * W]]), np.array([[0.0], [W * W]]), np.array([[0.0, 1.0]]),
     np.array([[0.0]])), T, "foh")
BD, CD, DD = BD.ravel(), CD.ravel(), float(DD[0, 0])


def program(compiled):
    """The program with each function `compiled`."""
    @compiled
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


    @compiled
    def rk4(x, th, v, w, u, h):
        a1, b1, c1, d1 = rhs(x, th, v, w, u)
        a2, b2, c2, d2 = rhs(x + h / 2 * a1, th + h / 2 * b1, v + h / 2 * c1, w + h / 2 * d1, u)
        a3, b3, c3, d3 = rhs(x + h / 2 * a2, th + h / 2 * b2, v + h / 2 * c2, w + h / 2 * d2, u)
        a4, b4, c4, d4 = rhs(x + h * a3, th + h * b3, v + h * c3, w + h * d3, u)
        return (x + h / 6 * (a1 + 2 * (a2 + a3) + a4), th + h / 6 * (b1 + 2 * (b2 + b3) + b4),
                v + h / 6 * (c1 + 2 * (c2 + c3) + c4), w + h / 6 * (d1 + 2 * (d2 + d3) + d4))


    @compiled
    def slide(x, th, v, w, u, d):
        """The rate with the cart sliding in direction d, or at rest for d = 0."""
        s, c = math.sin(th), math.cos(th)
        j = 4.0 / 3.0 * MP * L * L
        turn = MP * L * G * s
        if d == 0.0:
            return 0.0, w, 0.0, turn / j
        speed = max(0.0, d * v)
        level = FC + FE * math.exp(-(speed / VS) * (speed / VS))
        push = ALPHA * u - BETA * v - EPS * v - level * d + MP * L * s * w * w
        off = MP * L * c
        det = (M + MP) * j - off * off
        return v, w, (j * push - off * turn) / det, ((M + MP) * turn - off * push) / det


    @compiled
    def slide_rk4(x, th, v, w, u, h, d):
        a1, b1, c1, d1 = slide(x, th, v, w, u, d)
        a2, b2, c2, d2 = slide(x + h / 2 * a1, th + h / 2 * b1, v + h / 2 * c1, w + h / 2 * d1, u, d)
        a3, b3, c3, d3 = slide(x + h / 2 * a2, th + h / 2 * b2, v + h / 2 * c2, w + h / 2 * d2, u, d)
        a4, b4, c4, d4 = slide(x + h * a3, th + h * b3, v + h * c3, w + h * d3, u, d)
        return (x + h / 6 * (a1 + 2 * (a2 + a3) + a4), th + h / 6 * (b1 + 2 * (b2 + b3) + b4),
                v + h / 6 * (c1 + 2 * (c2 + c3) + c4), w + h / 6 * (d1 + 2 * (d2 + d3) + d4))


    @compiled
    def rest_load(th, w, u):
        s, c = math.sin(th), math.cos(th)
        turn = MP * L * G * s / (4.0 / 3.0 * MP * L * L)
        return ALPHA * u + MP * L * (s * w * w - c * turn)


    @compiled
    def passed(th, v, w, u, d):
        """Positive beyond a stop or a breakaway."""
        if d != 0.0:
            return -d * v
        return abs(rest_load(th, w, u)) - FC - FE


    @compiled
    def settled(th, v, w, u):
        if v != 0.0:
            return 1.0 if v > 0.0 else -1.0
        if passed(th, v, w, u, 0.0) > 0.0:
            return 1.0 if rest_load(th, w, u) > 0.0 else -1.0
        return 0.0


    @compiled
    def period_with_events(x, th, v, w, u, h):
        d = settled(th, v, w, u)
        left = h
        for _ in range(100):
            x1, th1, v1, w1 = slide_rk4(x, th, v, w, u, left, d)
            if not passed(th1, v1, w1, u, d) > 0.0:
                return x1, th1, v1, w1
            low, high = 0.0, left
            f_low, f_high = min(passed(th, v, w, u, d), -1e-12), passed(th1, v1, w1, u, d)
            for i in range(60):
                if high - low < 1e-12:
                    break
                t = high - f_high * (high - low) / (f_high - f_low)
                if i % 4 == 3 or not low < t < high:
                    t = 0.5 * (low + high)
                x1, th1, v1, w1 = slide_rk4(x, th, v, w, u, t, d)
                f = passed(th1, v1, w1, u, d)
                if f > 0.0:
                    high, f_high, f_low = t, f, 0.5 * f_low
                else:
                    low, f_low, f_high = t, f, 0.5 * f_high
            x, th, v, w = slide_rk4(x, th, v, w, u, high, d)
            left -= high
            if d == 0.0:
                d = 1.0 if rest_load(th, w, u) > 0.0 else -1.0
            else:
                v = 0.0
                d = settled(th, v, w, u)
        return slide_rk4(x, th, v, w, u, left, 0.0)


    @compiled
    def run_numba(theta0, delay, ad, bd, cd, dd, k, ticks, pieces):
        """`pieces` of a period with smooth friction; 0: as the rig is, with encoders, the limit of 15 V and events."""
        x, th, v, w = 0.0, theta0, 0.0, 0.0
        s1, s2, g1, g2 = 0.0, 0.0, 0.0, 0.0  # the filters, at rest on the first sample
        start = round(theta0 / ANGLE_STEP) * ANGLE_STEP if pieces == 0 else theta0
        ring = np.full(64, k[1] * start)
        for tick in range(ticks):
            mx, mth = x, th
            if pieces == 0:
                mx, mth = round(x / CART_STEP) * CART_STEP, round(th / ANGLE_STEP) * ANGLE_STEP
            dth = mth - start
            vx = cd[0] * s1 + cd[1] * s2 + dd * mx
            vt = cd[0] * g1 + cd[1] * g2 + dd * dth
            s1, s2 = ad[0, 0] * s1 + ad[0, 1] * s2 + bd[0] * mx, ad[1, 0] * s1 + ad[1, 1] * s2 + bd[1] * mx
            g1, g2 = ad[0, 0] * g1 + ad[0, 1] * g2 + bd[0] * dth, ad[1, 0] * g1 + ad[1, 1] * g2 + bd[1] * dth
            ring[tick % 64] = k[0] * mx + k[1] * mth + k[2] * vx + k[3] * vt
            u = ring[(tick - delay) % 64]
            if pieces == 0:
                x, th, v, w = period_with_events(x, th, v, w, max(-15.0, min(15.0, u)), 1e-3)
            for _ in range(pieces):
                x, th, v, w = rk4(x, th, v, w, u, 1e-3 / pieces)
        return th

    return rhs, run_numba


rhs, run_numba = program(numba.njit)
_, run_fastmath = program(numba.njit(fastmath=True))


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


def mean_ms(run, cases, pieces):
    run(0.05, 3, AD, BD, CD, DD, K, 10, pieces)
    begin = time.process_time()
    for theta0, delay in cases:
        run(theta0, delay, AD, BD, CD, DD, K, TICKS, pieces)
    return 1e3 * (time.process_time() - begin) / len(cases)


def fastmath_apart(cases, ticks, pieces):
    """The largest difference of the angle that fastmath makes after so many periods."""
    ends = ((run(theta0, delay, AD, BD, CD, DD, K, ticks, pieces) for run in (run_numba, run_fastmath))
            for theta0, delay in cases)
    return max(abs(one - other) for one, other in ends)


def main():
    lanes_ms, rig_ms = float(sys.argv[1]), float(sys.argv[2])
    cases = [(0.005 + 0.003 * i, d) for d in range(15) for i in range(0, 16, 4)]
    for name, run in (("numba RK4 x3  ", run_numba), ("  fastmath     ", run_fastmath)):
        ms = mean_ms(run, cases, 3)
        print(f"  {name}{ms:8.3f} ms per run ({ms / lanes_ms:.1f} times the lanes)")
    begin = time.process_time()
    run_scipy(0.05, 5, TICKS // 10)
    scipy_ms = 1e4 * (time.process_time() - begin)
    print(f"  scipy RK45     {scipy_ms:8.3f} ms per run ({scipy_ms / lanes_ms:.0f} times the lanes)")
    print("as the rig is (encoders, 15 V), exponential friction, true stick-slip")
    for name, run in (("numba, events ", run_numba), ("  fastmath     ", run_fastmath)):
        still = run(0.05, 3, AD, BD, CD, DD, K, 2000, 0)
        assert abs(still) < 0.01, "the loop in numba does not balance"
        ms = mean_ms(run, cases, 0)
        print(f"  {name}{ms:8.3f} ms per run ({ms / rig_ms:.1f} times the lanes)")
    print(f"fastmath moves the angle by at most {fastmath_apart(cases, 1000, 3):.1e} rad with smooth friction (1 s), "
          f"{fastmath_apart(cases, 200, 0):.1e} rad as the rig is (0.2 s), {fastmath_apart(cases, 1000, 0):.1e} rad (1 s)")


main()
