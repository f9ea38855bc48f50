"""Units of the Husky, a server beside them, and runs of both."""

from __future__ import annotations

import os
import subprocess
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi3 import FMU3Slave
from numpy.typing import NDArray
from servers import VEHICLES, Server, binary, environment

LIBRARY = Path(os.environ["WADE_FMU_LIBRARY"])
VEHICLE = "husky"
Array = NDArray[np.float64]


def addresses(server: Server) -> dict[str, str]:
    return {"shm": f"shm:{server.namespace}", "grpc": f"unix:{server.socket}"}


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    server = Server(tmp_path_factory.mktemp("server"))
    server.start()
    yield server
    server.kill()


def unit(folder: Path, *arguments: str) -> Path:
    """Writes a unit."""
    out = folder / f"{uuid.uuid4().hex[:8]}.fmu"
    command: list[str | Path] = [binary(), "fmu", "--vehicle", VEHICLE, "--library", LIBRARY, "--out", out, *arguments]
    subprocess.run(command, check=True, env=environment() | {"WADE_VEHICLES": str(VEHICLES)})
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
