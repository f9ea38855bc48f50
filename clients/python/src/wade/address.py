"""Where a server answers: the one grammar of wade's flags and clients."""

from __future__ import annotations

import re
from typing import Literal

from .channel import DEFAULT_ADDRESS, Tls
from .client import DEFAULT_TIMEOUT_S, Client
from .rpc import GrpcClient

_NAMESPACE = re.compile(r"[A-Za-z0-9_-]+")


def connect(
    address: str = DEFAULT_ADDRESS,
    *,
    timeout_s: float = DEFAULT_TIMEOUT_S,
    tls: Tls | None = None,
    token: str | None = None,
    wait: Literal["block", "spin"] = "block",
) -> Client:
    """A client of the server at `host:port`, `http[s]://host:port`, `unix:PATH` or `shm:NAMESPACE`.

    It connects with its first call. `tls` and `token` are for gRPC alone, `wait` for shared memory alone; `GrpcClient`
    has further methods.
    """
    if not address.startswith("shm:"):
        return GrpcClient(address, tls=tls, token=token, timeout_s=timeout_s)
    namespace = address.removeprefix("shm:")
    if not _NAMESPACE.fullmatch(namespace):
        raise ValueError(
            f"{address!r} is no address: a namespace holds letters, digits, - and _ alone, and is not empty"
        )
    if tls is not None or token is not None:
        raise ValueError("tls and token are for gRPC: shared memory does not leave the machine")
    # it needs iceoryx2, which gRPC alone does not
    from .shm import ShmClient

    return ShmClient(namespace, wait=wait, timeout_s=timeout_s)
