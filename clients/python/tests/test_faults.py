"""Servers that are not there, die, hang, come back, or come back as another: a typed error in time, then forces."""

from __future__ import annotations

import asyncio
import ctypes
import itertools
import re
import shutil
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from hashlib import sha256
from pathlib import Path
from typing import Any

import grpc
import iceoryx2 as iox
import numpy as np
import pytest
from conftest import connect
from servers import VEHICLES, Server, rover

import wade
from wade import shm_layout
from wade.v1 import admin_pb2, admin_pb2_grpc

STATE = wade.State(depth_m=0.15, velocity_mps=(0.5, 0, 0))
BATCH = wade.State(depth_m=np.full(3, 0.15))
#: What a call may take beyond its timeout on a machine that is busy with other things.
GRACE_S = 2.0


def failing(call: Callable[[], Any], *kinds: type[Exception], within_s: float) -> Exception:
    """The error of a call, which must be of these kinds and come in time."""
    start = time.monotonic()
    with pytest.raises(kinds) as caught:
        call()
    assert time.monotonic() - start < within_s + GRACE_S
    return caught.value


def until_answered(call: Callable[[], wade.Forces]) -> wade.Forces:
    """The first call may still meet what the dead server left; no later one."""
    try:
        return call()
    except (wade.ServerUnavailable, wade.DeadlineExceeded):
        return call()


def test_an_absent_server(kind: str, mortal_server: Server, loop: asyncio.AbstractEventLoop) -> None:
    with connect(kind, mortal_server, loop, timeout_s=1.0) as client, client.stream("husky") as stream:
        calls = [
            lambda: client.evaluate("husky", STATE),
            lambda: client.evaluate_batch("husky", BATCH),
            lambda: stream.evaluate(STATE),
            lambda: client.vehicles(),
        ]
        for call in calls:
            error = failing(call, wade.ServerUnavailable, within_s=1.0)
            assert isinstance(error, ConnectionError) and isinstance(error, wade.ServerUnavailable)
            assert (
                error.at in (mortal_server.address, f"unix:{mortal_server.socket}")
                or mortal_server.namespace in error.at
            )
        mortal_server.start()
        assert client.evaluate("husky", STATE, timeout_s=20).force_n[2] > 0
        assert stream.evaluate(STATE, timeout_s=20).force_n[2] > 0


def test_a_killed_server_that_comes_back(kind: str, mortal_server: Server, loop: asyncio.AbstractEventLoop) -> None:
    mortal_server.start()
    with connect(kind, mortal_server, loop, timeout_s=1.0) as client, client.stream("husky") as stream:
        before = client.evaluate("husky", STATE, timeout_s=20)
        stream.evaluate(STATE, timeout_s=20)
        mortal_server.kill()
        for call in (
            lambda: stream.evaluate(STATE),
            lambda: client.evaluate("husky", STATE),
            lambda: client.evaluate_batch("husky", BATCH),
            lambda: stream.evaluate(STATE),
        ):
            failing(call, wade.ServerUnavailable, wade.DeadlineExceeded, within_s=1.0)
        mortal_server.start()
        after = client.evaluate("husky", STATE, timeout_s=20)
        np.testing.assert_array_equal(after.force_n, before.force_n)
        assert stream.evaluate(STATE, timeout_s=20).force_n[2] > 0
        assert client.evaluate_batch("husky", BATCH, timeout_s=20).force_n[2, 2] > 0


def test_a_restart_that_nobody_noticed(kind: str, mortal_server: Server, loop: asyncio.AbstractEventLoop) -> None:
    mortal_server.start()
    with connect(kind, mortal_server, loop, timeout_s=20.0) as client, client.stream("husky") as stream:
        stream.evaluate(STATE)
        client.evaluate("husky", STATE)
        mortal_server.kill()
        mortal_server.start()
        assert until_answered(lambda: client.evaluate("husky", STATE)).force_n[2] > 0
        assert until_answered(lambda: stream.evaluate(STATE)).force_n[2] > 0


def test_a_server_killed_while_it_is_asked(kind: str, mortal_server: Server, loop: asyncio.AbstractEventLoop) -> None:
    mortal_server.start()
    with connect(kind, mortal_server, loop, timeout_s=1.0) as client, client.stream("husky") as stream:
        stream.evaluate(STATE, timeout_s=20)
        client.evaluate("husky", STATE, timeout_s=20)
        mortal_server.freeze()
        for call in (
            lambda: client.evaluate("husky", STATE, timeout_s=0.2),
            lambda: stream.evaluate(STATE, timeout_s=0.2),
        ):
            error = failing(call, wade.DeadlineExceeded, within_s=0.2)
            assert "200 ms" in str(error)
        killer = threading.Timer(0.3, mortal_server.kill)
        killer.start()
        kinds = (wade.ServerUnavailable, wade.DeadlineExceeded)
        error = failing(lambda: client.evaluate("husky", STATE), *kinds, within_s=1.0)
        killer.join()
        # a connection breaks, shared memory just stays silent
        assert isinstance(error, wade.DeadlineExceeded if kind.startswith("shm") else wade.ServerUnavailable)
        mortal_server.start()
        assert client.evaluate("husky", STATE, timeout_s=20).force_n[2] > 0


def test_a_server_that_hangs_for_a_while(kind: str, mortal_server: Server, loop: asyncio.AbstractEventLoop) -> None:
    mortal_server.start()
    with connect(kind, mortal_server, loop, timeout_s=20.0) as client, client.stream("husky") as stream:
        deep = wade.State(depth_m=0.2)
        expected = client.evaluate("husky", deep).force_n
        stream.evaluate(STATE)
        mortal_server.freeze()
        failing(lambda: stream.evaluate(STATE, timeout_s=0.2), wade.DeadlineExceeded, within_s=0.2)
        failing(lambda: client.evaluate("husky", STATE, timeout_s=0.2), wade.DeadlineExceeded, within_s=0.2)
        mortal_server.thaw()
        # an answer that comes late must not be taken for that of a later state
        np.testing.assert_array_equal(client.evaluate("husky", deep).force_n, expected)
        np.testing.assert_array_equal(stream.evaluate(deep).force_n, expected)


def test_a_server_that_comes_back_with_other_vehicles(
    kind: str, mortal_server: Server, loop: asyncio.AbstractEventLoop, tmp_path: Path
) -> None:
    rover(tmp_path)
    mortal_server.start(tmp_path)
    with connect(kind, mortal_server, loop, timeout_s=20.0) as client:
        client.evaluate("rover", STATE)
        mortal_server.kill()
        mortal_server.start()
        with pytest.raises(wade.UnknownVehicle, match="warthog"):
            until_answered(lambda: client.evaluate("rover", STATE))
        assert client.vehicles() == ["husky", "warthog"]
        assert client.evaluate("warthog", STATE).force_n[2] > 0


def test_a_new_bundle_is_served_to_a_client_that_is_connected(
    kind: str, mortal_server: Server, loop: asyncio.AbstractEventLoop, tmp_path: Path
) -> None:
    vehicles = tmp_path / "vehicles"
    vehicles.mkdir()
    (vehicles / "husky").symlink_to(VEHICLES / "husky")
    mortal_server.start(vehicles)
    with connect(kind, mortal_server, loop, timeout_s=20.0) as client:
        with pytest.raises(wade.UnknownVehicle):
            client.evaluate("rover", STATE)
        (vehicles / "rover").symlink_to(rover(tmp_path))
        # an administrator's calls are answered on the Unix socket alone
        with grpc.insecure_channel(f"unix:{mortal_server.socket}") as channel:
            reloaded = admin_pb2_grpc.AdminStub(channel).Reload(admin_pb2.ReloadRequest(), timeout=20)
        assert [vehicle.refusal for vehicle in reloaded.vehicles] == ["", "", ""]
        time.sleep(0.2)  # shared memory looks for new vehicles every 50 ms
        assert client.evaluate("rover", STATE).force_n[2] > 0


def test_overload_is_told_with_a_time_to_retry(mortal_server: Server) -> None:
    mortal_server = Server(mortal_server.folder, settings="max_streams = 1\n")
    try:
        mortal_server.start()
        with wade.GrpcClient(mortal_server.address, timeout_s=20.0) as client:
            with client.stream("husky") as first, client.stream("husky") as second:
                first.evaluate(STATE)
                with pytest.raises(wade.ResourceExhausted) as caught:
                    second.evaluate(STATE)
                assert caught.value.retry_after_s == pytest.approx(0.01)
                assert first.evaluate(STATE).force_n[2] > 0
    finally:
        mortal_server.stop()


def offer(service: str, query: Any) -> Any:
    """A service as a server of another version would open it."""
    node = iox.NodeBuilder.new().create(iox.ServiceType.Ipc)
    builder = node.service_builder(iox.ServiceName.new(service)).request_response(query, shm_layout.Answer)
    factory = builder.create()
    return node, factory, factory.server_builder().create()


def tell(namespace: str, version: str, vehicles: str) -> Any:
    """What a server of another version would tell of itself."""
    node = iox.NodeBuilder.new().create(iox.ServiceType.Ipc)
    told = iox.AttributeSpecifier.new()
    for key, value in ((shm_layout.SERVED_LAYOUT, version), (shm_layout.SERVED_VEHICLES, vehicles)):
        told = told.define(iox.AttributeKey.new(key), iox.AttributeValue.new(value))
    builder = node.service_builder(iox.ServiceName.new(shm_layout.served_name(namespace))).event()
    return node, builder.create_with_attributes(told)


class LongerQuery(ctypes.Structure):
    _fields_ = [("words", ctypes.c_uint64 * 14)]

    @staticmethod
    def type_name() -> str:
        return f"wade::{shm_layout.VERSION}::Query"


def test_another_layout_version_is_told(mortal_server: Server) -> None:
    with wade.ShmClient(mortal_server.namespace) as client:
        server = tell(mortal_server.namespace, "v0", "husky")
        for call in (lambda: client.evaluate("husky", STATE), lambda: client.vehicles()):
            with pytest.raises(wade.LayoutMismatch) as caught:
                call()
            assert (caught.value.expected, caught.value.found) == (shm_layout.VERSION, "v0")
        del server
        mortal_server.start()
        assert client.evaluate("husky", STATE, timeout_s=20).force_n[2] > 0


def test_another_layout_under_the_same_name_is_told(mortal_server: Server) -> None:
    with wade.ShmClient(mortal_server.namespace) as client:
        server = offer(shm_layout.evaluate_name(mortal_server.namespace, "husky"), LongerQuery)
        with pytest.raises(wade.LayoutMismatch, match="other types"):
            client.evaluate("husky", STATE)
        del server
        mortal_server.start()
        assert client.evaluate("husky", STATE, timeout_s=20).force_n[2] > 0


def test_more_clients_than_there_is_room_for(mortal_server: Server) -> None:
    path = mortal_server.folder / "wade.toml"
    path.write_text(path.read_text().replace("[shm]\n", "[shm]\nmax_clients = 1\n"))
    mortal_server.start()
    with wade.ShmClient(mortal_server.namespace, timeout_s=20.0) as second:
        with wade.ShmClient(mortal_server.namespace, timeout_s=20.0) as first:
            first.evaluate("husky", STATE)
            with pytest.raises(wade.ResourceExhausted, match="max_clients"):
                second.evaluate("husky", STATE)
        assert second.evaluate("husky", STATE).force_n[2] > 0


def test_a_batch_never_mixes_two_bundles(kind: str, mortal_server: Server, loop: asyncio.AbstractEventLoop) -> None:
    vehicles = mortal_server.folder / "vehicles"
    vehicles.mkdir()
    lower, higher = VEHICLES / "husky", mortal_server.folder / "higher"
    shutil.copytree(lower, higher)
    text = (higher / "vehicle.toml").read_text()
    moved = re.sub(r"center_of_mass_m = .*", "center_of_mass_m = [0.0, 0.0, 0.1]", text)
    (higher / "vehicle.toml").write_text(re.sub(r"\nversion = .*", "\nversion = 900", moved))
    digest = sha256((higher / "vehicle.toml").read_bytes()).hexdigest()
    sums = re.sub(r"\S+(?=\s+vehicle.toml)", digest, (higher / "SHA256SUMS").read_text())
    (higher / "SHA256SUMS").write_text(sums)
    (vehicles / "husky").symlink_to(lower)
    mortal_server.start(vehicles)
    states = wade.State(depth_m=np.full(1024, 0.15), velocity_mps=(0.5, 0.2, 0))
    done = threading.Event()

    def exchange(pause_s: float) -> None:
        with grpc.insecure_channel(f"unix:{mortal_server.socket}") as channel:
            admin, next_link = admin_pb2_grpc.AdminStub(channel), vehicles.parent / "next"
            for target in itertools.cycle((higher, lower)):
                if done.wait(pause_s):
                    return
                next_link.symlink_to(target)
                next_link.replace(vehicles / "husky")
                assert admin.Reload(admin_pb2.ReloadRequest(vehicle="husky"), timeout=20).vehicles[0].refusal == ""

    seen: dict[int, tuple[float, ...]] = {}
    with connect(kind, mortal_server, loop, timeout_s=20.0) as client, ThreadPoolExecutor(1) as pool:
        # a batch that takes longer than the pause between two exchanges is begun again for ever
        start = time.monotonic()
        client.evaluate_batch("husky", states)
        exchanging = pool.submit(exchange, 4 * (time.monotonic() - start))
        try:
            # until both were seen, and a while longer
            for _ in itertools.takewhile(lambda turn: len(seen) < 2 or turn < 20, itertools.count()):
                assert not exchanging.done(), exchanging.exception()
                forces = client.evaluate_batch("husky", states)
                assert len(np.unique(forces.moment_nm, axis=0)) == 1
                seen[forces.bundle_version] = tuple(forces.moment_nm[0])
        finally:
            done.set()
        exchanging.result()
    assert len(set(seen.values())) == 2
