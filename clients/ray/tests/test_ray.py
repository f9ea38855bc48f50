"""Promise: every row comes back once with the forces of its state, also where an actor is killed or a run is ended."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
import pytest
import ray
import wade

import wade_ray

ROWS = int(os.environ.get("WADE_RAY_ROWS", "100000"))
FILES = 8


@pytest.fixture(scope="session")
def address() -> Iterator[str]:
    """A server of its own."""
    root = Path(__file__).resolve().parents[3]
    program = os.environ.get("WADE_BIN", str(root / "target/debug/wade"))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    at = f"127.0.0.1:{port}"
    off = ["--unix-socket", "", "--http", "", "--shm", "off", "--log", "error"]
    server = subprocess.Popen([program, "serve", "--listen", at, *off, "--vehicles", str(root / "vehicles")])
    end = time.monotonic() + 60
    while True:
        try:
            with wade.connect(at) as client:
                client.evaluate("husky", wade.State(depth_m=0.1))
            break
        except wade.ServerUnavailable:
            assert time.monotonic() < end
            time.sleep(0.2)
    yield at
    server.terminate()
    assert server.wait(timeout=30) == 0


@pytest.fixture(scope="session")
def cluster() -> Iterator[None]:
    """A Ray of this machine."""
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    # actors find this environment's packages, and no other
    ray.init(num_cpus=4, include_dashboard=False, log_to_driver=False)
    yield
    ray.shutdown()


def written(folder: Path, rows: int, files: int = FILES) -> Path:
    """States, each with its number."""
    chance = np.random.default_rng(1)
    folder.mkdir()
    for number, rows_of_file in enumerate(np.array_split(np.arange(rows), files)):
        count = len(rows_of_file)
        columns = {
            "row": rows_of_file,
            "vx": chance.uniform(-0.8, 0.8, count).astype(np.float32),
            "vy": chance.uniform(-0.3, 0.3, count).astype(np.float32),
            "vz": np.zeros(count, np.float32),
            "depth": chance.uniform(0.05, 0.35, count).astype(np.float32),
            "roll": chance.uniform(-0.2, 0.2, count).astype(np.float32),
            "pitch": chance.uniform(-0.2, 0.2, count).astype(np.float32),
        }
        parquet.write_table(pa.table(columns), folder / f"states-{number}.parquet")
    return folder


def read(folder: Path) -> pa.Table:
    """All that was written."""
    return pa.concat_tables(parquet.read_table(file) for file in sorted(folder.glob("group-*/*.parquet")))


def kill_one_actor() -> None:
    """Kills an actor that has begun to answer."""
    end = time.monotonic() + 120
    while time.monotonic() < end:
        for process in Path("/proc").glob("[0-9]*/cmdline"):
            # Ray names a process by what it does: a method of the actor while it is at work
            try:
                name = process.read_bytes()
            except OSError:
                continue
            if name.startswith(b"ray::MapWorker(MapBatches(Forces)).submit"):
                os.kill(int(process.parent.name), signal.SIGKILL)
                return
        time.sleep(0.05)
    raise AssertionError("no actor was there to be killed")


def test_every_row_comes_back_although_an_actor_is_killed(tmp_path: Path, address: str, cluster: None) -> None:
    states, out = written(tmp_path / "states", ROWS), tmp_path / "out"
    killed: list[BaseException | None] = []

    def kill() -> None:
        try:
            kill_one_actor()
            killed.append(None)
        except BaseException as error:
            killed.append(error)

    killer = threading.Thread(target=kill)
    killer.start()
    rows = wade_ray.predict(states, out, "husky", [address], batch_rows=512, files_at_once=FILES)
    killer.join()
    assert killed == [None]
    table = read(out)
    assert rows == ROWS == table.num_rows
    assert sorted(table["row"].to_pylist()) == list(range(ROWS))
    # the forces are those of a client that asks by itself
    some = table.slice(ROWS // 2, 100).to_pydict()
    state = wade.State(
        depth_m=some["depth"],
        velocity_mps=np.stack([some["vx"], some["vy"], some["vz"]], axis=1),
        roll_pitch_rad=np.stack([some["roll"], some["pitch"]], axis=1),
    )
    with wade.connect(address) as client:
        forces = client.evaluate_batch("husky", state)
    assert np.array_equal(forces.force_n, np.stack([some["fx"], some["fy"], some["fz"]], axis=1).astype(np.float32))
    assert np.array_equal(forces.in_domain, some["in_domain"])


def test_a_run_that_was_ended_goes_on_where_it_was(tmp_path: Path, address: str) -> None:
    rows = 20_000
    states, out = written(tmp_path / "states", rows), tmp_path / "out"
    asked = [str(states), str(out), "--vehicle", "husky", "--address", address, "--files-at-once", "2"]
    command = [sys.executable, "-m", "wade_ray", *asked]
    environment = os.environ | {"RAY_USAGE_STATS_ENABLED": "0"}
    first = subprocess.Popen(command, env=environment, start_new_session=True)
    while not (out / "group-00000").exists():
        assert first.poll() is None
        time.sleep(0.05)
    os.killpg(first.pid, signal.SIGKILL)
    first.wait()
    before = {file: file.stat().st_mtime_ns for file in out.glob("group-*/*")}
    assert 0 < len(list(out.glob("group-*"))) < 4
    subprocess.run(command, env=environment, check=True, timeout=300)
    table = read(out)
    assert sorted(table["row"].to_pylist()) == list(range(rows))
    assert {file: file.stat().st_mtime_ns for file in before} == before
    assert not list(out.glob(".group-*"))


def test_other_files_and_states_that_are_refused_are_named(tmp_path: Path, address: str, cluster: None) -> None:
    states, out = written(tmp_path / "states", 100, files=1), tmp_path / "out"
    wade_ray.predict(states, out, "husky", [address])
    parquet.write_table(pa.table({"depth": [0.1]}), states / "states-0.parquet")
    with pytest.raises(FileExistsError, match="was made of other files"):
        wade_ray.predict(states, out, "husky", [address])
    parquet.write_table(pa.table({"depth": [0.1], "roll": [0.2]}), states / "states-0.parquet")
    with pytest.raises(ray.exceptions.RayError, match="roll needs pitch too"):
        wade_ray.predict(states, tmp_path / "other", "husky", [address])
    assert not list((tmp_path / "other").glob("group-*"))
