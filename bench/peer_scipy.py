"""The fit of three in-plane sensors by scipy.optimize.least_squares.

Needs SciPy. Reads the readings that `calibrate` wrote, then answers one line
for each line on stdin: "fit NAME" -> seconds and the values of one fit, where
NAME is "lm" (MINPACK, no bounds) or "trf" (with bounds), each with the same
closed slopes as taxel.
"""
import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"

import json
import sys
import time

import numpy as np
from scipy.optimize import least_squares

given = json.load(open(sys.argv[1]))
sensors = [{k: np.array(v) if isinstance(v, list) else v for k, v in s.items()} for s in given["sensors"]]
start = np.array(given["start"])
low, high = np.array(given["low"]), np.array(given["high"])
sizes = np.array(given["sizes"])
count = sum(len(s["e"]) for s in sensors)


def parts(at, i, s):
    rest, q, gamma, least, rate = at[2 + 5 * i : 7 + 5 * i]
    gone = np.exp(-rate * s["e"])
    thinned = 1.0 - gone
    facing = s["scale"] - s["per"] * (1.0 - (1.0 - least) * thinned)
    power = np.exp(gamma * s["logu"])
    return rest, q, least, gone, thinned, facing, power


def residuals(at):
    r = np.empty(2 * count)
    k = 0
    for i, s in enumerate(sensors):
        rest, q, _, _, _, facing, power = parts(at, i, s)
        n = len(s["e"])
        r[k : k + n] = (s["c"] - rest + q * facing * power) / s["sigma_c"]
        r[count + k : count + k + n] = (s["f"] - at[0] * (s["s0"] + at[1] * s["s1"])) / s["sigma_f"]
        k += n
    return r


def slopes(at):
    j = np.zeros((2 * count, len(at)))
    k = 0
    for i, s in enumerate(sensors):
        rest, q, least, gone, thinned, facing, power = parts(at, i, s)
        n = len(s["e"])
        c = slice(k, k + n)
        f = slice(count + k, count + k + n)
        o = 2 + 5 * i
        j[f, 0] = -(s["s0"] + at[1] * s["s1"]) / s["sigma_f"]
        j[f, 1] = -at[0] * s["s1"] / s["sigma_f"]
        j[c, o] = -1.0 / s["sigma_c"]
        j[c, o + 1] = facing * power / s["sigma_c"]
        j[c, o + 2] = q * facing * power * s["logu"] / s["sigma_c"]
        j[c, o + 3] = -q * power * s["per"] * thinned / s["sigma_c"]
        j[c, o + 4] = q * power * s["per"] * (1.0 - least) * s["e"] * gone / s["sigma_c"]
        k += n
    return j


def fit(method):
    bounds = (low, high) if method == "trf" else (-np.inf, np.inf)
    t = time.perf_counter()
    found = least_squares(
        residuals, start, slopes, bounds=bounds, method=method, x_scale=sizes, ftol=1e-12, xtol=1e-12, gtol=1e-12
    )
    # Covariance, as taxel gives it.
    _, sv, vt = np.linalg.svd(found.jac * sizes, full_matrices=False)
    deviation = np.sqrt(np.sum((vt.T / sv) ** 2, axis=1)) * sizes
    seconds = time.perf_counter() - t
    return {"seconds": seconds, "values": found.x.tolist(), "deviations": deviation.tolist(), "evaluations": found.nfev, "square_sum": 2.0 * found.cost}


print("ready", flush=True)
for line in sys.stdin:
    print(json.dumps(fit(line.split()[1])), flush=True)
