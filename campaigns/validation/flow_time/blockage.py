#!/usr/bin/env python3
"""Rise of the level ahead of the vehicle in a channel, from momentum, for the cases of a campaign.

    blockage.py CASES.csv WIDTH

Steady flow in a channel without friction: depth h and speed q / h ahead of the vehicle have the
momentum of the plan's depth and speed, which the outlet keeps, and the drag over the width on top.
"""
import csv
import math
import sys

G = 9.81
width = float(sys.argv[2])
bands = {}
for row in csv.DictReader(open(sys.argv[1])):
    speed, depth, density = (float(row[k]) for k in ("speed_mps", "depth_m", "density_kgpm3"))
    froude = speed / math.sqrt(G * depth)
    if row["set"] != "paper" or froude >= 1:
        continue
    angle = math.radians(float(row["heading_deg"]))
    drag = abs(float(row["fx_n"])) * abs(math.cos(angle)) + abs(float(row["fy_n"])) * abs(math.sin(angle))
    momentum = lambda h: 0.5 * density * G * h * h + density * (speed * depth) ** 2 / h
    wanted = momentum(depth) + drag / width
    low, high = depth, 3 * depth
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if momentum(middle) > wanted else (middle, high)
    band = next(top for top in (0.4, 0.6, 0.8, 1.0) if froude < top)
    bands.setdefault(band, []).append(100 * (low / depth - 1))
print("froude_below,cases,mean_rise_percent,largest_percent,cases_above_5_percent")
for band, rises in sorted(bands.items()):
    print(f"{band},{len(rises)},{sum(rises) / len(rises):.1f},{max(rises):.1f},{sum(r > 5 for r in rises)}")
