"""Units of the Husky, a server beside them, and runs of both."""

from __future__ import annotations

import os
import subprocess
import time
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi3 import FMU3Slave
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[3]
WADE = Path(os.environ["WADE_BIN"])
LIBRARY = Path(os.environ["WADE_FMU_LIBRARY"])
VEHICLE = "husky"
Array = NDArray[np.float64]


def environment() -> dict[str, str]:
    """Without settings that would win over a test's own."""
    return {name: value for name, value in os.environ.items() if not name.startswith("WADE_")}


class Server:
    """A real `wade serve`; may be killed and started again at the same places."""

    def __init__(self, folder: Path):
        self.socket, self.namespace = folder / "wade.sock", f"fmu_{uuid.uuid4().hex[:12]}"
        self._config, self._log = folder / "wade.toml", folder / "log"
        self._config.write_text(
            f'[grpc]\nlisten = "127.0.0.1:0"\nunix_socket = "{self.socket}"\n'
            f'[shm]\nnamespace = "{self.namespace}"\n[http]\nlisten = ""\n'
        )
        self.process: subprocess.Popen[bytes] | None = None

    @property
    def addresses(self) -> dict[str, str]:
        return {"shm": f"shm:{self.namespace}", "grpc": f"unix:{self.socket}"}

    def start(self) -> None:
        """Returns when it answers over both."""
        command: list[str | Path] = [WADE, "serve", "--config", self._config, "--vehicles", ROOT / "vehicles"]
        with self._log.open("ab") as log:
            self.process = subprocess.Popen(command, env=environment(), stdout=log, stderr=log)
        end = time.monotonic() + 60
        for address in self.addresses.values():
            query: list[str | Path] = [WADE, "query", "--vehicle", VEHICLE, "--depth", "0.1", "--addr", address]
            while subprocess.run(query, env=environment(), capture_output=True).returncode != 0:
                assert self.process.poll() is None and time.monotonic() < end, self._log.read_text()
                time.sleep(0.05)

    def kill(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.wait()


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    server = Server(tmp_path_factory.mktemp("server"))
    server.start()
    yield server
    server.kill()


def unit(folder: Path, *arguments: str) -> Path:
    """Writes a unit."""
    out = folder / f"{uuid.uuid4().hex[:8]}.fmu"
    command: list[str | Path] = [WADE, "fmu", "--vehicle", VEHICLE, "--library", LIBRARY, "--out", out, *arguments]
    subprocess.run(command, check=True, env=environment() | {"WADE_VEHICLES": str(ROOT / "vehicles")})
    return out


class Run:
    """A run of a unit, by names of variables."""

    def __init__(self, unpacked: Path):
        description = fmpy.read_model_description(str(unpacked))
        self.references = {variable.name: variable.valueReference for variable in description.modelVariables}
        self._counts = {
            variable.valueReference: int(np.prod([dimension.start for dimension in variable.dimensions] or [1]))
            for variable in description.modelVariables
        }
        self.messages: list[str] = []
        self.slave = FMU3Slave(
            guid=description.guid,
            unzipDirectory=str(unpacked),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="run",
        )
        self.slave.instantiate(logMessage=self._hear)
        self.time = 0.0

    def _hear(self, _environment: Any, _status: int, _category: bytes, message: bytes) -> None:
        self.messages.append(message.decode())

    def set(self, name: str, values: Any) -> None:
        self.slave.setFloat64([self.references[name]], [float(value) for value in np.ravel(values)])

    def set_flag(self, name: str, value: bool) -> None:
        self.slave.setBoolean([self.references[name]], [value])

    def get(self, name: str) -> Array:
        reference = self.references[name]
        return np.array(self.slave.getFloat64([reference], nValues=self._counts[reference]))

    def begin(self) -> None:
        self.slave.enterInitializationMode(startTime=0.0)
        self.slave.exitInitializationMode()

    def step(self, length: float) -> None:
        self.slave.doStep(self.time, length)
        self.time += length

    def derivative(self, unknown: str, known: str, seed: Any) -> Array:
        references = [self.references[name] for name in (unknown, known)]
        seed = [float(value) for value in np.ravel(seed)]
        return np.array(self.slave.getDirectionalDerivative(references[:1], references[1:], seed, 3))

    def close(self) -> None:
        self.slave.freeInstance()
