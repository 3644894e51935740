"""The least squares of the estimator in vectorised NumPy, over all units at once.

Reads the model and the frames that `compare` wrote, then answers one line for
each line on stdin: "round" -> microseconds per frame of one pass over all
frames; "forces" -> forces, standard deviations and residuals of all frames.
"""
import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"

import json
import sys
import time

import numpy as np

EPS0 = 8.8541878188e-12
SIDE_X = np.array([-1.0, 1.0, -1.0, 1.0])
SIDE_Y = np.array([1.0, 1.0, -1.0, -1.0])
LEAST_GAIN = 1e-14
MOST_STEPS = 25
# Signs with which the four closings add up to d_x, d_y, d_z (P2 Eqs. 7-9).
TO_MOTION = np.stack([SIDE_X / 2, SIDE_Y / 2, np.ones(4) / 4], axis=1)


class Series:
    """m g = sum over j, k of c_jk P^2j Q^2k: two matrix products for all plates."""

    def __init__(self, order):
        from math import comb

        n = np.arange(order)
        # 1/(1 + P s + Q t) = sum (-1)^n (P s + Q t)^n, averaged over s, t.
        c = np.array(
            [[comb(2 * (j + k), 2 * j) / ((2 * j + 1) * (2 * k + 1)) if j + k < order else 0.0 for k in n] for j in n]
        )
        # Columns: coefficients of m, of P dm/dP and of Q dm/dQ.
        self.coefficients = np.concatenate([c, 2 * n[:, None] * c, c * 2 * n], axis=1)
        self.order = order
        self.powers = n

    def __call__(self, gap, p, q):
        inverse = 1.0 / gap
        x, y = (p * inverse) ** 2, (q * inverse) ** 2
        shape = (*gap.shape, self.order)
        powers_x, powers_y = np.ones(shape), np.ones(shape)
        powers_x[..., 1:] = x[..., None]
        powers_y[..., 1:] = y[..., None]
        np.multiply.accumulate(powers_x, axis=-1, out=powers_x)
        np.multiply.accumulate(powers_y, axis=-1, out=powers_y)
        half = (powers_x.reshape(-1, self.order) @ self.coefficients).reshape(*gap.shape, 3, self.order)
        m, along_p, along_q = np.moveaxis(np.matmul(half, powers_y[..., None])[..., 0], -1, 0)
        m, along_p, along_q = m * inverse, along_p * inverse, along_q * inverse
        by_gap = -(m + along_p + along_q) * inverse
        with np.errstate(divide="ignore", invalid="ignore"):
            by_p = np.where(p > 0, along_p / p, 0.0)
            by_q = np.where(q > 0, along_q / q, 0.0)
        return m, by_gap, by_p, by_q


class Grid:
    """m as a product Gauss rule over the tile: one reciprocal and two matrix products."""

    def __init__(self, order):
        node, weight = np.polynomial.legendre.leggauss(order)
        s, t = (a.ravel() for a in np.meshgrid(node, node))
        w = np.outer(weight, weight).ravel() / 4
        self.rise = np.stack([s, t])
        self.weight = w
        self.slopes = -np.stack([w, w * s, w * t], axis=1)

    def __call__(self, gap, p, q):
        # The rise of a tile is the same for the four tiles of a unit.
        rise = np.concatenate([p, q], axis=1) @ self.rise
        inverse = 1.0 / (gap[..., None] + rise[:, None, :])
        flat = inverse.reshape(-1, inverse.shape[-1])
        m = flat @ self.weight
        by = (flat * flat) @ self.slopes
        return m.reshape(gap.shape), *np.moveaxis(by.reshape(*gap.shape, 3), -1, 0)


class Peer:
    def __init__(self, scene):
        get = lambda key: np.array(scene[key])
        self.frames = get("frames")
        self.at_zero, self.per_count = scene["farad_at_zero"], scene["farad_per_count"]
        self.side_a, self.side_b = scene["electrode_m"]
        self.scale = EPS0 * self.side_a * self.side_b
        self.rest_gap = get("air_gap_m") + scene["insulation_gap_m"]
        self.parallel = get("parallel_capacitance_f")
        self.rest_inverse = 1.0 / (self.scale / self.rest_gap)
        self.weight = 1.0 / get("deviation_f")
        self.compliance = get("compliance_m_per_n")
        self.to_force = TO_MOTION @ np.linalg.inv(self.compliance).T
        # Force to closing of the four plates, and to the slopes of the tiles.
        self.closing = self.compliance.T @ np.stack([SIDE_X / 2, SIDE_Y / 2, np.ones(4)])
        share = scene["tile_tilt"] / scene["centre_distance_m"]
        self.half_rise = share * self.compliance[:2].T * np.array([self.side_a / 2, self.side_b / 2])
        self.by_closing = -self.scale * self.closing.T
        self.by_rise = self.scale * self.half_rise.T
        if any(scene["bump_sinking"]):
            raise SystemExit("the peer leaves the sinking of the bump out")
        self.forward = None

    def choose(self, forward):
        self.forward = forward

    def linearise(self, force):
        """Weighted capacitances and slopes against the force for all units."""
        gap = self.rest_gap - force @ self.closing
        rise = force @ self.half_rise
        p, q = np.abs(rise[:, :1]), np.abs(rise[:, 1:])
        m, by_gap, by_p, by_q = self.forward(gap, p, q)
        sign = np.sign(rise)
        capacitance = self.parallel + self.scale * m
        by_p = by_p * sign[:, :1]
        by_q = by_q * sign[:, 1:]
        slopes = by_gap[..., None] * self.by_closing + by_p[..., None] * self.by_rise[0] + by_q[..., None] * self.by_rise[1]
        return capacitance, slopes * self.weight[..., None]

    def estimate(self, counts):
        capacitance = (self.at_zero + self.per_count * counts).reshape(-1, 4)
        # The published inverse.
        closed = self.scale * (self.rest_inverse - 1.0 / (capacitance - self.parallel))
        force = closed @ self.to_force
        for _ in range(MOST_STEPS):
            predicted, slopes = self.linearise(force)
            residual = (capacitance - predicted) * self.weight
            transposed = slopes.transpose(0, 2, 1)
            normal = transposed @ slopes
            gradient = transposed @ residual[..., None]
            step = np.linalg.solve(normal, gradient)
            force = force + step[..., 0]
            # The gain of a step: step . J'J step = step . gradient.
            if (step * gradient).sum(axis=1).max() < LEAST_GAIN:
                break
        else:
            raise SystemExit("not converged")
        residual = residual - (slopes @ step)[..., 0]
        chi2 = (residual * residual).sum(axis=1)
        covariance = np.linalg.inv(normal)
        signed = np.where(residual[:, 0] < 0.0, -1.0, 1.0) * np.sqrt(chi2)
        return force, covariance, signed, force.sum(axis=0), covariance.sum(axis=0)

    def round(self):
        start = time.perf_counter()
        for counts in self.frames:
            self.estimate(counts)
        return (time.perf_counter() - start) / len(self.frames) * 1e6


def fastest(peer, forwards):
    """The formulation of the forward model that is fastest here."""
    times = []
    for forward in forwards:
        peer.choose(forward)
        peer.round()
        times.append(sorted(peer.round() for _ in range(5))[2])
    best = int(np.argmin(times))
    peer.choose(forwards[best])
    detail = ", ".join(f"{type(f).__name__} of {order(f)}: {t:.0f} us" for f, t in zip(forwards, times))
    print(f"NumPy {np.__version__}, {detail}", file=sys.stderr)


def order(forward):
    return getattr(forward, "order", None) or f"{len(forward.weight)} points"


def main():
    with open(sys.argv[1]) as file:
        peer = Peer(json.load(file))
    # Both reach rounding at the tilts of these frames; `compare` checks it.
    fastest(peer, [Series(9), Grid(6)])
    print("ready", flush=True)
    for line in sys.stdin:
        if line.strip() == "round":
            print(peer.round(), flush=True)
        else:
            found = [peer.estimate(counts) for counts in peer.frames]
            print(json.dumps({
                "force": [f.tolist() for f, *_ in found],
                "deviation": [np.sqrt(np.einsum("nii->ni", c)).tolist() for _, c, *_ in found],
                "residual": [r.tolist() for _, _, r, *_ in found],
            }), flush=True)


if __name__ == "__main__":
    main()
