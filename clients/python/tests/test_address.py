"""Promise: every client takes the one grammar of addresses, and says of anything else what is wrong with it."""

from __future__ import annotations

import pytest
from servers import Server

import wade
import wade.aio

STATE = wade.State(depth_m=0.15, velocity_mps=(0.5, 0.0, 0.0))


def test_every_form_reaches_the_server_and_answers_the_same(server: Server) -> None:
    forms = (server.address, f"http://{server.address}", f"http://{server.address}/", f"unix:{server.socket}")
    answers = []
    for address in (*forms, f"unix://{server.socket}", f"shm:{server.namespace}"):
        with wade.connect(address, timeout_s=20.0) as client:
            answers.append(client.evaluate("husky", STATE).force_n.tolist())
    assert len(answers) == 6 and all(answer == answers[0] for answer in answers)
    assert wade.GrpcClient("http://[::1]:50051/").address == wade.aio.GrpcClient("[::1]:50051").address == "[::1]:50051"


@pytest.mark.parametrize(
    ("address", "fault"),
    [
        ("", "missing"),
        ("localhost", "missing"),
        ("localhost:0", "65535"),
        ("localhost:http", "65535"),
        (":50051", "missing"),
        ("::1:50051", "brackets"),
        ("/tmp/wade.sock", "missing"),
        ("http://host:1/v1", "missing"),
        ("https://host", "missing"),
        ("https://http://host:1", "missing"),
        ("unix:", "socket"),
        ("shm:", "namespace"),
        ("shm:a/b", "namespace"),
    ],
)
def test_what_is_no_address_is_named(address: str, fault: str) -> None:
    with pytest.raises(ValueError, match=fault) as caught:
        wade.connect(address)
    assert repr(address) in str(caught.value)


def test_settings_of_the_other_transport_are_refused() -> None:
    for setting in ({"tls": wade.Tls()}, {"token": "secret"}):
        with pytest.raises(ValueError, match="tls and token are for gRPC"):
            wade.connect("shm:wade", **setting)
    with pytest.raises(ValueError, match="ShmClient"):
        wade.GrpcClient("shm:wade")
