"""Seconds an epoch of the paper's training takes: `wade train --variant paper` and PyTorch, in turns, in one run.

    python3 benches/python/epoch.py --wade target/release/wade --out epoch.json

The same work for both: of 11,200 samples, half of them of 13 surfaces (Husky) and half of 10 (Warthog), nine tenths to learn from in
batches of 16, and a tenth that sets the pace in batches of 64 (`validation_share`; the 2,800 held out are looked at after the last epoch alone); the
paper's network, loss and optimizer. The numbers that PyTorch learns from are random: they change no time.
"""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import torch

ROOT = Path(__file__).resolve().parent.parent.parent
ALPHA, EPSILON, NET, DRY = 0.5, 0.01, 0.1, 0.5
# cases by formula of each vehicle, which make four samples each: mirror images, or cases astern
CASES = {"husky": 1750, "warthog": 1750}
SAMPLES, SURFACES = 5600, (13, 10)
# `validation_share` of `wade train`
PACE = SAMPLES // 10


def samples(count, surfaces):
    """Inputs of each surface, inputs of the state, targets, and which surfaces are dry."""
    return (torch.randn(count, surfaces, 15), torch.randn(count, 12), torch.randn(count, surfaces, 3),
            torch.rand(count, surfaces) < 0.2)


class Torch:
    """The paper's training in PyTorch, written as one would."""

    def __init__(self):
        torch.manual_seed(1)
        self.training = [samples(SAMPLES - PACE, surfaces) for surfaces in SURFACES]
        self.pace = [samples(PACE, surfaces) for surfaces in SURFACES]
        layers = [torch.nn.Linear(27, 256), torch.nn.ReLU(), torch.nn.Linear(256, 256), torch.nn.ReLU(), torch.nn.Linear(256, 3)]
        self.model = torch.nn.Sequential(*layers)
        self.optimizer = torch.optim.Adam(self.model.parameters(), lr=1e-3)
        self.std, self.mean = torch.tensor([0.3, 1.7, 0.9]), torch.tensor([0.1, -0.2, 0.4])

    def loss(self, surface, flow, target, dry):
        rows = torch.cat([surface, flow[:, None, :].expand(-1, surface.shape[1], -1)], dim=2)
        output = self.model(rows)
        error = output - target
        relative = error / target.abs().clamp(min=EPSILON)
        hybrid = (1 - ALPHA) * error.square().mean() + ALPHA * relative.square().mean()
        force, truth = output * self.std + self.mean, target * self.std + self.mean
        net = (force.sum(1) - truth.sum(1)).square().mean()
        penalty = (force.square() * dry[..., None]).sum() / (3 * dry.sum()).clamp(min=1)
        return hybrid + NET * net + DRY * penalty

    def epoch(self, threads):
        """Seconds of one epoch."""
        torch.set_num_threads(threads)
        begun = time.perf_counter()
        for side, numbers in batches(self.training, 16, shuffle=True):
            self.optimizer.zero_grad()
            self.loss(*(part[numbers] for part in side)).backward()
            self.optimizer.step()
        with torch.no_grad():
            for side, numbers in batches(self.pace, 64, shuffle=False):
                self.loss(*(part[numbers] for part in side))
        return time.perf_counter() - begun


def batches(sides, size, shuffle):
    """Batches of one vehicle each, in random order if wanted."""
    found = []
    for side in sides:
        count = side[0].shape[0]
        order = torch.randperm(count) if shuffle else torch.arange(count)
        found += [(side, order[i:i + size]) for i in range(0, count, size)]
    return [found[i] for i in torch.randperm(len(found))] if shuffle else found


class Wade:
    """`wade train` in a folder of its own, which no shipped bundle is changed by."""

    def __init__(self, program, folder):
        self.program, self.folder = program, folder
        shutil.copytree(ROOT / "vehicles", folder / "vehicles")
        for vehicle, cases in CASES.items():
            self.run("dataset", "analytic", "--vehicle", vehicle, "--cases", str(cases), "--out", f"{vehicle}.parquet")
        self.run("dataset", "merge", *(f"{vehicle}.parquet" for vehicle in CASES), "--out", "analytic.parquet")

    def run(self, *arguments):
        done = subprocess.run([self.program, *arguments], cwd=self.folder, capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"wade {' '.join(arguments)}: {done.stderr}")
        return done.stdout + done.stderr

    def epochs(self, count):
        """Mean seconds of an epoch."""
        said = self.run("train", "--data", "analytic.parquet", "--variant", "paper", "--epochs", str(count), "--out", "out")
        learnt = f"{SAMPLES * len(SURFACES)} samples to learn from"
        if learnt not in said:
            sys.exit(f"`wade train` did not say `{learnt}`:\n{said}")
        return json.loads((self.folder / "out/report.json").read_text())["epoch_s"]


def blas():
    """The matrix library of this PyTorch."""
    lines = torch.__config__.show().splitlines()
    return next((part.strip() for line in lines for part in line.split(",") if "BLAS_INFO" in part), "none named")


def wade_version(program):
    return subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout.strip()


def machine():
    """The processor as the kernel names it."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "unknown")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wade", type=Path, default=ROOT / "target/release/wade", help="the program")
    parser.add_argument("--rounds", type=int, default=5, help="turns of each")
    parser.add_argument("--epochs", type=int, default=2, help="epochs of wade in a turn; PyTorch does one")
    parser.add_argument("--out", type=Path, help="the results as JSON")
    arguments = parser.parse_args()
    threads = sorted({1, len(os.sched_getaffinity(0))})
    seconds = {"wade": [], **{f"torch, {count} threads": [] for count in threads}}
    with tempfile.TemporaryDirectory() as folder:
        wade, opponent = Wade(arguments.wade.resolve(), Path(folder)), Torch()
        for _ in range(arguments.rounds):
            seconds["wade"].append(wade.epochs(arguments.epochs))
            for count in threads:
                seconds[f"torch, {count} threads"].append(opponent.epoch(count))
    ours = statistics.median(seconds["wade"])
    for name, times in seconds.items():
        middle = statistics.median(times)
        print(f"{name:20} {middle:6.2f} s an epoch ({min(times):.2f} to {max(times):.2f}), {middle / ours:.2f} of wade's")
    print(f"1000 epochs of wade: {ours * 1000 / 60:.0f} minutes; PyTorch {torch.__version__}")
    if arguments.out:
        about = {"torch": torch.__version__, "blas": blas(), "wade": wade_version(arguments.wade), "machine": machine()}
        arguments.out.write_text(json.dumps({**about, "seconds_an_epoch": seconds}, indent=1) + "\n")


if __name__ == "__main__":
    main()
