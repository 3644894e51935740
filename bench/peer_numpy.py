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


class Grid:
    """m as a product Gauss rule over the tile: one reciprocal, two matrix products.

    Gauss with n points leaves less than 6 ((p+q)/2g)^2n; `grid` takes the fewest
    that reach 1e-14. A power series by powers and matrix product was slower.
    The rise may have a sign.
    """

    def __init__(self, order):
        node, weight = np.polynomial.legendre.leggauss(order)
        s, t = (a.ravel() for a in np.meshgrid(node, node))
        w = np.outer(weight, weight).ravel() / 4
        self.rise = np.stack([s, t])
        self.weight = w
        self.slopes = -np.stack([w, w * s, w * t], axis=1)

    def __call__(self, gap, rise):
        # The rise of a tile is the same for the four tiles of a unit.
        inverse = 1.0 / (gap[..., None] + (rise @ self.rise)[:, None, :])
        flat = inverse.reshape(-1, inverse.shape[-1])
        m = flat @ self.weight
        by = (flat * flat) @ self.slopes
        return m.reshape(gap.shape), by


GRIDS = {order: Grid(order) for order in (2, 3, 4, 5, 6, 8, 12, 16, 24)}


def grid(tilt):
    """The smallest grid that is exact to 1e-14 up to (p+q)/g = `tilt`."""
    for order, found in GRIDS.items():
        if 6 * (tilt / 2) ** (2 * order) < 1e-14:
            return found
    raise SystemExit("too close to contact for this peer")


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
        # dC/dF of one plate: its row of by_closing for dm/dg, by_rise for the rest.
        self.by_closing = -self.scale * self.closing.T
        self.by_rise = self.scale * self.half_rise.T
        if any(scene["bump_sinking"]):
            raise SystemExit("the peer leaves the sinking of the bump out")

    def linearise(self, force):
        """Weighted capacitances and slopes against the force for all units."""
        gap = self.rest_gap - force @ self.closing
        rise = force @ self.half_rise
        m, by = grid(np.abs(rise).sum(axis=1).max() / gap.min())(gap, rise)
        slopes = (by[:, 1:] @ self.by_rise).reshape(*gap.shape, 3)
        slopes += by[:, 0].reshape(*gap.shape, 1) * self.by_closing
        slopes *= self.weight[..., None]
        return self.parallel + self.scale * m, slopes

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


def main():
    with open(sys.argv[1]) as file:
        peer = Peer(json.load(file))
    peer.round()
    print(f"NumPy {np.__version__}", file=sys.stderr)
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
