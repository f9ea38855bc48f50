"""TLS, as an endpoint in front of the server would end it."""

from __future__ import annotations

import socket
import ssl
import subprocess
import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from servers import Server

import wade

STATE = wade.State(depth_m=0.15)


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A key and a certificate for wade.test that signs itself."""
    folder = tmp_path_factory.mktemp("tls")
    key, chain = folder / "key.pem", folder / "chain.pem"
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", "/CN=wade.test"]
    command += ["-addext", "subjectAltName=DNS:wade.test", "-keyout", str(key), "-out", str(chain)]
    subprocess.run(command, check=True, capture_output=True)
    return key, chain


def pump(source: socket.socket, target: socket.socket) -> None:
    with suppress(OSError):
        while data := source.recv(1 << 16):
            target.sendall(data)
    for end in (source, target):
        with suppress(OSError):
            end.shutdown(socket.SHUT_RDWR)


def relay(plain: socket.socket, context: ssl.SSLContext, server: tuple[str, int]) -> None:
    """One connection: what is secure on one side is plain on the other."""
    with (
        suppress(OSError),
        context.wrap_socket(plain, server_side=True) as secure,
        socket.create_connection(server) as target,
    ):
        back = threading.Thread(target=pump, args=(target, secure))
        back.start()
        pump(secure, target)
        back.join()


@pytest.fixture
def endpoint(server: Server, certificate: tuple[Path, Path]) -> Iterator[str]:
    """Address of an endpoint that asks for a client's certificate and passes the plain bytes on."""
    key, chain = certificate
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(chain, key)
    context.load_verify_locations(chain)
    context.verify_mode = ssl.CERT_REQUIRED
    context.set_alpn_protocols(["h2"])
    host, port = server.address.split(":")
    relays = []
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def serve() -> None:
            with suppress(OSError):
                while True:
                    plain, _ = listener.accept()
                    relays.append(threading.Thread(target=relay, args=(plain, context, (host, int(port)))))
                    relays[-1].start()

        accepting = threading.Thread(target=serve)
        accepting.start()
        yield f"127.0.0.1:{listener.getsockname()[1]}"
        listener.shutdown(socket.SHUT_RDWR)
        accepting.join()
    for thread in relays:
        thread.join()


def test_with_certificates_on_both_sides(endpoint: str, certificate: tuple[Path, Path]) -> None:
    key, chain = (path.read_bytes() for path in certificate)
    tls = wade.Tls(root_certificates=chain, certificate_chain=chain, private_key=key, server_name="wade.test")
    with wade.GrpcClient(endpoint, tls=tls, timeout_s=20.0) as client:
        assert client.evaluate("husky", STATE).force_n[2] > 0


@pytest.mark.parametrize("wrong", ["name", "root", "no client certificate", "plain"])
def test_what_does_not_fit_is_refused(endpoint: str, certificate: tuple[Path, Path], wrong: str) -> None:
    key, chain = (path.read_bytes() for path in certificate)
    tls = {
        "name": wade.Tls(root_certificates=chain, certificate_chain=chain, private_key=key, server_name="other.test"),
        "root": wade.Tls(certificate_chain=chain, private_key=key, server_name="wade.test"),
        "no client certificate": wade.Tls(root_certificates=chain, server_name="wade.test"),
        "plain": None,
    }[wrong]
    with wade.GrpcClient(endpoint, tls=tls, timeout_s=5.0) as client:
        with pytest.raises(wade.ServerUnavailable):
            client.evaluate("husky", STATE)
