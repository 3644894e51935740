"""The response of a linear chain to straight lines, with 50 digits.

Needs mpmath. Reads the factor, zeros and poles that `chain` wrote, and the input
at equal steps from zero at rest; prints the outputs there as JSON.
"""
import json
import sys

import mpmath

mpmath.mp.dps = 50


def main():
    given = json.load(open(sys.argv[1]))
    number = lambda pair: mpmath.mpc(*pair)
    zeros, poles = [number(z) for z in given["zeros"]], [number(p) for p in given["poles"]]
    period = mpmath.mpf(given["period_s"])
    factor = mpmath.mpf(given["factor"])
    at = lambda s: factor * mpmath.fprod(s - z for z in zeros)
    residues = [
        at(p) / mpmath.fprod(p - q for j, q in enumerate(poles) if j != i) for i, p in enumerate(poles)
    ]
    # The direct part of a chain with as many zeros as poles.
    direct = factor if len(zeros) == len(poles) else mpmath.mpf(0)
    decays = [mpmath.exp(p * period) for p in poles]
    states = [mpmath.mpc(0)] * len(poles)
    before, outputs = mpmath.mpf(0), []
    for value in given["input"]:
        value = mpmath.mpf(value)
        slope = (value - before) / period
        # x' = p x + u on a straight line u = before + slope t.
        for i, p in enumerate(poles):
            grown = decays[i] - 1
            states[i] = decays[i] * states[i] + before * grown / p + slope * (grown / p - period) / p
        before = value
        total = direct * value + mpmath.fsum(r * x for r, x in zip(residues, states))
        outputs.append(float(mpmath.re(total)))
    json.dump(outputs, sys.stdout)


main()
