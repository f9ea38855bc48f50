"""Round trips from Python and calls in process, each beside a bare grpcio echo in the same run.

    python clients/python/benches/roundtrip.py --out benches/results/DATE/python-client.json

The echo server is Python's: it gives back bytes of the length that the server's answer has, without serialization on
either side. Blocks of calls alternate between the cases, so that what else the machine does hits all of them; the least
and the median over the blocks' medians are reported: on a busy machine the least is that of a block which nothing
interrupted.
"""

from __future__ import annotations

import argparse
import asyncio
import datetime
import json
import os
import platform
import shlex
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from functools import partial
from importlib.metadata import version
from pathlib import Path
from queue import SimpleQueue
from typing import Any, NamedTuple

import grpc
import numpy as np

import wade
import wade.aio
from wade import messages

ROOT = Path(__file__).resolve().parents[3]
VEHICLE = "husky"
STATE = wade.State(depth_m=0.18, velocity_mps=(0.8, 0.0, 0.0))
BATCH = 1024
STATES = wade.State(
    depth_m=np.linspace(0.06, 0.20, BATCH, dtype=np.float32),
    velocity_mps=np.linspace((0.2, -0.1, 0), (1.0, 0.1, 0), BATCH, dtype=np.float32),
)
PLACEMENTS = {"one core": (0, 0), "a core each": (0, 1)}

#: A case runs this many calls and gives the time of each [ns].
Case = Callable[[int], list[int]]


def timed(call: Callable[[], object]) -> Case:
    """The case of a plain call."""

    def run(calls: int) -> list[int]:
        times = []
        for _ in range(calls):
            start = time.perf_counter_ns()
            call()
            times.append(time.perf_counter_ns() - start)
        return times

    return run


def awaited(stream: Any, loop: asyncio.AbstractEventLoop) -> Case:
    """The case of an asyncio stream, which stays in its loop from call to call."""

    async def run(calls: int) -> list[int]:
        times = []
        for _ in range(calls):
            start = time.perf_counter_ns()
            await stream.evaluate(STATE)
            times.append(time.perf_counter_ns() - start)
        return times

    return lambda calls: loop.run_until_complete(run(calls))


def echo(address: str) -> None:
    """Serves until it is ended: the first eight digits of a request say how long the answer is to be."""

    class Handler(grpc.GenericRpcHandler):
        def service(self, call: Any) -> Any:
            if call.method == "/echo/stream":
                return grpc.stream_stream_rpc_method_handler(lambda requests, _: (bytes(int(r[:8])) for r in requests))
            return grpc.unary_unary_rpc_method_handler(lambda request, _: bytes(int(request[:8])))

    server = grpc.server(ThreadPoolExecutor(2), handlers=[Handler()])
    server.add_insecure_port(address)
    server.start()
    server.wait_for_termination()


def echo_cases(channel: Any, lengths: dict[str, tuple[int, int]]) -> dict[str, Case]:
    """Unary, stream and batch with requests and answers as long as the real ones."""
    unary, requests = channel.unary_unary("/echo/unary"), SimpleQueue[Any]()
    answers = channel.stream_stream("/echo/stream")(iter(requests.get, None))
    single, batch = (b"%08d" % answer + bytes(max(request - 8, 0)) for request, answer in lengths.values())

    def stream() -> None:
        requests.put(single)
        next(answers)

    return {
        "bare grpcio echo, unary": timed(lambda: unary(single)),
        "bare grpcio echo, stream": timed(stream),
        "bare grpcio echo, batch": timed(lambda: unary(batch)),
    }


def message_lengths(address: str) -> dict[str, tuple[int, int]]:
    """Lengths of request and answer on the wire."""
    batch, _ = messages.evaluate_batch_request(VEHICLE, STATES, True)
    requests = {"Evaluate": messages.evaluate_request(VEHICLE, STATE), "EvaluateBatch": batch}
    with grpc.insecure_channel(address) as channel:
        calls = messages.calls(channel)
        return {name: (r.ByteSize(), calls[name](r, timeout=60).ByteSize()) for name, r in requests.items()}


@contextmanager
def child(command: list[Any], cpu: int) -> Iterator[int]:
    """A process on one CPU, for as long as the block lasts."""
    process = subprocess.Popen(
        list(map(str, command)), preexec_fn=lambda: os.sched_setaffinity(0, {cpu}), stderr=subprocess.DEVNULL
    )
    try:
        yield process.pid
    finally:
        process.terminate()
        process.wait()


def free_address() -> str:
    """A port that nobody listens on at the moment."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return "{}:{}".format(*probe.getsockname())


class Place(NamedTuple):
    """Where a server is, and its process."""

    address: str
    unix: str
    namespace: str
    pid: int


@contextmanager
def served(binary: Path, wait: str, cpu: int, vehicles: Path = ROOT / "vehicles") -> Iterator[Place]:
    """A server of our own."""
    with tempfile.TemporaryDirectory() as folder:
        address, namespace = free_address(), f"bench_{os.getpid()}_{wait}"
        settings = Path(folder) / "wade.toml"
        settings.write_text(f'[shm]\nwait = "{wait}"\nnamespace = "{namespace}"\n[http]\nlisten = ""\n')
        command = [binary, "serve", "--config", settings, "--vehicles", vehicles]
        command += ["--listen", address, "--unix-socket", f"{folder}/wade.sock", "--log", "error"]
        with child(command, cpu) as pid:
            until_ready(lambda: wade.GrpcClient(address).evaluate(VEHICLE, STATE))
            until_ready(lambda: wade.ShmClient(namespace).evaluate(VEHICLE, STATE))
            yield Place(address, f"unix:{folder}/wade.sock", namespace, pid)


def until_ready(call: Callable[[], object]) -> None:
    """Calls until it works, for half a minute at most."""
    end = time.monotonic() + 30
    while True:
        try:
            call()
            return
        except (wade.WadeError, grpc.RpcError):
            if time.monotonic() > end:
                raise
            time.sleep(0.1)


def cases(stack: ExitStack, binary: Path, placement: str) -> dict[str, Case]:
    """All cases that make sense with this placement; a server that polls needs a core of its own."""
    server_cpu, client_cpu = PLACEMENTS[placement]
    os.sched_setaffinity(0, {client_cpu})
    address, unix, namespace, _ = stack.enter_context(served(binary, "block", server_cpu))
    echo_at = free_address()
    stack.enter_context(child([sys.executable, __file__, "--echo", echo_at], server_cpu))
    channel = stack.enter_context(grpc.insecure_channel(echo_at))
    until_ready(lambda: channel.unary_unary("/echo/unary")(b"%08d" % 8, timeout=1))

    def client(of: Any) -> Any:
        return stack.enter_context(of)

    rpc, shm = client(wade.GrpcClient(address, timeout_s=60)), client(wade.ShmClient(namespace, timeout_s=60))
    own = client(wade.InProcess(ROOT / "vehicles"))
    loop = asyncio.new_event_loop()

    async def open_stream() -> Any:
        return wade.aio.GrpcClient(address, timeout_s=60).stream(VEHICLE)

    streams = {
        "gRPC stream": client(rpc.stream(VEHICLE)),
        "gRPC stream, Unix socket": client(client(wade.GrpcClient(unix, timeout_s=60)).stream(VEHICLE)),
    }
    found = echo_cases(channel, message_lengths(address))
    found |= {"gRPC unary": timed(lambda: rpc.evaluate(VEHICLE, STATE))}
    for name, stream in streams.items():
        found[name] = timed(partial(stream.evaluate, STATE))
    found |= {
        "gRPC stream, asyncio": awaited(loop.run_until_complete(open_stream()), loop),
        "shared memory, blocking": timed(lambda: shm.evaluate(VEHICLE, STATE)),
        "in process": timed(lambda: own.evaluate(VEHICLE, STATE)),
        f"in process batch of {BATCH}": timed(lambda: own.evaluate_batch(VEHICLE, STATES)),
        f"gRPC batch of {BATCH}": timed(lambda: rpc.evaluate_batch(VEHICLE, STATES)),
        f"shared memory batch of {BATCH}": timed(lambda: shm.evaluate_batch(VEHICLE, STATES)),
    }
    if server_cpu != client_cpu:
        polling = stack.enter_context(served(binary, "spin", server_cpu))
        spin = client(wade.ShmClient(polling.namespace, wait="spin", timeout_s=60))
        found["shared memory, polling"] = timed(lambda: spin.evaluate(VEHICLE, STATE))
    return found


def measure(cases: dict[str, Case], blocks: int, calls: int) -> dict[str, dict[str, float]]:
    """Percentiles of each case over its blocks [us]; of a batch, of a state in it."""
    times: dict[str, list[np.ndarray]] = {name: [] for name in cases}
    cpu: dict[str, list[float]] = {name: [] for name in cases}
    for block in range(blocks + 1):
        for name, case in cases.items():
            per = BATCH if "batch" in name else 1
            count = max(calls // per, 1)
            before = time.process_time_ns()
            block_times = np.array(case(count)) / 1e3 / per
            if block > 0:  # the first warms up
                times[name].append(block_times)
                cpu[name].append((time.process_time_ns() - before) / 1e3 / per / count)
    rows = {}
    for name in cases:
        medians = [float(np.median(block_times)) for block_times in times[name]]
        rows[name] = {
            "p50_us_least": min(medians),
            "p50_us_median": float(np.median(medians)),
            "p99_us": float(np.percentile(np.concatenate(times[name]), 99)),
            "client_cpu_us": float(np.median(cpu[name])),
        }
    return rows


def machine(binary: Path) -> dict[str, Any]:
    """Where and with what this runs; to be asked at the start. The server may be of another commit than the client."""
    models = [
        line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if "model name" in line
    ]
    commands = ["git", "rev-parse", "HEAD"], ["git", "status", "--porcelain", "--untracked-files=no"]
    head, changes = (subprocess.run(c, cwd=ROOT, capture_output=True, text=True).stdout.strip() for c in commands)
    return {
        "cpu": models[0] if models else platform.processor(),
        "cores": os.cpu_count(),
        "load_average": os.getloadavg(),
        "niceness": os.nice(0),
        "commit": head + ("-dirty" if changes else ""),
        "server": subprocess.run([binary, "--version"], capture_output=True, text=True).stdout.strip(),
        "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
        "command": shlex.join(["python", *sys.argv]),
        "python": platform.python_version(),
        **{name: version(name) for name in ("grpcio", "iceoryx2", "numpy", "protobuf")},
    }


def main() -> None:
    """Measures each placement in a process of its own, since the threads of gRPC stay where they were made."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--wade", type=Path, default=ROOT / "target" / "release" / "wade")
    parser.add_argument("--blocks", type=int, default=60)
    parser.add_argument("--calls", type=int, default=100, help="calls of a block; a block of batches is one")
    parser.add_argument("--note", default="", help="what else the machine does, for the results")
    parser.add_argument("--out", type=Path, help="JSON file for the results")
    parser.add_argument("--echo", help=argparse.SUPPRESS)
    parser.add_argument("--placement", choices=PLACEMENTS, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.echo:
        echo(arguments.echo)
        return
    if arguments.placement:
        with ExitStack() as stack:
            found = cases(stack, arguments.wade.resolve(), arguments.placement)
            print(json.dumps(measure(found, arguments.blocks, arguments.calls)))
        return
    results, started = {}, machine(arguments.wade)
    for placement in PLACEMENTS:
        command = [sys.executable, __file__, *sys.argv[1:], "--placement", placement]
        results[placement] = json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)
        print(f"{placement:34} {'p50 least':>10} {'median':>8} {'p99':>9} {'client CPU':>11}  [us]")
        for name, row in results[placement].items():
            figures = [row[key] for key in ("p50_us_least", "p50_us_median", "p99_us", "client_cpu_us")]
            print(f"{name:34} {{:10.1f}} {{:8.1f}} {{:9.1f}} {{:11.1f}}".format(*figures))
    if arguments.out:
        report = {"machine": started, "note": arguments.note, "vehicle": VEHICLE, "results": results}
        arguments.out.write_text(json.dumps(report, indent=2) + "\n")


if __name__ == "__main__":
    main()
