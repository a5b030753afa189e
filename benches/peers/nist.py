"""scipy.optimize.least_squares on NIST's certified problems, beside the table of nist.sh.

Derivatives by complex step, exact to rounding; tolerances at 1e-15, or at epsilon for the MINPACK
way, which is what gives scipy its best digits.
"""

import math
import re
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import scipy
from scipy.optimize import least_squares

exp, cos, sin, arctan, log, sqrt, pi = (
    np.exp, np.cos, np.sin, np.arctan, np.log, np.sqrt, np.pi)


def rational(b, x, above):
    top = sum(b[k] * x**k for k in range(above))
    below = 1 + sum(b[above + k] * x ** (k + 1) for k in range(len(b) - above))
    return top / below


def gauss(b, x):
    return (b[0] * exp(-b[1] * x) + b[2] * exp(-(((x - b[3]) / b[4]) ** 2))
            + b[5] * exp(-(((x - b[6]) / b[7]) ** 2)))


def lanczos(b, x):
    return b[0] * exp(-b[1] * x) + b[2] * exp(-b[3] * x) + b[4] * exp(-b[5] * x)


def enso(b, x):
    year, p, q = 2 * pi * x / 12, 2 * pi * x / b[3], 2 * pi * x / b[6]
    return (b[0] + b[1] * cos(year) + b[2] * sin(year) + b[4] * cos(p) + b[5] * sin(p)
            + b[7] * cos(q) + b[8] * sin(q))


MODELS = {
    "Misra1a": lambda b, x: b[0] * (1 - exp(-b[1] * x)),
    "BoxBOD": lambda b, x: b[0] * (1 - exp(-b[1] * x)),
    "Misra1b": lambda b, x: b[0] * (1 - (1 + b[1] * x / 2) ** -2),
    "Misra1c": lambda b, x: b[0] * (1 - (1 + 2 * b[1] * x) ** -0.5),
    "Misra1d": lambda b, x: b[0] * b[1] * x / (1 + b[1] * x),
    "Chwirut1": lambda b, x: exp(-b[0] * x) / (b[1] + b[2] * x),
    "Chwirut2": lambda b, x: exp(-b[0] * x) / (b[1] + b[2] * x),
    "Lanczos1": lanczos, "Lanczos2": lanczos, "Lanczos3": lanczos,
    "Gauss1": gauss, "Gauss2": gauss, "Gauss3": gauss,
    "DanWood": lambda b, x: b[0] * x ** b[1],
    "Kirby2": lambda b, x: rational(b, x, 3),
    "Hahn1": lambda b, x: rational(b, x, 4),
    "Thurber": lambda b, x: rational(b, x, 4),
    "Nelson": lambda b, x: b[0] - b[1] * x[0] * exp(-b[2] * x[1]),
    "MGH09": lambda b, x: b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3]),
    "MGH10": lambda b, x: b[0] * exp(b[1] / (x + b[2])),
    "MGH17": lambda b, x: b[0] + b[1] * exp(-x * b[3]) + b[2] * exp(-x * b[4]),
    "Roszman1": lambda b, x: b[0] - b[1] * x - arctan(b[2] / (x - b[3])) / pi,
    "ENSO": enso,
    "Rat42": lambda b, x: b[0] / (1 + exp(b[1] - b[2] * x)),
    "Rat43": lambda b, x: b[0] / (1 + exp(b[1] - b[2] * x)) ** (1 / b[3]),
    "Eckerle4": lambda b, x: b[0] / b[1] * exp(-0.5 * ((x - b[2]) / b[1]) ** 2),
    "Bennett5": lambda b, x: b[0] * (b[1] + x) ** (-1 / b[2]),
}


def read(path):
    """Starts, certified parameters, responses and predictors of one file."""
    rows, data, in_data = [], [], False
    for line in path.read_text().splitlines():
        if re.match(r"\s*b\d+ =", line):
            rows.append([float(word) for word in line.split("=")[1].split()])
        elif line.startswith("Data:"):
            in_data = "y" in line and "Response" not in line
        elif in_data and line.strip():
            data.append([float(word) for word in line.split()])
    table, data = np.array(rows), np.array(data).T
    return table[:, :2].T, table[:, 2], data[0], data[1:]


def digits(found, certified):
    error = max(abs((f - c) / c) for f, c in zip(found, certified))
    if not math.isfinite(error):
        return 0.0
    return 11.0 if error == 0 else min(11.0, max(0.0, -math.log10(error)))


def complex_step(residuals, b):
    """Exact derivatives; scipy's own "cs" takes a step of 1.5e-8 whatever the parameter's size."""
    columns = []
    for j in range(len(b)):
        moved = b.astype(complex)
        moved[j] += 1e-100j
        columns.append(residuals(moved).imag / 1e-100)
    return np.array(columns).T


WAYS = {
    "trf": dict(method="trf", x_scale="jac", ftol=1e-15, xtol=1e-15, gtol=1e-15, max_nfev=5000),
    "lm": dict(method="lm", x_scale="jac", ftol=2.3e-16, xtol=2.3e-16, gtol=2.3e-16, max_nfev=50000),
    "trf default": dict(method="trf"),
}


def main():
    warnings.simplefilter("ignore")
    np.seterr(all="ignore")
    folder, ours = Path(sys.argv[1]), Path(sys.argv[2])
    print(f"scipy {scipy.__version__}, digits of the worst parameter (and milliseconds)")
    print(f"{'':12}{'errsep':>16}" + "".join(f"{way:>18}" for way in WAYS))
    scores = {way: [] for way in ["errsep", *WAYS]}
    for line in ours.read_text().splitlines():
        words = line.split()
        name, start, own, microseconds = words[0], int(words[1]), float(words[2]), float(words[8])
        starts, certified, y, x = read(folder / f"{name}.dat")
        y = np.log(y) if name == "Nelson" else y
        x = x if name == "Nelson" else x[0]
        scores["errsep"].append(own)
        row = f"{name:10}{start:2}{own:8.1f}{microseconds / 1e3:8.2f}"
        for way, settings in WAYS.items():
            def residuals(b):
                return MODELS[name](b, x) - y

            exact = lambda b: complex_step(residuals, b)
            jacobian = "2-point" if way.endswith("default") else exact
            begun = time.perf_counter()
            try:
                fit = least_squares(residuals, starts[start - 1], jac=jacobian, **settings)
                score = digits(fit.x, certified)
            except (ValueError, FloatingPointError):
                score = 0.0
            scores[way].append(score)
            row += f"{score:9.1f}{(time.perf_counter() - begun) * 1e3:9.2f}"
        print(row)
    for title, least in [("at least 4", 4), ("at least 6", 6), ("at least 8", 8)]:
        counts = [sum(score >= least for score in scores[way]) for way in scores]
        print(f"{title:12}{counts[0]:8}{'':8}" + "".join(f"{c:9}{'':9}" for c in counts[1:]))
    means = [sum(scores[way]) / len(scores[way]) for way in scores]
    print(f"{'mean':12}{means[0]:8.2f}{'':8}" + "".join(f"{m:9.2f}{'':9}" for m in means[1:]))


if __name__ == "__main__":
    main()
