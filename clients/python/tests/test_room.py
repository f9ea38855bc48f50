"""Promise: without room for another client there is an error that says how much is needed, and no dead program."""

from __future__ import annotations

import resource
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from servers import Server

import wade

STATE = wade.State(depth_m=0.15)

#: Asks in a mount namespace of its own, whose /dev/shm is full. Prints what it got.
_FULL = """
import os, wade
try:
    with open("/dev/shm/filled", "wb", buffering=0) as file:
        while True:
            file.write(bytes(4096))
except OSError:
    pass
try:
    wade.ShmClient("nobody-serves-here", timeout_s=5.0).evaluate("husky", wade.State(depth_m=0.15))
except wade.WadeError as error:
    print(type(error).__name__, error)
"""


def may_mount() -> bool:
    """True where a mount namespace may be had, as root has it."""
    return subprocess.run(["unshare", "-m", "true"], capture_output=True, check=False).returncode == 0


@pytest.mark.skipif(not may_mount(), reason="needs root for a mount namespace")
def test_a_full_dev_shm_is_an_error() -> None:
    script = f'mount -t tmpfs -o size=1m tmpfs /dev/shm && exec "{sys.executable}" -c "$1"'
    asked = subprocess.run(
        ["unshare", "-m", "sh", "-c", script, "sh", _FULL], capture_output=True, text=True, check=False
    )
    assert asked.returncode == 0, asked.stderr
    assert asked.stdout.startswith("ResourceExhausted /dev/shm has ") and "needs 2048 kB" in asked.stdout, asked.stdout


@contextmanager
def descriptors(limit: int) -> Iterator[None]:
    """As many descriptors as a limit, for a while."""
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (limit, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)


def test_too_few_descriptors_are_named_and_the_next_call_works(server: Server) -> None:
    with wade.ShmClient(server.namespace, timeout_s=20.0) as client:
        with descriptors(40), pytest.raises(wade.ResourceExhausted, match="of 40 file descriptors are open"):
            client.evaluate("husky", STATE)
        assert client.evaluate("husky", STATE).force_n[2] > 0
