#!/usr/bin/env python3
"""Figures of the bore: the history of each mesh, and the comparison with the measured force.

    figures.py --extract FOLDER               writes FOLDER/force.csv from postProcessing
    figures.py --compare DATA FORCE.csv ...   figures of the measured and the computed histories
    figures.py --table FORCE.csv ...          the computed histories as means of 10 ms, side by side

DATA is `for_exp.txt` of the repository that README.md names: columns time [s] and force [N].
"""
import re
import sys
from pathlib import Path

ARRIVAL_S, ARRIVAL_N = 0.345, 3.0  # the measured force passes 3 N at 0.345 s
PLATEAU_S = (0.5, 0.8)
IMPULSE_S = (0.34, 0.80)
NUMBER = r"[-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?"


def history(folder):
    """Time [s] and force along x on the whole column [N]: twice that on the half that is computed."""
    rows = []
    for path in sorted(Path(folder).glob("postProcessing/column/*/force.dat")):
        for line in path.read_text().splitlines():
            numbers = re.findall(NUMBER, line)
            if not line.startswith("#") and len(numbers) > 3:
                rows.append((float(numbers[0]), 2.0 * float(numbers[1])))
    return rows


def measured(path):
    """The digitised points, sorted, as means of bins that follow the curve."""
    points = sorted(tuple(map(float, line.split())) for line in Path(path).read_text().splitlines() if line.strip())
    return points


def binned(points, width):
    bins = {}
    for t, f in points:
        bins.setdefault(int(t / width), []).append((t, f))
    return [(sum(t for t, _ in b) / len(b), sum(f for _, f in b) / len(b)) for _, b in sorted(bins.items())]


def interpolate(points, t):
    for (t0, f0), (t1, f1) in zip(points, points[1:]):
        if t0 <= t <= t1:
            return f0 if t1 == t0 else f0 + (f1 - f0) * (t - t0) / (t1 - t0)
    return points[-1][1] if t > points[-1][0] else points[0][1]


def integral(points, start, end, step=0.0005):
    if points[-1][0] < end:
        return float("nan")  # the run ends before
    n = round((end - start) / step)
    values = []
    index = 0
    for i in range(n + 1):
        t = start + i * step
        while index + 2 < len(points) and points[index + 1][0] < t:
            index += 1
        (t0, f0), (t1, f1) = points[index], points[index + 1]
        values.append(f0 + (f1 - f0) * (t - t0) / (t1 - t0) if t1 > t0 else f0)
    return step * (sum(values) - 0.5 * (values[0] + values[-1]))


def smooth(points, width):
    """Running mean over `width` seconds."""
    if width <= 0:
        return points
    out, low, high = [], 0, 0
    total, time = [0.0], points
    # integral up to each point, by trapezoids
    for (t0, f0), (t1, f1) in zip(points, points[1:]):
        total.append(total[-1] + 0.5 * (f0 + f1) * (t1 - t0))
    times = [t for t, _ in points]

    def upto(t):
        import bisect
        i = min(max(bisect.bisect_right(times, t) - 1, 0), len(times) - 2)
        share = (t - times[i]) / (times[i + 1] - times[i])
        share = min(1.0, max(0.0, share))
        f = points[i][1] + share * (points[i + 1][1] - points[i][1])
        return total[i] + 0.5 * (points[i][1] + f) * (t - times[i]) * (1 if share else 0)

    return [(t, (upto(t + width / 2) - upto(t - width / 2)) / width) for t in times
            if times[0] + width < t < times[-1] - width]


def figures(points, arrival=None):
    """Figures on the clock of the experiment; without `arrival`, the force passing 3 N gives it."""
    arrival = arrival or next(t for (t, f), (_, g) in zip(points, points[1:]) if f > ARRIVAL_N and g > ARRIVAL_N and t > 0.2)
    shifted = [(t - arrival + ARRIVAL_S, f) for t, f in points]
    window = lambda start, end: [f for t, f in shifted if start <= t <= end]
    return {
        "arrival_s": arrival,
        "peak_n": max(window(0.3, 0.5)),
        "peak_20ms_n": max(f for t, f in smooth(shifted, 0.02) if 0.3 < t < 0.5),
        "plateau_n": integral(shifted, *PLATEAU_S) / (PLATEAU_S[1] - PLATEAU_S[0]),
        "impulse_to_0.5_s_ns": integral(shifted, 0.34, 0.5),
        "impulse_ns": integral(shifted, *IMPULSE_S),
    }


def main():
    if sys.argv[1] == "--extract":
        folder = Path(sys.argv[2])
        text = "time_s,force_n\n" + "".join(f"{t:.5f},{f:.4f}\n" for t, f in history(folder))
        (folder / "force.csv").write_text(text)
        return
    if sys.argv[1] == "--table":
        runs = {}
        for path in sys.argv[2:]:
            points = [tuple(map(float, line.split(","))) for line in Path(path).read_text().splitlines()[1:]]
            arrival = figures(points)["arrival_s"]
            runs[Path(path).parent.name] = [(t - arrival + ARRIVAL_S, f) for t, f in points]
        print("time_s," + ",".join(f"{name}_n" for name in runs))
        for i in range(33, 110):
            t = 0.01 * i
            cells = [f"{integral(p, t - 0.005, t + 0.005) / 0.01:.2f}" if p[-1][0] > t + 0.005 else "" for p in runs.values()]
            print(f"{t:.2f}," + ",".join(cells))
        return
    rows = {"measured": figures(binned(measured(sys.argv[2]), 0.01), ARRIVAL_S)}
    for path in sys.argv[3:]:
        points = [tuple(map(float, line.split(","))) for line in Path(path).read_text().splitlines()[1:]]
        rows[Path(path).parent.name] = figures(points)
    names = list(rows["measured"])
    print("mesh," + ",".join(names))
    for name, row in rows.items():
        print(name + "," + ",".join(f"{row[n]:.4g}" for n in names))


if __name__ == "__main__":
    main()
