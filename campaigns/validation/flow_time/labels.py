#!/usr/bin/env python3
"""Horizontal force, and depth and speed upstream, over windows of 4 body lengths: labels.py RUNS

RUNS holds cases that `absorbing.sh` computed. `at_nominal_n` is the force times the ratio of h u2 of
the plan to h u2 at the gauges, 1.2 body lengths ahead of the vehicle.
"""
import csv
import math
import re
import sys
from pathlib import Path

from settle import GRAVITY, HERE, LENGTH, history, mean


def gauge(path):
    rows = {}
    for line in path.read_text().splitlines():
        if line.startswith("#"):
            continue
        time = float(line.split()[0])
        vectors = re.findall(r"\(([^)]*)\)", line)
        rows[time] = [-float(v.split()[0]) for v in vectors] or [float(v) for v in line.split()[1:]]
    return rows


print("case,froude,from_lengths,to_lengths,horizontal_n,vertical_n,depth_m,speed_mps,at_nominal_n")
for case in csv.DictReader((HERE / "plan.csv").open()):
    folder = Path(sys.argv[1]) / case["id"]
    if not (folder / "postProcessing/gauges/0/U").is_file():
        continue
    speed, depth, density = (float(case[k]) for k in ("speed_mps", "depth_m", "density_kgpm3"))
    heights, speeds = (gauge(folder / "postProcessing/gauges/0" / name) for name in ("p_rgh", "U"))
    rows, unit = history(folder), LENGTH / speed
    for start in (0, 2, 4, 6, 8, 10, 12, 16, 20):
        low, high = start * unit, (start + 4) * unit
        force = mean(rows, low, high)
        across = math.hypot(force[0], force[1])
        average = lambda table: sum(sum(v) / len(v) for t, v in table.items() if low <= t < high) / sum(low <= t < high for t in table)
        h, u = depth + average(heights) / (density * GRAVITY), average(speeds)
        print(f"{case['id']},{speed / math.sqrt(GRAVITY * depth):.2f},{start},{start + 4},{across:.1f},{force[2]:.1f},"
              f"{h:.4f},{u:.3f},{across * depth * speed**2 / (h * u**2):.1f}")
