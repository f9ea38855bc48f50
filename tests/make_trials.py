#!/usr/bin/env python3
"""Generates the trials of README's story, tests/data/wading, and its figure from the bundle that is shipped of the Husky.

    python3 tests/make_trials.py target/release/wade

To be run again whenever vehicles/husky changes: the measured force of a trial is what this bundle says where the water
moves, and noise; the trials do not say that it moves. Nothing of it was measured. The folder does not name the effect.
"""

import csv
import hashlib
import math
import random
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUNDLE = ROOT / "vehicles" / "husky"
FOLDER = ROOT / "tests" / "data" / "wading"
FIGURE = ROOT / "tests" / "data" / "wading.svg"

SEED = 7
TRIALS = 24
DURATION_S = 6.0
STEP_S = 0.05
DEPTHS_M = [0.11, 0.15, 0.19]
# up the stream and down
HEADINGS_RAD = [0.0, math.pi]
DENSITY = 1000.0
# velocity of the water over ground, east [m/s]: what nobody told the model
HIDDEN = 0.25
# standard deviations of one sample: a load cell along x, a camera's velocity
FORCE_NOISE_N = {"fx": 1.5}
SPEED_NOISE_MPS = 0.003


class Motion:
    """Along the stream, faster and slower about a mean, within the speeds of the training."""

    def __init__(self, index, rng):
        self.depth = DEPTHS_M[index % len(DEPTHS_M)]
        self.heading = HEADINGS_RAD[index % len(HEADINGS_RAD)]
        self.mean = rng.uniform(0.4, 0.6)
        self.wave = (rng.uniform(0.07, 0.15), rng.uniform(0.3, 0.6), rng.uniform(0.0, math.tau))

    def speed(self, t):
        size, rate, phase = self.wave
        return self.mean + size * math.sin(rate * t + phase)

    def acceleration(self, t):
        size, rate, phase = self.wave
        return size * rate * math.cos(rate * t + phase)


def predicted(wade, motion, times):
    """Forces by the shipped bundle along a trial, in the water that moves."""
    with tempfile.TemporaryDirectory() as folder:
        table, answers = Path(folder) / "states.csv", Path(folder) / "answers.csv"
        current = HIDDEN * math.cos(motion.heading), -HIDDEN * math.sin(motion.heading)
        with table.open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["t", "vx", "vy", "vz", "ax", "cx", "cy", "depth", "rho"])
            for t in times:
                speed, acceleration = motion.speed(t), motion.acceleration(t)
                writer.writerow([t, speed, 0, 0, acceleration, *current, motion.depth, DENSITY])
        command = [wade, "predict", "--vehicle", "husky", "--vehicles", BUNDLE.parent]
        subprocess.run([*command, "--states", table, "--out", answers], check=True)
        with answers.open(newline="") as file:
            return [{name: float(row[name]) for name in FORCE_NOISE_N} for row in csv.DictReader(file)]


def figure(wade):
    """The gap of the first trial of the page: one that is held out, before and after."""
    with tempfile.TemporaryDirectory() as folder:
        command = [wade, "gap", "--vehicle", "husky", "--vehicles", BUNDLE.parent, "--trials", FOLDER, "--out", folder]
        subprocess.run(command, check=True)
        page = (Path(folder) / "index.html").read_text()
    traces = page[page.index("Trials over time") :]
    return re.findall(r"<svg.*?</svg>", traces, re.DOTALL)[1]


def main():
    wade = sys.argv[1] if len(sys.argv) == 2 else sys.exit(__doc__)
    if (BUNDLE / "effects.toml").exists():
        sys.exit(f"{BUNDLE} has effects: take them back first (wade vehicle rollback husky)")
    rng = random.Random(SEED)
    motions = [Motion(index, rng) for index in range(TRIALS)]
    times = [STEP_S * i for i in range(round(DURATION_S / STEP_S))]

    FOLDER.mkdir(parents=True, exist_ok=True)
    for old in FOLDER.glob("*.csv"):
        old.unlink()
    for index, motion in enumerate(motions):
        lines = ["# generated, not measured", "t,vx,vy,vz,wx,wy,wz,yaw,depth,fx"]
        for t, force in zip(times, predicted(wade, motion, times)):
            noisy = [force[name] + rng.gauss(0.0, noise) for name, noise in FORCE_NOISE_N.items()]
            vx = motion.speed(t) + rng.gauss(0.0, SPEED_NOISE_MPS)
            forces = ",".join(f"{value:.2f}" for value in noisy)
            lines.append(f"{t:.2f},{vx:.4f},0,0,0,0,0,{motion.heading:.4f},{motion.depth},{forces}")
        (FOLDER / f"generated-{index:02}.csv").write_text("\n".join(lines) + "\n")
    weights = hashlib.sha256((BUNDLE / "network.safetensors").read_bytes()).hexdigest()
    noise = "\n".join(f"{name} = {value}" for name, value in FORCE_NOISE_N.items())
    (FOLDER / "trials.toml").write_text(
        f"""vehicle = "husky"
generated = "by tests/make_trials.py from the weights with SHA-256 {weights}; nothing of it was measured"
fluid_density = {DENSITY}

[measured]
columns = ["fx"]
method = "load_cell"

[sensor_noise]
{noise}
"""
    )
    FIGURE.write_text(figure(wade) + "\n")
    print(f"{FOLDER.relative_to(ROOT)}: {TRIALS} trials, generated")


if __name__ == "__main__":
    main()
