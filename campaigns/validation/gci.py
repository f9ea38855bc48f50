#!/usr/bin/env python3
"""Observed order and grid-convergence uncertainty: gci.py CELL=VALUE CELL=VALUE CELL=VALUE

The three finest meshes count (Celik et al., J. Fluids Eng. 130, 078001, 2008; ASME V&V 20-2009).
The observed order is kept between 0.5 and 2 in the estimate. The standard uncertainty is
1.25 |extrapolated error| / 1.15 where the values approach monotonically, and otherwise half the
range of the three values times 1.5.
"""
import math
import sys


def order(h, f):
    """Observed order of three meshes, finest first; None where the values do not approach."""
    r21, r32 = h[1] / h[0], h[2] / h[1]
    e21, e32 = f[1] - f[0], f[2] - f[1]
    if e21 == 0 or e32 / e21 <= 0:
        return None

    def residual(p):
        return e32 / e21 - r21**p * (r32**p - 1) / (r21**p - 1)

    low, high = 1e-3, 20.0
    if residual(low) < 0:
        return None  # the finer pair differs more than the coarser one
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if residual(middle) > 0 else (low, middle)
    return 0.5 * (low + high)


def estimate(pairs):
    """Order, extrapolated value, standard numerical uncertainty, monotone; of (cell, value) pairs."""
    pairs = sorted(pairs)[:3]
    h, f = [p[0] for p in pairs], [p[1] for p in pairs]
    p = order(h, f)
    if p is None:
        return None, None, 1.5 * 0.5 * (max(f) - min(f)), False
    used = min(2.0, max(0.5, p))
    error = (f[0] - f[1]) / ((h[1] / h[0])**used - 1)
    return p, f[0] + error, 1.25 * abs(error) / 1.15, True


if __name__ == "__main__":
    given = [tuple(map(float, a.split("="))) for a in sys.argv[1:]]
    p, limit, u, monotone = estimate(given)
    finest = min(given)[1]
    print(f"monotone {monotone}; order {p if p is None else round(p, 2)}; "
          f"extrapolated {limit if limit is None else round(limit, 4)}; "
          f"u_num {u:.4g} = {100 * abs(u / finest):.2f} % of the finest")
