"""Where a gRPC server is and how to reach it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import grpc

#: Where `wade serve` listens unless told otherwise.
DEFAULT_ADDRESS = "127.0.0.1:50051"

#: Largest answer that is taken [bytes]: the server's largest batch of the vehicle with the most surfaces needs 8 MB.
_MAX_ANSWER = 64 << 20


@dataclass(frozen=True, slots=True)
class Tls:
    """Settings of an encrypted connection; all PEM."""

    #: Certificates of those who are trusted to sign the server's; None: those that come with grpcio.
    root_certificates: bytes | None = None
    #: This client's certificate and key, where the server asks for them.
    certificate_chain: bytes | None = None
    private_key: bytes | None = None
    #: Name in the server's certificate, where it is not the host of the address.
    server_name: str | None = None


def target(address: str) -> str:
    """What grpcio connects to, for `host:port`, `http://host:port` or `unix:PATH`; else raises `ValueError`."""

    def refused(fault: str) -> ValueError:
        forms = "write host:port, http://host:port, unix:PATH or, for wade.connect, shm:NAMESPACE"
        return ValueError(f"{address!r} is no address: {fault}; {forms}")

    if address.startswith("unix:"):
        path = address.removeprefix("unix:").removeprefix("//")
        if not path:
            raise refused("the path of the socket is missing")
        return f"unix:{path}"
    if address.startswith("shm:"):
        raise refused("shared memory is asked by wade.ShmClient or wade.connect")
    if address.startswith("https://"):
        raise refused("an encrypted connection is host:port with tls=wade.Tls()")
    place = address.removeprefix("http://").removesuffix("/")
    host, _, port = place.rpartition(":")
    if not host or "/" in place or (":" in host and not (host.startswith("[") and host.endswith("]"))):
        raise refused("the host or the port is missing, or an address of IPv6 lacks its brackets")
    if not (port.isascii() and port.isdigit() and 1 <= int(port) <= 65535):
        raise refused("the port is no number from 1 to 65535")
    return place


def open_channel(module: Any, address: str, tls: Tls | None) -> Any:
    """A channel of `grpc` or of `grpc.aio` (`module`) to what `target` gives."""
    options: list[tuple[str, Any]] = [
        # a new channel connects at once instead of sharing the back-off of one that failed
        ("grpc.use_local_subchannel_pool", 1),
        ("grpc.max_receive_message_length", _MAX_ANSWER),
    ]
    if address.startswith("unix:"):
        # grpcio would send the escaped path, which strict HTTP/2 servers refuse as malformed
        options.append(("grpc.default_authority", "localhost"))
    if tls is None:
        return module.insecure_channel(address, options)
    if tls.server_name is not None:
        options.append(("grpc.ssl_target_name_override", tls.server_name))
    credentials = grpc.ssl_channel_credentials(tls.root_certificates, tls.private_key, tls.certificate_chain)
    return module.secure_channel(address, credentials, options)
