"""SciPy's and numbalsoda's integrators, with the orders and answers of serve.h:

    scipy_peer.py plain | python | numba | numbalsoda | space | space-numba

plain: DOP853 and a right-hand side as one writes it with numpy at first; python: one written for speed; numba: the same
compiled; numbalsoda: its dop853 and lsoda, which call the compiled one directly. The setting is the tolerance, relative
and absolute. space and space-numba: six degrees of freedom with numpy's matrices, plain and compiled.
"""
import os
import sys
import time

import numpy as np

from model import MACHINES


def scipy_solver(kind):
    from scipy.integrate import solve_ivp

    if kind == "numba":
        from numba import njit

        from model import compiled_sides, numbers
        sides = compiled_sides(njit)
    elif kind.startswith("space"):
        from space import side_in_space
        if kind == "space-numba":
            from numba import njit
        sides = side_in_space(njit if kind == "space-numba" else lambda function: function)

    def solver(method, name, rpm, size, unit, factor=1.0):
        if kind == "plain":
            from plain import plain_side
            side = plain_side(name, rpm, size, unit, factor)
        elif kind.startswith("space"):
            side = sides(rpm, size, unit, factor)
        elif kind == "python":
            from model import python_side
            side = python_side(name, rpm, size, unit, factor)
        else:
            compiled, d = sides[name], numbers(name, rpm, size, unit, factor)

            def side(t, y):
                dy = np.empty(42)
                compiled(t, y, dy, d)
                return dy

        def solve(start, period, tolerance):
            solution = solve_ivp(side, (0.0, period), start, method=method, rtol=tolerance, atol=tolerance, t_eval=[period])
            return solution.success, solution.y[:, -1], solution.nfev

        return solve

    return solver


def numbalsoda_solver():
    import numbalsoda
    from numba import carray, cfunc, njit

    from model import compiled_sides, numbers
    sides = {}
    for name, compiled in compiled_sides(njit).items():
        def build(compiled):
            @cfunc(numbalsoda.lsoda_sig)
            def side(t, y, dy, data):
                d = carray(data, 33)
                d[32] += 1
                compiled(t, carray(y, 42), carray(dy, 42), d)
            return side
        sides[name] = build(compiled)

    def solver(method, name, rpm, size, unit, factor=1.0):
        integrate = getattr(numbalsoda, method)

        def solve(start, period, tolerance):
            d = np.append(numbers(name, rpm, size, unit, factor), 0.0)
            y, success = integrate(sides[name].address, start, np.array([0.0, period]), data=d, rtol=tolerance,
                                   atol=tolerance, mxstep=10**8)
            return success, y[-1], int(d[32])

        return solve

    return solver


def answer(solve, rpm, setting, seconds, size, unit):
    n = len(unit)
    start = np.hstack([np.eye(n), np.zeros((n, 1))]).ravel()
    times = []
    begin = time.perf_counter()
    while not times or (time.perf_counter() - begin < seconds and len(times) < 1001):
        since = time.perf_counter()
        success, y, evaluations = solve(start, 60.0 / rpm, setting)
        if not success or not np.all(np.isfinite(y)):
            return "failed"
        y = y.reshape(n, n + 1)
        x0 = np.linalg.solve(np.eye(n) - y[:, :n], y[:, n])
        times.append(time.perf_counter() - since)
    times.sort()
    phi = y[:, :n] * unit[:, None] / unit
    values = [times[0], times[len(times) // 2], len(times), evaluations, *phi.ravel(), *(x0 * size * unit)]
    return ",".join(repr(float(v)) if isinstance(v, float) else str(v) for v in values)


def main():
    kind = sys.argv[1]
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # integrators write messages of their own
    solver = numbalsoda_solver() if kind == "numbalsoda" else scipy_solver(kind)
    n = 12 if kind.startswith("space") else 6
    for name in ["watt_beside"] if n == 12 else MACHINES:  # all is compiled before the first order
        solver({"numbalsoda": "dop853"}.get(kind, "DOP853"), name, 60.0, 1.0, [1.0] * n)(np.zeros(n * (n + 1)), 0.01, 1e-3)
    for line in sys.stdin:
        name, rpm, method, setting, seconds, size, *unit = line.split()
        unit = [float(u) for u in unit]
        name, _, factor = name.partition("*")
        solve = solver(method, name, float(rpm), float(size), unit, float(factor or 1.0))
        try:
            print(answer(solve, float(rpm), float(setting), float(seconds), float(size), np.array(unit)), file=answers, flush=True)
        except (ValueError, ArithmeticError):
            print("failed", file=answers, flush=True)


if __name__ == "__main__":
    main()
