"""The same query to the Python baseline and to wade, in one run with one client.

Both servers run on the same CPU, the client on another. The subjects take turns in blocks, so that a drift of the
machine meets all of them.
"""

import argparse
import contextlib
import datetime
import json
import os
import platform
import socket
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

import grpc
import numpy as np

sys.dont_write_bytecode = True  # the import leaves nothing in the checkout
from server import ROOT, load_stubs

VEHICLE = "husky"
WARM_UP = 500
TOLERANCE = 1e-3
# velocity [m/s] and depth [m] of the states in which the answers are compared; the first is the one that is timed
STATES = [((0.8, 0.0, 0.0), 0.19), ((0.5, 0.2, 0.0), 0.12), ((-0.3, 0.0, 0.02), 0.07), ((0.0, 0.0, 0.0), 0.15)]


def free_address():
    """A port on loopback that nobody uses."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"127.0.0.1:{probe.getsockname()[1]}"


@contextlib.contextmanager
def child(command, cpu):
    """A process kept on one CPU, ended on the way out."""
    process = subprocess.Popen(command, cwd=ROOT, preexec_fn=lambda: os.sched_setaffinity(0, {cpu}))
    try:
        yield process
    finally:
        process.terminate()
        process.wait(timeout=30)


@contextlib.contextmanager
def connected(address, services):
    """The client of a server, once that answers."""
    with grpc.insecure_channel(address) as channel:
        grpc.channel_ready_future(channel).result(timeout=60)
        yield services.HydrodynamicsStub(channel)


def request(messages, velocity, depth):
    """A level state in fresh water."""
    x, y, z = velocity
    state = messages.State(velocity_mps=messages.Vector3(x=x, y=y, z=z), depth_m=depth)
    return messages.EvaluateRequest(vehicle=VEHICLE, state=state)


def vectors(response):
    """Everything in an answer that is compared, as rows of three."""
    wrench = response.wrench
    fractions = [(fraction, 0.0, 0.0) for fraction in response.wetted_fraction]
    forces = np.reshape(response.surface_force_n, (-1, 3))
    points = np.reshape(response.surface_point_m, (-1, 3))
    nets = [(v.x, v.y, v.z) for v in (wrench.force_n, wrench.moment_nm, wrench.about_m)]
    return np.concatenate([forces, points, fractions, nets])


def check_same(baseline, wade, messages):
    """The largest relative difference between the answers; ends the run where it is above the tolerance."""
    worst = 0.0
    for velocity, depth in STATES:
        query = request(messages, velocity, depth)
        ours, theirs = vectors(wade.Evaluate(query)), vectors(baseline.Evaluate(query))
        if ours.shape != theirs.shape:
            sys.exit(f"the answers differ in shape: {ours.shape} and {theirs.shape}")
        size = np.maximum(np.linalg.norm(ours, axis=1), 1e-3)
        error = (np.linalg.norm(ours - theirs, axis=1) / size).max()
        if not error <= TOLERANCE:
            sys.exit(f"the answers at {velocity} m/s, {depth} m differ by {error:.2e}, more than {TOLERANCE:.0e}")
        worst = max(worst, float(error))
    return worst


def timed(call, argument, count):
    """Time of each of `count` calls [us], and the times that the answers state for their computation [us]."""
    times, computes = [], []
    for _ in range(count):
        start = time.perf_counter_ns()
        answer = call(argument)
        times.append((time.perf_counter_ns() - start) / 1e3)
        computes.append(getattr(answer, "compute_ns", 0) / 1e3)
    return times, computes


def measure(subjects, blocks, calls):
    """Percentiles of each subject."""
    for call, argument in subjects.values():
        timed(call, argument, WARM_UP)
    samples = {name: ([], []) for name in subjects}
    for block in range(blocks):
        # every other round backward: none always comes after the same one
        for name in list(subjects)[:: 1 if block % 2 == 0 else -1]:
            for kept, new in zip(samples[name], timed(*subjects[name], calls)):
                kept.extend(new)
    results = {}
    for name, (times, computes) in samples.items():
        p50, p95, p99 = np.percentile(times, [50, 95, 99])
        results[name] = {"calls": len(times), "p50_us": p50, "p95_us": p95, "p99_us": p99}
        if any(computes):
            results[name]["compute_p50_us"] = float(np.median(computes))
    return results


def machine():
    """What the numbers were measured on and with."""
    models = [line.split(":", 1)[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")]
    commit = ["git", "rev-parse", "HEAD"], ["git", "status", "--porcelain", "--untracked-files=no"]
    head, changes = (subprocess.run(c, cwd=ROOT, capture_output=True, text=True).stdout.strip() for c in commit)
    return {
        "cpu": models[0] if models else platform.processor(),
        "cores": os.cpu_count(),
        "commit": head + ("-dirty" if changes else ""),
        "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
        "python": platform.python_version(),
        **{name: version(name) for name in ("grpcio", "onnxruntime", "numpy", "protobuf")},
    }


def main():
    """Starts both servers, compares their answers, measures, prints."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--wade", type=Path, default=ROOT / "target" / "release" / "wade")
    parser.add_argument("--vehicles", type=Path, default=ROOT / "vehicles")
    parser.add_argument("--blocks", type=int, default=20)
    parser.add_argument("--calls", type=int, default=500, help="calls of a block")
    parser.add_argument("--out", type=Path, help="JSON file for the results")
    arguments = parser.parse_args()
    cpus = sorted(os.sched_getaffinity(0))
    if len(cpus) < 2:
        sys.exit("two CPUs are needed: one for the servers, one for the client")
    server_cpu, client_cpu = cpus[0], cpus[1]
    os.sched_setaffinity(0, {client_cpu})

    messages, services = load_stubs()
    vehicles = arguments.vehicles.resolve()
    python_at, wade_at = free_address(), free_address()
    python_command = [sys.executable, Path(__file__).with_name("server.py").resolve()]
    python_command += ["--bundle", vehicles / VEHICLE, "--listen", python_at]
    wade_command = [arguments.wade.resolve(), "serve", "--vehicles", vehicles, "--listen", wade_at]
    wade_command += ["--http", free_address(), "--shm", "off", "--log", "warn"]
    with (
        tempfile.TemporaryDirectory() as folder,
        child(python_command, server_cpu),
        child([*wade_command, "--unix-socket", f"{folder}/wade.sock"], server_cpu),
        connected(python_at, services) as baseline,
        connected(wade_at, services) as wade,
    ):
        difference = check_same(baseline, wade, messages)
        query, nothing = request(messages, *STATES[0]), messages.ListVehiclesRequest()
        results = measure(
            {
                "Python server + ONNX Runtime": (baseline.Evaluate, query),
                "wade": (wade.Evaluate, query),
                "control: echo, Python server": (baseline.ListVehicles, nothing),
                "control: echo, wade": (wade.ListVehicles, nothing),
            },
            arguments.blocks,
            arguments.calls,
        )

    ratio = results["Python server + ONNX Runtime"]["p50_us"] / results["wade"]["p50_us"]
    print(f"{'[us]':30} {'p50':>8} {'p95':>8} {'p99':>8} {'compute p50':>12}")
    for name, row in results.items():
        compute = f"{row['compute_p50_us']:12.1f}" if "compute_p50_us" in row else ""
        print(f"{name:30} {row['p50_us']:8.1f} {row['p95_us']:8.1f} {row['p99_us']:8.1f} {compute}")
    print(f"p50, Python over wade: {ratio:.2f}")
    print(f"largest relative difference between the answers: {difference:.1e}")
    if arguments.out:
        report = {
            "machine": machine(),
            "vehicle": VEHICLE,
            "velocity_mps": STATES[0][0],
            "depth_m": STATES[0][1],
            "server_cpu": server_cpu,
            "client_cpu": client_cpu,
            "results": results,
            "p50_ratio": ratio,
            "largest_relative_difference": difference,
        }
        arguments.out.write_text(json.dumps(report, indent=2) + "\n")


if __name__ == "__main__":
    main()
