from __future__ import annotations

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from servers import Server

import wade
import wade.aio

#: Clients of a server, and all of them.
CLIENTS = ("tcp", "unix", "shm_block", "shm_spin", "asyncio")
EVERY_CLIENT = (*CLIENTS, "in_process")


class Awaited:
    """An asyncio client or stream whose calls are awaited, so that one test does for all clients."""

    def __init__(self, awaited: Any, loop: asyncio.AbstractEventLoop):
        self._awaited, self._loop = awaited, loop

    def __getattr__(self, name: str) -> Any:
        def call(*arguments: Any, **named: Any) -> Any:
            result = getattr(self._awaited, name)(*arguments, **named)
            if asyncio.iscoroutine(result):
                return self._loop.run_until_complete(result)
            return Awaited(result, self._loop) if hasattr(result, "evaluate") else result

        return call

    def __enter__(self) -> Any:
        return Awaited(self._loop.run_until_complete(self._awaited.__aenter__()), self._loop)

    def __exit__(self, *exception: object) -> None:
        self._loop.run_until_complete(self._awaited.__aexit__(*exception))


@pytest.fixture(autouse=True)
def without_credentials(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the developer shows to servers is not what a test shows."""
    for variable in ("WADE_CA", "WADE_CERTIFICATE", "WADE_KEY", "WADE_TOKEN_FILE"):
        monkeypatch.delenv(variable, raising=False)


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One that nobody may harm."""
    server = Server(tmp_path_factory.mktemp("server"))
    server.start()
    yield server
    server.stop()


@pytest.fixture
def mortal_server(tmp_path: Path) -> Iterator[Server]:
    """One for a test alone, not yet started."""
    server = Server(tmp_path)
    yield server
    server.stop()


@pytest.fixture
def loop() -> Iterator[asyncio.AbstractEventLoop]:
    loop = asyncio.new_event_loop()
    yield loop
    loop.close()


def connect(kind: str, server: Server, loop: asyncio.AbstractEventLoop, **settings: Any) -> Any:
    """A client of a kind of `EVERY_CLIENT`; the one in process reads the vehicles of the server."""
    if kind == "in_process":
        return wade.InProcess(server.vehicles)
    if kind == "tcp":
        return wade.GrpcClient(server.address, **settings)
    if kind == "unix":
        return wade.GrpcClient(f"unix:{server.socket}", **settings)
    if kind == "asyncio":
        return Awaited(wade.aio.GrpcClient(server.address, **settings), loop)
    return wade.ShmClient(server.namespace, wait="spin" if kind == "shm_spin" else "block", **settings)


@pytest.fixture(params=EVERY_CLIENT)
def client(request: pytest.FixtureRequest, server: Server, loop: asyncio.AbstractEventLoop) -> Iterator[Any]:
    """Each client in turn, with the vehicles of the shared server. A loaded machine may take its time."""
    with connect(request.param, server, loop, timeout_s=20.0) as client:
        yield client


@pytest.fixture(params=CLIENTS)
def kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)
