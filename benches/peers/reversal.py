"""The reversal of peer_reversal.rs by scipy's sparse least_squares: same model, same minimum.

    reversal.py <file> <most seconds>

Unknowns: all coefficients of three cubic splines on the same knots, three tilts, four offsets. The
gauge (the least-squares line of every form over the measured positions is zero) is six rows of a
weight so large that what is left of it does not show in the cost. Exact rotation with the point of
contact by Newton's method, thickness shift, analytic sparse Jacobian. Prints seconds, seconds of all
processors, peak memory (MB), half the sum of squares of the residuals (um^2), evaluations of the Jacobian, tilts (rad).
"""

import resource
import sys
import time

import numpy as np
from scipy import sparse
from scipy.interpolate import BSpline
from scipy.optimize import least_squares

# Signs of M (and of the first tilt), of the second tilt; their product is that of the third.
SIGNS = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
GAUGE_WEIGHT = 3e5

data = np.fromfile(sys.argv[1])
limit = float(sys.argv[2])
n, cells = int(data[0]), int(data[1])
low, high, thickness = data[2:5]
start_tilts, start_offsets = data[5:8], data[8:12]
traces = data[12:].reshape(4, 2, n)
half = thickness / 2
breaks = low + (high - low) * np.arange(cells + 1) / cells
knots = np.r_[[low] * 3, breaks, [high] * 3]
k = cells + 3


def functions(at):
    return BSpline.design_matrix(at, knots, 3, extrapolate=True)


on_slide = [functions(traces[c, 0]) for c in range(4)]
positions = traces[:, 0].ravel()
center, scale = positions.mean(), (positions.max() - positions.min()) / 2
mean_functions = sum(np.asarray(b.sum(axis=0)).ravel() for b in on_slide)
tilted = sum(b.T @ ((traces[c, 0] - center) / scale) for c, b in enumerate(on_slide))
gauge_rows = np.vstack([mean_functions, tilted]) / len(positions) * GAUGE_WEIGHT * (n / 2000) ** 0.5
gauge = sparse.block_diag([sparse.csr_matrix(gauge_rows)] * 3)
gauge = sparse.hstack([gauge, sparse.csr_matrix((6, 7))], format="csr")


def contact(c, p):
    i, s = SIGNS[c]
    psi = i * p[3 * k] + s * p[3 * k + 1] + i * s * p[3 * k + 2]
    sin, cos = np.sin(psi), np.cos(psi)
    side = 1 if i * s > 0 else 2
    form = BSpline(knots, p[side * k:(side + 1) * k] / 1000, 3)
    slope = form.derivative()
    x = traces[c, 0]
    u = (x + half * sin) / cos
    for _ in range(20):
        step = (x - u * cos + (half + form(u)) * sin) / (cos - slope(u) * sin)
        u = u + step
        if np.abs(step).max() < 1e-13 * high:
            break
    return i, s, side, psi, sin, cos, u, form(u), slope(u)


def residuals(p):
    out = []
    for c in range(4):
        i, s, side, psi, sin, cos, u, height, slope = contact(c, p)
        reading = u * sin + height * cos - half * 2 * np.sin(psi / 2) ** 2
        out.append(1000 * reading + i * (on_slide[c] @ p[:k]) + p[3 * k + 3 + c] - traces[c, 1])
    return np.concatenate(out + [gauge @ p])


def jacobian(p):
    rows = []
    for c in range(4):
        i, s, side, psi, sin, cos, u, height, slope = contact(c, p)
        q = 1 / (cos - slope * sin)
        turn = 1000 * (traces[c, 0] + (sin + slope * cos) * (u * sin + (half + height) * cos) * q)
        on_side = sparse.diags(q) @ functions(u)
        nothing = sparse.csr_matrix((n, k))
        forms = [i * on_slide[c], nothing, nothing]
        forms[side] = on_side
        border = np.zeros((n, 7))
        border[:, 0], border[:, 1], border[:, 2] = i * turn, s * turn, i * s * turn
        border[:, 3 + c] = 1
        rows.append(sparse.hstack(forms + [sparse.csr_matrix(border)]))
    return sparse.vstack(rows + [gauge], format="csr")


class OutOfTime(Exception):
    pass


began, used = time.perf_counter(), time.process_time()


def timed(of):
    def inner(p):
        if time.perf_counter() - began > limit:
            raise OutOfTime
        return of(p)
    return inner


start = np.concatenate([np.zeros(3 * k), start_tilts, start_offsets])
try:
    found = least_squares(timed(residuals), start, jac=timed(jacobian), method="trf",
                          x_scale="jac", tr_solver="lsmr",
                          tr_options={"atol": 1e-12, "btol": 1e-12, "maxiter": 20000},
                          ftol=1e-12, xtol=1e-12, gtol=1e-12)
except OutOfTime:
    print(f"scipy more than {limit:.0f}")
    sys.exit()
seconds = time.perf_counter() - began
processor = time.process_time() - used
r = found.fun[:4 * n]
memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
tilts = " ".join(f"{t:.13e}" for t in found.x[3 * k:3 * k + 3])
print(f"scipy {seconds:.4f} {processor:.4f} {memory:.1f} {0.5 * r @ r:.16e} {found.njev} {tilts}")
