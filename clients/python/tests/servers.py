"""A real `wade serve`, on ports, a socket and a namespace of its own."""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import subprocess
import time
import uuid
from hashlib import sha256
from pathlib import Path

import grpc

ROOT = Path(__file__).resolve().parents[3]
#: The shipped ones, or those of other weights.
VEHICLES = Path(os.environ.get("WADE_TEST_VEHICLES", ROOT / "vehicles")).resolve()


def binary() -> Path:
    """`$WADE_BIN`, or what cargo built last of release and debug."""
    if "WADE_BIN" in os.environ:
        return Path(os.environ["WADE_BIN"]).resolve(strict=True)
    built = [ROOT / "target" / profile / "wade" for profile in ("release", "debug")]
    if found := [path for path in built if path.is_file()]:
        return max(found, key=lambda path: path.stat().st_mtime).resolve()
    raise FileNotFoundError(f"no wade at {', '.join(map(str, built))}: run cargo build, or name one by WADE_BIN")


def rover(folder: Path) -> Path:
    """Makes a vehicle of another name than those that the server carries: the Husky, under `folder`/rover."""
    bundle = folder / "rover"
    shutil.copytree(VEHICLES / "husky", bundle)
    text = (bundle / "vehicle.toml").read_text().replace('name = "husky"', 'name = "rover"', 1)
    (bundle / "vehicle.toml").write_text(text)
    digest = sha256(text.encode()).hexdigest()
    sums = re.sub(r"\S+(?=\s+vehicle.toml)", digest, (bundle / "SHA256SUMS").read_text())
    (bundle / "SHA256SUMS").write_text(sums)
    return bundle


def environment() -> dict[str, str]:
    """Without settings that would win over a test's own."""
    return {name: value for name, value in os.environ.items() if not name.startswith("WADE_")}


def free_port() -> int:
    """A port that nobody listens on at the moment."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Server:
    """Runs until it is stopped; may be killed and started again at the same places."""

    def __init__(self, folder: Path, settings: str = ""):
        self.folder = folder
        self.address = f"127.0.0.1:{free_port()}"
        self.socket = folder / "wade.sock"
        self.namespace = f"test_{uuid.uuid4().hex[:12]}"
        self.vehicles = VEHICLES
        self.process: subprocess.Popen[bytes] | None = None
        # where TCP is encrypted, the socket is not
        self._health_at = f"unix:{self.socket}" if "[tls]" in settings else self.address
        (folder / "wade.toml").write_text(
            f'[grpc]\nlisten = "{self.address}"\nunix_socket = "{self.socket}"\n{settings}'
            f'[shm]\nnamespace = "{self.namespace}"\n[http]\nlisten = ""\n'
        )

    def start(self, vehicles: Path = VEHICLES) -> None:
        """Returns when it answers."""
        self.vehicles = vehicles
        command: list[str | Path] = [binary(), "serve", "--config", self.folder / "wade.toml", "--vehicles", vehicles]
        with (self.folder / "log").open("ab") as log:
            self.process = subprocess.Popen(command, env=environment(), stderr=log)
        # a loaded machine may take its time
        end = time.monotonic() + 120
        while not self._is_healthy():
            if self.process.poll() is not None or time.monotonic() > end:
                self.process.kill()
                self.process.wait()
                raise AssertionError((self.folder / "log").read_text())
            time.sleep(0.05)

    def _is_healthy(self) -> bool:
        with grpc.insecure_channel(self._health_at, [("grpc.default_authority", "localhost")]) as channel:
            check = channel.unary_unary("/grpc.health.v1.Health/Check")
            try:
                # an empty request means the server as a whole, the other names shared memory; the answer's one field
                # is 1 where it serves
                return all(check(name, timeout=1) == b"\x08\x01" for name in (b"", b"\x0a\x11wade.SharedMemory"))
            except grpc.RpcError:
                return False

    def send(self, number: signal.Signals) -> None:
        """Sends a signal to the server."""
        assert self.process is not None
        self.process.send_signal(number)

    def freeze(self) -> None:
        """Stops it as a debugger would; returns when every thread stands still."""
        assert self.process is not None
        # the server first, so that it does not start the process of shared memory again
        for process in [self.process.pid, *self._children()]:
            os.kill(process, signal.SIGSTOP)
            threads = Path(f"/proc/{process}/task")
            while any(") T " not in (thread / "stat").read_text() for thread in threads.iterdir()):
                time.sleep(0.001)

    def thaw(self) -> None:
        """Lets it go on."""
        for process in self._children():
            os.kill(process, signal.SIGCONT)
        self.send(signal.SIGCONT)

    def _children(self) -> list[int]:
        """The process that serves shared memory."""
        assert self.process is not None
        children = Path(f"/proc/{self.process.pid}/task").glob("*/children")
        return [int(child) for task in children for child in task.read_text().split()]

    def kill(self) -> None:
        """Ends it as a crash would."""
        self.send(signal.SIGKILL)
        self.wait()

    def stop(self) -> None:
        """Ends it if it runs."""
        if self.process is not None and self.process.poll() is None:
            self.thaw()
            self.send(signal.SIGTERM)
            self.wait()

    def wait(self) -> None:
        """Waits for the end of the process."""
        assert self.process is not None
        self.process.wait(timeout=20)
