"""Where a gRPC server is, how to reach it, and what to show it."""

from __future__ import annotations

import ipaddress
import os
import re
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import grpc

from .errors import WadeError

#: Where `wade serve` listens unless told otherwise.
DEFAULT_ADDRESS = "127.0.0.1:50051"

#: Largest answer that is taken [bytes]: the server's largest batch of the vehicle with the most surfaces needs 8 MB.
_MAX_ANSWER = 64 << 20

#: Largest file of certificates, of a key or of a token [bytes].
_MAX_FILE = 1 << 20

_HTTP, _HTTPS = "http://", "https://"

#: What versions of grpcio say where the server closed a connection instead of beginning with HTTP/2.
_CLOSED = ("Socket closed", "Connection reset", "Unwrap failed", "Secure read failed")
#: What they say where the certificates or the key cannot be used.
_NO_CREDENTIALS = ("empty address list", "create security handshaker")

#: What a header carries: visible ASCII.
_TOKEN = re.compile(r"[!-~]+")


@dataclass(frozen=True, slots=True)
class Tls:
    """Settings of an encrypted connection; all PEM. `Tls.from_files` reads them.

    What is not given is read from the files that WADE_CA, WADE_CERTIFICATE and WADE_KEY name.
    """

    #: Certificates of those who are trusted to sign the server's; None: those that come with grpcio.
    root_certificates: bytes | None = None
    #: This client's certificate and key, where the server asks for them.
    certificate_chain: bytes | None = None
    private_key: bytes | None = field(default=None, repr=False)
    #: Name in the server's certificate, where it is not the host of the address.
    server_name: str | None = None

    def __post_init__(self) -> None:
        # grpcio ends the process where one of them is missing
        if (self.certificate_chain is None) != (self.private_key is None):
            raise ValueError("a certificate and its private key go together")

    @classmethod
    def from_files(
        cls,
        ca: str | PathLike[str] | None = None,
        certificate: str | PathLike[str] | None = None,
        key: str | PathLike[str] | None = None,
        *,
        server_name: str | None = None,
    ) -> Tls:
        """Reads files of PEM: authorities, a certificate and its key. A `WadeError` names one that cannot be read."""
        return cls(_file("ca", ca), _file("certificate", certificate), _file("key", key), server_name)

    def _completed(self) -> Tls:
        """With what the environment names in the place of what is not given."""
        roots, chain, key = self.root_certificates, self.certificate_chain, self.private_key
        if roots is None:
            roots = _file_of_environment("WADE_CA")
        if chain is None:
            chain, key = _file_of_environment("WADE_CERTIFICATE"), _file_of_environment("WADE_KEY")
            if (chain is None) != (key is None):
                raise ValueError("WADE_CERTIFICATE and WADE_KEY go together")
        return Tls(roots, chain, key, self.server_name)


def _file(name: str, path: str | PathLike[str] | None) -> bytes | None:
    if path is None:
        return None
    try:
        with Path(path).open("rb") as file:
            content = file.read(_MAX_FILE + 1)
    except OSError as error:
        raise WadeError(f"{name}: {os.fspath(path)}: {error.strerror}") from None
    if len(content) > _MAX_FILE:
        raise WadeError(f"{name}: {os.fspath(path)}: holds more than {_MAX_FILE} bytes")
    return content


def _file_of_environment(variable: str) -> bytes | None:
    return _file(variable, os.environ.get(variable) or None)


def _checked_token(token: str | None) -> str | None:
    """The token that is given, or that of the file WADE_TOKEN_FILE. No error repeats it."""
    source = "token"
    if token is None:
        source = "WADE_TOKEN_FILE"
        content = _file_of_environment(source)
        if content is None:
            return None
        token = content.decode("latin-1")
    if not isinstance(token, str):
        raise TypeError(f"token must be a str, got {type(token).__name__}")
    # a file that was written by a shell ends with a line feed
    token = token.strip()
    if not _TOKEN.fullmatch(token):
        raise ValueError(f"{source} is empty, or holds characters that no header carries")
    return token


def target(address: str) -> str:
    """What grpcio connects to, for `host:port`, `http[s]://host:port` or `unix:PATH`; else raises `ValueError`."""

    def refused(fault: str) -> ValueError:
        forms = "host:port, http://host:port, https://host:port, unix:PATH or, for wade.connect, shm:NAMESPACE"
        return ValueError(f"{address!r} is no address: {fault}; write {forms}")

    if address.startswith("unix:"):
        path = address.removeprefix("unix:").removeprefix("//")
        if not path:
            raise refused("the path of the socket is missing")
        return f"unix:{path}"
    if address.startswith("shm:"):
        raise refused("shared memory is asked by wade.ShmClient or wade.connect")
    scheme = _HTTPS if address.startswith(_HTTPS) else _HTTP
    place = address.removeprefix(scheme).removesuffix("/")
    host, _, port = place.rpartition(":")
    if not host or "/" in place or (":" in host and not (host.startswith("[") and host.endswith("]"))):
        raise refused("the host or the port is missing, or an address of IPv6 lacks its brackets")
    if not (port.isascii() and port.isdigit() and 1 <= int(port) <= 65535):
        raise refused("the port is no number from 1 to 65535")
    return place


@dataclass(frozen=True, slots=True)
class Endpoint:
    """A server, and what a call there shows."""

    #: What grpcio connects to.
    address: str
    #: How the connection is encrypted; None: not at all.
    tls: Tls | None
    #: What every call carries: the token.
    metadata: tuple[tuple[str, str], ...] = field(repr=False)

    @classmethod
    def from_arguments(cls, address: str, tls: Tls | None, token: str | None) -> Endpoint:
        """The arguments of a client, completed from the environment; raises `ValueError` where they do not fit."""
        place = target(address)
        if tls is not None and address.startswith(_HTTP):
            raise ValueError(f"{address!r} is not encrypted, and tls is given: write https://{place}")
        if tls is not None or address.startswith(_HTTPS):
            tls = (Tls() if tls is None else tls)._completed()
        token = _checked_token(token)
        if token is not None and tls is None and not _is_this_machine(place):
            raise ValueError(f"a token is not sent to another machine without encryption: write https://{place}")
        return cls(place, tls, () if token is None else (("authorization", f"Bearer {token}"),))

    def open(self, module: Any) -> Any:
        """A channel of `grpc` or of `grpc.aio` (`module`)."""
        options: list[tuple[str, Any]] = [
            # a new channel connects at once instead of sharing the back-off of one that failed
            ("grpc.use_local_subchannel_pool", 1),
            ("grpc.max_receive_message_length", _MAX_ANSWER),
        ]
        if self.address.startswith("unix:"):
            # grpcio would send the escaped path, which strict HTTP/2 servers refuse as malformed
            options.append(("grpc.default_authority", "localhost"))
        if _is_this_machine(self.address):
            # a proxy would be another machine, which sees the token
            options.append(("grpc.enable_http_proxy", 0))
        tls = self.tls
        if tls is None:
            return module.insecure_channel(self.address, options)
        if tls.server_name is not None:
            options.append(("grpc.ssl_target_name_override", tls.server_name))
        credentials = grpc.ssl_channel_credentials(tls.root_certificates, tls.private_key, tls.certificate_chain)
        return module.secure_channel(self.address, credentials, options)

    def explained(self, reason: str) -> str:
        """Why there is no connection: grpcio's reason, behind what it means where TLS is at fault."""
        meaning = self._meaning(reason)
        return reason if meaning is None else f"{meaning} ({reason})"

    def _meaning(self, reason: str) -> str | None:
        closed = any(sign in reason for sign in _CLOSED)
        if not reason.startswith(("failed to connect", _NO_CREDENTIALS[0])):
            return None
        if self.tls is None:
            tcp = not self.address.startswith("unix:")
            return f"if it speaks TLS, write https://{self.address}" if closed and tcp else None
        if "Hostname Verification Check failed" in reason or "is not in peer certificate" in reason:
            return "its certificate is of another name, which Tls(server_name=) would state"
        if "certificate has expired" in reason:
            return "its certificate has expired"
        if "CERTIFICATE_VERIFY_FAILED" in reason:
            return "its certificate is of no trusted authority; Tls(root_certificates=) or WADE_CA names one"
        if "WRONG_VERSION_NUMBER" in reason:
            return f"it does not speak TLS; http://{self.address} is not encrypted"
        if any(sign in reason for sign in _NO_CREDENTIALS):
            return "the certificates or the key given are not PEM, or the key is of another certificate"
        if closed and self.tls.certificate_chain is not None:
            return "it may not accept this client's certificate"
        return None


def _is_this_machine(place: str) -> bool:
    if place.startswith("unix:"):
        return True
    host = place.rpartition(":")[0].removeprefix("[").removesuffix("]")
    try:
        return host.lower() == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
