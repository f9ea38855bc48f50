#!/usr/bin/env python3
"""Drag [N] of kept cases over windows: history.py START END FOLDER ... (folders of `--keep`)"""
import re
import sys
from pathlib import Path

NUMBER = re.compile(r"[-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?")


def history(folder):
    """Time, force along x and z [N] on all surfaces."""
    total = {}
    for path in sorted(Path(folder).glob("postProcessing/*/*/force.dat")):
        for line in path.read_text().splitlines():
            v = [float(x) for x in NUMBER.findall(line)]
            if not line.startswith("#") and len(v) > 3:
                sums = total.setdefault(v[0], [0.0, 0.0])
                sums[0] -= v[1]
                sums[1] += v[3]
    return [(t, *f) for t, f in sorted(total.items())]


def mean(rows, start, end):
    inside = [r for r in rows if start <= r[0] <= end]
    span = inside[-1][0] - inside[0][0]
    return [sum(0.5 * (a[i] + b[i]) * (b[0] - a[0]) for a, b in zip(inside, inside[1:])) / span for i in (1, 2)]


if __name__ == "__main__":
    start, end = float(sys.argv[1]), float(sys.argv[2])
    for folder in sys.argv[3:]:
        drag, up = mean(history(folder), start, end)
        print(f"{Path(folder).name},{drag:.3f},{up:.2f}")
