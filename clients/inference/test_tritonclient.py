"""Promise: an existing inference client works with wade as it is, and gets the bits that `Evaluate` answers."""

from __future__ import annotations

import json
import os
import re
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import tritonclient.grpc as triton
from tritonclient.utils import InferenceServerException

ROOT = Path(__file__).resolve().parents[2]
SURFACES = {"husky": 13, "warthog": 10}


def shipped(vehicle: str, key: str) -> str:
    """What the shipped bundle states of itself."""
    match = re.search(rf'^{key} = "?(.*?)"?$', (ROOT / "vehicles" / vehicle / "vehicle.toml").read_text(), re.MULTILINE)
    assert match, f"{vehicle} states no {key}"
    return match.group(1)


def binary() -> Path:
    """`$WADE_BIN`, or what cargo built last of release and debug."""
    if "WADE_BIN" in os.environ:
        return Path(os.environ["WADE_BIN"]).resolve(strict=True)
    built = [ROOT / "target" / profile / "wade" for profile in ("release", "debug")]
    return max((path for path in built if path.is_file()), key=lambda path: path.stat().st_mtime).resolve()


@contextmanager
def served(folder: Path, settings: str, **ssl: object) -> Iterator[str]:
    """The address of a server of gRPC alone, which tritonclient reaches with such options."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{probe.getsockname()[1]}"
    (folder / "wade.toml").write_text(
        f'vehicles = "{ROOT / "vehicles"}"\n[shm]\nenabled = false\n[http]\nlisten = ""\n'
        f'[grpc]\nlisten = "{address}"\nunix_socket = ""\n{settings}'
    )
    with (folder / "log").open("wb") as log:
        process = subprocess.Popen([binary(), "serve", "--config", folder / "wade.toml"], stderr=log)
    end = time.monotonic() + 30
    try:
        while not is_ready(address, **ssl):
            assert process.poll() is None and time.monotonic() < end, (folder / "log").read_text()
            time.sleep(0.1)
        yield address
    finally:
        process.terminate()
        process.wait(20)


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with served(tmp_path_factory.mktemp("server"), "admin_over_tcp = true\n") as address:
        yield address


def is_ready(address: str, **ssl: object) -> bool:
    with triton.InferenceServerClient(address, **ssl) as client:
        try:
            return client.is_server_ready()
        except InferenceServerException:
            return False


@pytest.fixture
def client(address: str) -> Iterator[triton.InferenceServerClient]:
    with triton.InferenceServerClient(address) as client:
        yield client


def tensor(name: str, values: np.ndarray) -> triton.InferInput:
    made = triton.InferInput(name, list(values.shape), "FP32")
    made.set_data_from_numpy(values.astype(np.float32))
    return made


def test_the_server_and_its_models_are_described(client: triton.InferenceServerClient) -> None:
    assert client.is_server_live() and client.is_server_ready()
    assert client.get_server_metadata().name == "wade"
    assert client.is_model_ready("husky") and not client.is_model_ready("tank")
    metadata = client.get_model_metadata("husky", as_json=True)
    assert metadata["versions"] == [shipped("husky", "version")]
    inputs = {entry["name"]: entry for entry in metadata["inputs"]}
    assert inputs["velocity_mps"]["shape"] == ["-1", "3"] and inputs["depth_m"]["shape"] == ["-1"]
    assert {entry["datatype"] for entry in metadata["inputs"]} == {"FP32"}
    index = client.get_model_repository_index(as_json=True)["models"]
    assert [(entry["name"], entry["state"]) for entry in index] == [("husky", "READY"), ("warthog", "READY")]


@pytest.mark.parametrize("vehicle", SURFACES)
def test_forces_have_the_bits_of_a_single_query(
    client: triton.InferenceServerClient, address: str, vehicle: str
) -> None:
    velocity = np.array([[0.8, 0, 0], [0.3, -0.2, 0.01], [0, 0, 0]], dtype=np.float32)
    depth = np.array([0.18, 0.1, 0], dtype=np.float32)
    inputs = [tensor("depth_m", depth), tensor("velocity_mps", velocity)]
    result = client.infer(vehicle, inputs, request_id="17")
    answer = result.get_response()
    assert (answer.id, answer.model_name, answer.model_version) == ("17", vehicle, shipped(vehicle, "version"))
    assert answer.parameters["provenance"].string_param == shipped(vehicle, "provenance")
    assert result.as_numpy("surface_force_n").shape == (3, SURFACES[vehicle], 3)
    assert result.as_numpy("in_domain").dtype == np.bool_
    for row in range(3):
        query = [binary(), "query", "--vehicle", vehicle, "--addr", f"http://{address}", "--json"]
        state = [f"--velocity={','.join(map(str, velocity[row]))}", f"--depth={depth[row]}"]
        expected = json.loads(subprocess.run([*query, *state], check=True, capture_output=True).stdout)
        for name, values in {
            "force_n": expected["wrench"]["force"],
            "moment_nm": expected["wrench"]["moment"],
            "uncertainty_n": expected["uncertainty"]["force"],
            "surface_force_n": [surface["force"] for surface in expected["surfaces"]],
            "surface_point_m": [surface["point"] for surface in expected["surfaces"]],
            "wetted_fraction": [surface["wetted_fraction"] for surface in expected["surfaces"]],
        }.items():
            np.testing.assert_array_equal(result.as_numpy(name)[row], np.array(values, dtype=np.float32), name)
        assert bool(result.as_numpy("in_domain")[row]) == expected["in_domain"]


def test_outputs_and_parameters_are_those_asked_for(client: triton.InferenceServerClient) -> None:
    inputs = [tensor("depth_m", np.full(2, 0.15))]
    wetted = client.infer("husky", inputs, outputs=[triton.InferRequestedOutput("force_n")])
    assert [entry.name for entry in wetted.get_response().outputs] == ["force_n"]
    dry = client.infer("husky", inputs, parameters={"ground_contact": "GROUND_CONTACT_DRY"})
    assert (dry.as_numpy("force_n")[:, 2] != wetted.as_numpy("force_n")[:, 2]).all()


def test_a_large_batch(client: triton.InferenceServerClient) -> None:
    depth = np.linspace(0.06, 0.2, 4096)
    force = client.infer("husky", [tensor("depth_m", depth)], outputs=[triton.InferRequestedOutput("force_n")])
    assert force.as_numpy("force_n").shape == (4096, 3)


def test_a_wrong_tensor_is_named(client: triton.InferenceServerClient) -> None:
    good = tensor("depth_m", np.full(2, 0.15))
    wrong = triton.InferInput("depth_m", [2], "FP64")
    wrong.set_data_from_numpy(np.full(2, 0.15))
    for inputs, name in [
        ([good, tensor("velocity_mps", np.zeros((2, 2)))], "velocity_mps"),
        ([good, tensor("speed", np.zeros(2))], "speed"),
        ([wrong], "depth_m"),
        ([tensor("depth_m", np.full((2, 1), 0.15))], "depth_m"),
        ([tensor("depth_m", np.array([0.1, np.nan]))], "depth_m"),
        ([tensor("velocity_mps", np.zeros((2, 3)))], "depth_m"),
    ]:
        with pytest.raises(InferenceServerException, match=name) as raised:
            client.infer("husky", inputs)
        assert "INVALID_ARGUMENT" in raised.value.status()
    with pytest.raises(InferenceServerException, match="husky, warthog") as raised:
        client.infer("tank", [good])
    assert "NOT_FOUND" in raised.value.status()
    with pytest.raises(InferenceServerException, match="version"):
        client.infer("husky", [good], model_version="4294967295")
    with pytest.raises(InferenceServerException, match="sequence"):
        client.infer("husky", [good], sequence_id=5, sequence_start=True)
    assert client.infer("husky", [good]).as_numpy("force_n").shape == (2, 3)


def test_an_administrator_unloads_and_loads(client: triton.InferenceServerClient) -> None:
    client.unload_model("warthog")
    assert not client.is_model_ready("warthog")
    index = client.get_model_repository_index(as_json=True)["models"]
    assert [(entry["name"], entry["state"]) for entry in index] == [("husky", "READY"), ("warthog", "UNAVAILABLE")]
    client.load_model("warthog")
    assert client.is_model_ready("warthog")
    with pytest.raises(InferenceServerException, match="tank"):
        client.load_model("tank")


def test_over_tls_a_token_in_a_header_is_answered(client: triton.InferenceServerClient, tmp_path: Path) -> None:
    def run(*command: str | Path) -> str:
        return subprocess.run(command, check=True, capture_output=True, text=True, cwd=tmp_path).stdout.strip()

    request = ["-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2"]
    request += ["-subj", "/CN=wade", "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", "key.pem", "-out", "ca.pem"]
    run("openssl", "req", *request)
    rig, watcher = (
        {"authorization": f"Bearer {run(binary(), 'token', role, '--roles', role, '--file', 'tokens.toml')}"}
        for role in ("query", "observe")
    )
    settings = f'[tls]\ncertificate = "{tmp_path}/ca.pem"\nkey = "{tmp_path}/key.pem"\n'
    settings += f'[access]\ntokens = "{tmp_path}/tokens.toml"\n'
    ssl = {"ssl": True, "root_certificates": str(tmp_path / "ca.pem")}
    inputs = [tensor("depth_m", np.linspace(0.06, 0.2, 5))]
    expected = client.infer("husky", inputs).as_numpy("force_n")
    with served(tmp_path, settings, **ssl) as address, triton.InferenceServerClient(address, **ssl) as encrypted:
        # who asks only whether it is there shows nothing
        assert encrypted.is_server_live() and encrypted.is_server_ready()
        np.testing.assert_array_equal(encrypted.infer("husky", inputs, headers=rig).as_numpy("force_n"), expected)
        assert encrypted.get_inference_statistics("husky", headers=watcher).model_stats
        for headers, status in [(None, "UNAUTHENTICATED"), (watcher, "PERMISSION_DENIED")]:
            with pytest.raises(InferenceServerException, match="query") as raised:
                encrypted.infer("husky", inputs, headers=headers)
            assert status in raised.value.status()
        with pytest.raises(InferenceServerException, match="administer"):
            encrypted.unload_model("husky", headers=rig)
