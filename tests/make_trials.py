#!/usr/bin/env python3
"""Generates the trials of README's story, tests/data/wading, and its figure from the weights that are shipped with the Husky.

    python3 tests/make_trials.py target/release/wade

To be run again whenever vehicles/husky gets other weights: the measured force of a trial is what these weights say, an
effect that they know nothing of, and noise. Nothing of it was measured. The effect is written out here, by a formula of its
own; the folder does not name it.
"""

import csv
import hashlib
import math
import random
import re
import struct
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUNDLE = ROOT / "vehicles" / "husky"
FOLDER = ROOT / "tests" / "data" / "wading"
FIGURE = ROOT / "tests" / "data" / "wading.svg"

SEED = 7
TRIALS = 12
DURATION_S = 8.0
STEP_S = 0.02
DEPTHS_M = [0.11, 0.15, 0.19]
DENSITY = 1000.0
# the water that moves with the hull along its axis, over the water that the hull displaces: what the weights lack
HIDDEN = 0.8
# standard deviations of one sample: a load cell, a camera's velocity
FORCE_NOISE_N = {"fx": 1.5, "fz": 3.0}
SPEED_NOISE_MPS = 0.003


def displaced_volume(triangles, level):
    """Water displaced up to the plane z = level [m3]: the integral of (z - level) n_z over the wet surface."""
    volume = 0.0
    for corners in triangles:
        wet = []
        for a, b in zip(corners, corners[1:] + corners[:1]):
            if a[2] <= level:
                wet.append(a)
            if (a[2] - level) * (b[2] - level) < 0.0:
                share = (level - a[2]) / (b[2] - a[2])
                wet.append(tuple(p + share * (q - p) for p, q in zip(a, b)))
        for b, c in zip(wet[1:], wet[2:]):
            a = wet[0]
            seen_from_above = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]))
            volume += seen_from_above * ((a[2] + b[2] + c[2]) / 3.0 - level)
    return volume


def read_stl(path):
    data = path.read_bytes()
    (count,) = struct.unpack_from("<I", data, 80)
    facets = (struct.unpack_from("<12f", data, 84 + 50 * i) for i in range(count))
    return [[f[3:6], f[6:9], f[9:12]] for f in facets]


class Motion:
    """Straight ahead, faster and slower: two sines about a mean, within the speeds of the training."""

    def __init__(self, index, rng):
        self.depth = DEPTHS_M[index % len(DEPTHS_M)]
        self.mean = rng.uniform(0.58, 0.66)
        self.waves = [
            (rng.uniform(0.20, 0.27), rng.uniform(1.0, 1.7), rng.uniform(0.0, math.tau)),
            (rng.uniform(0.06, 0.10), rng.uniform(2.0, 3.0), rng.uniform(0.0, math.tau)),
        ]

    def speed(self, t):
        return self.mean + sum(size * math.sin(rate * t + phase) for size, rate, phase in self.waves)

    def acceleration(self, t):
        return sum(size * rate * math.cos(rate * t + phase) for size, rate, phase in self.waves)


def predicted(wade, states):
    """Forces by the shipped weights, a row a state (speed, depth)."""
    with tempfile.TemporaryDirectory() as folder:
        table, answers = Path(folder) / "states.csv", Path(folder) / "answers.csv"
        with table.open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["vx", "vy", "vz", "depth", "rho"])
            writer.writerows([speed, 0, 0, depth, DENSITY] for speed, depth in states)
        command = [wade, "predict", "--vehicle", "husky", "--vehicles", BUNDLE.parent]
        subprocess.run([*command, "--states", table, "--out", answers], check=True)
        with answers.open(newline="") as file:
            return [{name: float(row[name]) for name in FORCE_NOISE_N} for row in csv.DictReader(file)]


def figure(wade):
    """The first trace of the page: a trial that took no part, before and after."""
    with tempfile.TemporaryDirectory() as folder:
        command = [wade, "gap", "--vehicle", "husky", "--vehicles", BUNDLE.parent, "--trials", FOLDER, "--out", folder]
        subprocess.run(command, check=True)
        page = (Path(folder) / "index.html").read_text()
    traces = page[page.index("The trials with the largest gap") :]
    return re.search(r"<svg.*?</svg>", traces, re.DOTALL).group()


def main():
    wade = sys.argv[1] if len(sys.argv) == 2 else sys.exit(__doc__)
    if (BUNDLE / "effects.toml").exists():
        sys.exit(f"{BUNDLE} has effects: take them back first (wade vehicle rollback husky)")
    rng = random.Random(SEED)
    vehicle = tomllib.loads((BUNDLE / "vehicle.toml").read_text())
    hull = read_stl(BUNDLE / "hull.stl")
    mass = {d: HIDDEN * DENSITY * displaced_volume(hull, vehicle["z0_m"] + d) for d in DEPTHS_M}
    motions = [Motion(index, rng) for index in range(TRIALS)]
    times = [STEP_S * i for i in range(round(DURATION_S / STEP_S))]
    forces = iter(predicted(wade, [(motion.speed(t), motion.depth) for motion in motions for t in times]))

    FOLDER.mkdir(parents=True, exist_ok=True)
    for old in FOLDER.glob("*.csv"):
        old.unlink()
    for index, motion in enumerate(motions):
        lines = ["# generated, not measured", "t,vx,vy,vz,wx,wy,wz,depth,fx,fz"]
        for t in times:
            force = next(forces)
            fx = force["fx"] - mass[motion.depth] * motion.acceleration(t) + rng.gauss(0.0, FORCE_NOISE_N["fx"])
            fz = force["fz"] + rng.gauss(0.0, FORCE_NOISE_N["fz"])
            vx = motion.speed(t) + rng.gauss(0.0, SPEED_NOISE_MPS)
            lines.append(f"{t:.2f},{vx:.4f},0,0,0,0,0,{motion.depth},{fx:.2f},{fz:.2f}")
        (FOLDER / f"generated-{index:02}.csv").write_text("\n".join(lines) + "\n")
    weights = hashlib.sha256((BUNDLE / "network.safetensors").read_bytes()).hexdigest()
    noise = "\n".join(f"{name} = {value}" for name, value in FORCE_NOISE_N.items())
    (FOLDER / "trials.toml").write_text(
        f"""vehicle = "husky"
generated = "by tests/make_trials.py from the weights with SHA-256 {weights}; nothing of it was measured"
fluid_density = {DENSITY}

[measured]
columns = ["fx", "fz"]
method = "load_cell"

[sensor_noise]
{noise}
"""
    )
    FIGURE.write_text(figure(wade) + "\n")
    print(f"{FOLDER.relative_to(ROOT)}: {TRIALS} trials, generated")


if __name__ == "__main__":
    main()
