#!/usr/bin/env python3
"""When the mean of a window stays within 2 % of the mean of the end: settle.py FOLDER_OF_WORK

Reads the histories that `wade campaign run --keep` leaves, and plan.csv beside this file. The window
has 2, 4 or 6 body lengths over the speed; the reference is the mean of the last 12 lengths. Error of
a window: largest of the differences along, across and up, over the magnitude of the dynamic force.
Writes histories.csv (means of a half length) and prints a table.
"""
import csv
import math
import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
LENGTH, GRAVITY, SHARE = 0.868, 9.81, 0.02
NUMBER = re.compile(r"[-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?")


def history(folder):
    total = {}
    for path in sorted(folder.glob("postProcessing/*/*/force.dat")):
        for line in path.read_text().splitlines():
            if line.startswith("#"):
                continue
            v = [float(x) for x in NUMBER.findall(line)]
            if len(v) > 3:
                sums = total.setdefault(v[0], [0.0, 0.0, 0.0])
                for i in range(3):
                    sums[i] += v[1 + i]
    return sorted(total.items())


def mean(rows, start, end):
    """Mean by trapezoids of the samples within."""
    inside = [(t, f) for t, f in rows if start <= t <= end]
    span = inside[-1][0] - inside[0][0]
    return [sum(0.5 * (f[i] + g[i]) * (u - t) for (t, f), (u, g) in zip(inside, inside[1:])) / span for i in range(3)]


def main():
    work = Path(sys.argv[1])
    samples = []
    print("case,froude,length_over_speed_s,dynamic_n,window_lengths,settled_after_lengths,worst_at_5.5,period_lengths")
    for case in csv.DictReader((HERE / "plan.csv").open()):
        folder = work / case["id"]
        if not folder.is_dir():
            continue
        speed, depth = float(case["speed_mps"]), float(case["depth_m"])
        froude = speed / math.sqrt(GRAVITY * depth)
        unit = LENGTH / speed
        rows = history(folder)
        end = rows[-1][0]
        rest = float(next(r["rest_fz_n"] for r in csv.DictReader((HERE / "cases.csv").open()) if r["id"] == case["id"]))
        reference = mean(rows, end - 12 * unit, end)
        dynamic = math.sqrt(reference[0]**2 + reference[1]**2 + (reference[2] - rest)**2)
        for i in range(int(end / unit * 2)):
            m = mean(rows, 0.5 * i * unit, 0.5 * (i + 1) * unit)
            samples.append((case["id"], 0.5 * i + 0.25, *m))
        # crossings of the vertical force with its mean give the period of the wave in the channel
        late = [(t, f[2] - reference[2]) for t, f in rows if t > end - 16 * unit]
        ups = [t for (t, a), (_, b) in zip(late, late[1:]) if a < 0 <= b]
        period = (ups[-1] - ups[0]) / (len(ups) - 1) / unit if len(ups) > 1 else float("nan")
        for window in (2, 4, 6, 8):
            errors = []
            start = 0.0
            while (start + window) * unit <= end - 2 * unit:
                m = mean(rows, start * unit, (start + window) * unit)
                errors.append((start, max(abs(a - b) for a, b in zip(m, reference)) / dynamic))
                start += 0.25
            late_errors = [s for s, e in errors if e > SHARE]
            settled = (max(late_errors) + 0.25 if late_errors else 0.0)
            settled = f"{settled:.2f}" if settled < errors[-1][0] else "never"
            worst = max(e for s, e in errors if 3.5 <= s <= 5.5)
            print(f"{case['id']},{froude:.2f},{unit:.2f},{dynamic:.1f},{window},{settled},{worst:.3f},{period:.1f}")
    with (HERE / "histories.csv").open("w") as file:
        file.write("case,lengths,fx_n,fy_n,fz_n\n")
        file.writelines(f"{c},{t:.2f},{x:.3f},{y:.3f},{z:.2f}\n" for c, t, x, y, z in samples)


main()
