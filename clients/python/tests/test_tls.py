"""Promise: over TLS a client and `wade serve` know each other, and every way in which they do not is named at once."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from authority import CLIENT, OURS, Authority
from conftest import Awaited
from servers import Server, free_port

import wade
import wade.aio

STATE = wade.State(depth_m=0.15, velocity_mps=(0.5, 0.0, 0.0))
BATCH = wade.State(depth_m=np.linspace(0.05, 0.2, 7), velocity_mps=(0.5, 0.0, 0.0))
UNKNOWN = "0123456789abcdef" * 4
# a refusal comes at once, so that it never takes as long as a lost answer [s]
TIMEOUT_S, AT_ONCE_S = 20.0, 5.0


@dataclass(frozen=True)
class Guarded:
    """A server that speaks TLS on TCP, and what opens it."""

    server: Server
    authority: Authority
    #: May query.
    token: str
    #: May observe.
    watcher: str

    @property
    def url(self) -> str:
        return f"https://localhost:{self.server.address.rpartition(':')[2]}"


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Guarded]:
    authority = Authority(tmp_path_factory.mktemp("authority"))
    authority.sign("server", OURS)
    for name, days in (("rig", 2), ("guest", 2), ("expired", -1)):
        authority.sign(name, CLIENT, days)
    token, watcher = authority.token("rig-7", "query"), authority.token("watcher", "observe")
    access = f'[access]\ntokens = "{authority.tokens}"\ncertificates = {{ rig = ["query"] }}\n'
    server = Server(tmp_path_factory.mktemp("guarded"), authority.settings("server") + access)
    server.start()
    yield Guarded(server, authority, token, watcher)
    server.stop()


@pytest.fixture(params=["sync", "asyncio"])
def opened(request: pytest.FixtureRequest, loop: asyncio.AbstractEventLoop) -> Any:
    """Opens a client of either kind."""

    def opened(address: str, **settings: Any) -> Any:
        if request.param == "sync":
            return wade.GrpcClient(address, **{"timeout_s": TIMEOUT_S, **settings})
        return Awaited(wade.aio.GrpcClient(address, **{"timeout_s": TIMEOUT_S, **settings}), loop)

    return opened


def answers(client: Any) -> list[bytes]:
    """The bits of a single state, a batch and a stream."""
    with client.stream("husky") as stream:
        found = [client.evaluate("husky", STATE), client.evaluate_batch("husky", BATCH), stream.evaluate(STATE)]
    return [forces.force_n.tobytes() for forces in found]


def refusals(client: Any, kind: type[wade.WadeError]) -> list[str]:
    """What a single state, a batch and a stream are refused with, at once."""
    said = []
    with client.stream("husky") as stream:
        for call in (
            lambda: client.evaluate("husky", STATE),
            lambda: client.evaluate_batch("husky", BATCH),
            lambda: stream.evaluate(STATE),
        ):
            start = time.monotonic()
            with pytest.raises(kind) as caught:
                call()
            assert time.monotonic() - start < AT_ONCE_S
            said.append(str(caught.value))
    return said


def test_a_token_and_a_certificate_get_the_bits_of_the_socket(guarded: Guarded, opened: Any) -> None:
    with opened(f"unix:{guarded.server.socket}") as client:
        expected = answers(client)
    authority, token = guarded.authority, guarded.token
    shown: list[tuple[str, dict[str, Any]]] = [
        (guarded.url, {"tls": authority.tls(), "token": token}),
        (guarded.url, {"tls": authority.tls(), "token": f"{token}\n"}),
        (guarded.server.address, {"tls": authority.tls(), "token": token}),
        (guarded.url, {"tls": authority.tls("rig")}),
        # the token of a call is asked before the certificate of its connection
        (guarded.url, {"tls": authority.tls("guest"), "token": token}),
        (f"unix:{guarded.server.socket}", {"token": token}),
    ]
    for address, settings in shown:
        with opened(address, **settings) as client:
            assert answers(client) == expected, (address, settings.keys())
    with wade.connect(guarded.url, tls=authority.tls(), token=token, timeout_s=TIMEOUT_S) as client:
        assert answers(client) == expected


def test_the_environment_stands_in_for_what_is_not_given(
    guarded: Guarded, opened: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    authority, (certificate, key) = guarded.authority, guarded.authority.files("rig")
    monkeypatch.setenv("WADE_CA", str(authority.ca))
    with opened(guarded.url) as client:
        refusals(client, wade.Unauthenticated)
    monkeypatch.setenv("WADE_CERTIFICATE", str(certificate))
    monkeypatch.setenv("WADE_KEY", str(key))
    with opened(guarded.url) as client:
        answers(client)
    (tmp_path / "token").write_text(f"{guarded.watcher}\n")
    monkeypatch.setenv("WADE_TOKEN_FILE", str(tmp_path / "token"))
    with opened(guarded.url) as client:
        refusals(client, wade.PermissionDenied)
    for settings in ({"token": guarded.token}, {"tls": wade.Tls(), "token": guarded.token}):
        with opened(guarded.url, **settings) as client:
            answers(client)
    # as with flags of the command line, a variable that is empty names nothing
    monkeypatch.setenv("WADE_TOKEN_FILE", "")
    with opened(guarded.url) as client:
        answers(client)


def test_what_is_wrong_with_the_environment_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(kind: type[Exception], says: str) -> None:
        with pytest.raises(kind, match=says):
            wade.GrpcClient("https://localhost:1")

    missing = tmp_path / "missing"
    for variable in ("WADE_CA", "WADE_TOKEN_FILE"):
        monkeypatch.setenv(variable, str(missing))
        refused(wade.WadeError, f"{variable}: {missing}: No such file")
        monkeypatch.delenv(variable)
    (tmp_path / "large").write_bytes(bytes((1 << 20) + 1))
    monkeypatch.setenv("WADE_CA", str(tmp_path / "large"))
    refused(wade.WadeError, "WADE_CA: .*more than")
    monkeypatch.delenv("WADE_CA")
    monkeypatch.setenv("WADE_KEY", str(tmp_path / "large"))
    refused(wade.WadeError, "WADE_KEY")
    monkeypatch.setenv("WADE_KEY", __file__)
    refused(ValueError, "WADE_CERTIFICATE and WADE_KEY go together")
    monkeypatch.delenv("WADE_KEY")
    (tmp_path / "empty").write_text("\n")
    monkeypatch.setenv("WADE_TOKEN_FILE", str(tmp_path / "empty"))
    refused(ValueError, "WADE_TOKEN_FILE is empty")
    with pytest.raises(wade.WadeError, match=f"certificate: {missing}"):
        wade.Tls.from_files(certificate=missing)
    with pytest.raises(ValueError, match="go together"):
        wade.Tls(certificate_chain=b"")


def test_an_unknown_caller_or_one_without_the_role_is_refused(guarded: Guarded, opened: Any) -> None:
    tls = guarded.authority.tls()
    for settings, says in [({}, "show a token"), ({"token": UNKNOWN}, "not known")]:
        with opened(guarded.url, tls=tls, **settings) as client:
            for said in refusals(client, wade.Unauthenticated):
                assert "role query" in said and says in said and UNKNOWN not in said, said
    with opened(guarded.url, tls=tls, token=guarded.watcher) as client:
        for said in refusals(client, wade.PermissionDenied):
            assert 'token "watcher"' in said and "query" in said and guarded.watcher not in said, said
        # the same client may still do what it has the role for
        client.latency()
    with opened(guarded.url, tls=guarded.authority.tls("guest")) as client:
        assert all('"guest"' in said for said in refusals(client, wade.PermissionDenied))
    with opened(guarded.url, tls=tls, token=guarded.token) as client:
        with pytest.raises(wade.PermissionDenied, match="administer") as caught:
            client.reload()
        assert isinstance(caught.value, PermissionError) and caught.value.code == "PERMISSION_DENIED"
        answers(client)


def test_a_handshake_that_fails_says_why(guarded: Guarded, opened: Any, server: Server, tmp_path: Path) -> None:
    authority, other = guarded.authority, Authority(tmp_path)
    roots, (rig, rig_key), (_, guest_key) = authority.ca.read_bytes(), authority.files("rig"), authority.files("guest")
    swapped = wade.Tls(roots, rig.read_bytes(), guest_key.read_bytes())
    for address, tls, says in [
        (guarded.url, other.tls(), "of no trusted authority"),
        (guarded.url, None, "of no trusted authority"),
        (guarded.url, authority.tls(server_name="other.test"), "of another name"),
        (guarded.url, authority.tls("expired"), "may not accept this client's certificate"),
        (guarded.url, wade.Tls(b"no PEM"), "not PEM"),
        (guarded.url, wade.Tls(roots, rig.read_bytes(), b"no PEM"), "not PEM"),
        (guarded.url, swapped, "key is of another certificate"),
        (guarded.server.address, None, f"write https://{guarded.server.address}"),
        (f"https://{server.address}", authority.tls(), "does not speak TLS"),
    ]:
        with opened(address, tls=tls) as client:
            for said in refusals(client, wade.ServerUnavailable):
                assert says in said, said
    assert rig_key.read_text() not in repr(authority.tls("rig"))


def test_a_server_whose_certificate_has_expired_is_not_believed(opened: Any, tmp_path: Path) -> None:
    authority = Authority(tmp_path)
    authority.sign("late", OURS, -1)
    roles = '[access]\ncertificates = { "*" = ["query"] }\n'
    server = Server(tmp_path, authority.settings("late") + roles)
    server.start()
    try:
        with opened(f"https://{server.address}", tls=authority.tls()) as client:
            assert all("has expired" in said for said in refusals(client, wade.ServerUnavailable))
    finally:
        server.stop()


def test_without_encryption_a_token_stays_on_this_machine(
    guarded: Guarded, opened: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    server = Server(tmp_path, f'[access]\ntokens = "{guarded.authority.tokens}"\n')
    server.start()
    try:
        with socket.create_server(("127.0.0.1", 0)) as proxy:
            for variable in ("http_proxy", "grpc_proxy"):
                monkeypatch.setenv(variable, f"http://127.0.0.1:{proxy.getsockname()[1]}")
            monkeypatch.delenv("no_proxy", raising=False)
            with opened(f"http://{server.address}", token=guarded.token) as client:
                answers(client)
            proxy.setblocking(False)
            with pytest.raises(BlockingIOError):
                proxy.accept()
        with opened(server.address) as client:
            refusals(client, wade.Unauthenticated)
    finally:
        server.stop()
    (tmp_path / "token").write_text(guarded.token)
    for place in ("rig:50051", "10.0.0.7:1", "[2001:db8::1]:1", "localhost.example.org:1", "127.0.0.1.example.org:1"):
        monkeypatch.delenv("WADE_TOKEN_FILE", raising=False)
        opened(place)
        for address in (place, f"http://{place}"):
            with pytest.raises(ValueError, match="without encryption") as caught:
                opened(address, token=guarded.token)
            assert f"https://{place}" in str(caught.value) and guarded.token not in str(caught.value)
        monkeypatch.setenv("WADE_TOKEN_FILE", str(tmp_path / "token"))
        with pytest.raises(ValueError, match="without encryption"):
            opened(place)
        opened(f"https://{place}", token=guarded.token)
    with pytest.raises(ValueError, match="not encrypted"):
        opened("http://localhost:1", tls=wade.Tls())


def test_a_token_is_never_shown(opened: Any, caplog: pytest.LogCaptureFixture) -> None:
    for wrong in ("", "two words", "line\nfeed", "naïve"):
        with pytest.raises(ValueError, match="token is empty, or holds") as caught:
            opened("localhost:1", token=wrong)
        assert not wrong or wrong not in str(caught.value)
    with pytest.raises(TypeError, match="str, got bytes") as wrong_type:
        opened("localhost:1", token=UNKNOWN.encode())
    assert UNKNOWN not in str(wrong_type.value)
    client = wade.GrpcClient(f"localhost:{free_port()}", token=UNKNOWN, timeout_s=TIMEOUT_S)
    with client, pytest.raises(wade.ServerUnavailable) as unavailable:
        client.evaluate("husky", STATE)
    shown = [repr(client), repr(client._endpoint), repr(unavailable.value), repr(unavailable.value.__context__)]
    assert UNKNOWN not in "".join([*shown, caplog.text])
