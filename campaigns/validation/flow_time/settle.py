#!/usr/bin/env python3
"""When the mean of a window stays within 2 % of the mean of the end: settle.py WORK [RUNS]

Reads the histories that `wade campaign run --keep` leaves in WORK, or those of the same cases that
`absorbing.sh` leaves in RUNS, and plan.csv beside this file. The window
has 2, 4 or 6 body lengths over the speed; the reference is the mean of the last 12 lengths. The
error of the horizontal force is over its magnitude, that of the vertical force over the whole of it.
Writes histories*.csv (means of a body length) and prints a table.
"""
import csv
import math
import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
LENGTH, GRAVITY = 0.868, 9.81
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
    runs = Path(sys.argv[-1])
    samples = []
    print("case,froude,length_over_speed_s,horizontal_n,window_lengths,horizontal_2_percent_after,horizontal_5_percent_after,"
          "vertical_2_percent_after,horizontal_error_at_3.5_to_6_percent,vertical_error_at_3.5_to_6_percent,wave_period_lengths")
    for case in csv.DictReader((HERE / "plan.csv").open()):
        folder = runs / case["id"]
        if not folder.is_dir() or not (work / "outcomes" / (case["id"] + ".json")).is_file():
            continue
        speed, depth = float(case["speed_mps"]), float(case["depth_m"])
        froude = speed / math.sqrt(GRAVITY * depth)
        unit = LENGTH / speed
        rows = history(folder)
        end = rows[-1][0]
        if end < 22 * unit:
            continue  # still running
        reference = mean(rows, end - 12 * unit, end)
        level_force = math.hypot(reference[0], reference[1])
        for i in range(int(end / unit)):
            samples.append((case["id"], i + 0.5, *mean(rows, i * unit, (i + 1) * unit)))
        # crossings of the vertical force with its mean give the period of the wave in the channel
        late = [(t, f[2] - reference[2]) for t, f in rows if t > end - 16 * unit]
        ups = [t for (t, a), (_, b) in zip(late, late[1:]) if a < 0 <= b]
        period = (ups[-1] - ups[0]) / (len(ups) - 1) / unit if len(ups) > 1 else float("nan")
        for window in (2, 4, 6, 8):
            errors = []
            start = 0.0
            while (start + window) * unit <= end - 2 * unit:
                m = mean(rows, start * unit, (start + window) * unit)
                across = math.hypot(m[0] - reference[0], m[1] - reference[1]) / level_force
                errors.append((start, across, abs(m[2] - reference[2]) / abs(reference[2])))
                start += 0.25
            row = []
            for index, share in ((1, 0.02), (1, 0.05), (2, 0.02)):
                late = [e[0] for e in errors if e[index] > share]
                settled = late[-1] + 0.25 if late else 0.0
                row.append(f"{settled:.1f}" if settled <= errors[-1][0] else "never")
            row += [f"{100 * max(e[i] for e in errors if 3.5 <= e[0] <= 6):.0f}" for i in (1, 2)]
            print(f"{case['id']},{froude:.2f},{unit:.2f},{level_force:.1f},{window}," + ",".join(row) + f",{period:.1f}")
    name = "histories.csv" if runs == work else f"histories_{runs.name}.csv"
    with (HERE / name).open("w") as file:
        file.write("case,lengths,fx_n,fy_n,fz_n\n")
        file.writelines(f"{c},{t:.2f},{x:.3f},{y:.3f},{z:.2f}\n" for c, t, x, y, z in samples)


if __name__ == "__main__":
    main()
