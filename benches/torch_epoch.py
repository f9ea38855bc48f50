"""Seconds an epoch of the paper's training takes in PyTorch, for the same work as `wade train`: 11,200 training samples,
half of 13 and half of 10 surfaces, 2,800 held out, batches of 16 and 64, random numbers as data.

    python3 benches/torch_epoch.py [threads] [epochs]
"""

import sys
import time

import torch

THREADS = int(sys.argv[1]) if len(sys.argv) > 1 else 2
EPOCHS = int(sys.argv[2]) if len(sys.argv) > 2 else 3
torch.set_num_threads(THREADS)
torch.manual_seed(1)
ALPHA, EPSILON, NET, DRY = 0.5, 0.01, 0.1, 0.5


def data(count, surfaces):
    return (torch.randn(count, surfaces, 15), torch.randn(count, 12), torch.randn(count, surfaces, 3),
            torch.rand(count, surfaces) < 0.2)


model = torch.nn.Sequential(torch.nn.Linear(27, 256), torch.nn.ReLU(), torch.nn.Linear(256, 256), torch.nn.ReLU(),
                            torch.nn.Linear(256, 3))
optimizer = torch.optim.Adam(model.parameters(), lr=1e-3)
std, mean = torch.tensor([0.3, 1.7, 0.9]), torch.tensor([0.1, -0.2, 0.4])


def loss_of(surface, flow, target, dry):
    rows = torch.cat([surface, flow[:, None, :].expand(-1, surface.shape[1], -1)], dim=2)
    output = model(rows)
    error = output - target
    hybrid = (1 - ALPHA) * error.square().mean() + ALPHA * (error / target.abs().clamp(min=EPSILON)).square().mean()
    force, truth = output * std + mean, target * std + mean
    net = (force.sum(1) - truth.sum(1)).square().mean()
    penalty = (force.square() * dry[..., None]).sum() / (3 * dry.sum()).clamp(min=1)
    return hybrid + NET * net + DRY * penalty


training, held_out = [data(5600, 13), data(5600, 10)], [data(1400, 13), data(1400, 10)]


def batches(sides, size, shuffle):
    found = []
    for side in sides:
        count = side[0].shape[0]
        order = torch.randperm(count) if shuffle else torch.arange(count)
        found += [(side, order[i:i + size]) for i in range(0, count, size)]
    return [found[i] for i in torch.randperm(len(found))] if shuffle else found


for epoch in range(EPOCHS):
    begun = time.perf_counter()
    for side, numbers in batches(training, 16, True):
        optimizer.zero_grad()
        loss = loss_of(*(part[numbers] for part in side))
        loss.backward()
        optimizer.step()
    with torch.no_grad():
        for side, numbers in batches(held_out, 64, False):
            loss_of(*(part[numbers] for part in side))
    print(f"torch {torch.__version__}, {THREADS} threads: epoch {epoch + 1}, {time.perf_counter() - begun:.2f} s")
