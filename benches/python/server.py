"""The baseline: Hydrodynamics/Evaluate for one vehicle from Python, with grpcio and ONNX Runtime.

Written as one would who wants it fast: everything that does not depend on the state is computed at the start, nothing
loops over surfaces, the network runs in ONNX Runtime. Level vehicles only.
"""

import argparse
import importlib
import math
import sys
import tempfile
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import grpc
import numpy as np
import onnx
import onnxruntime
from grpc_tools import protoc
from onnx import TensorProto, helper, numpy_helper
from safetensors.numpy import load_file

ROOT = Path(__file__).resolve().parents[2]
PROTO = "wade/v1/hydrodynamics"
KINDS = ["bottom", "front", "rear", "side", "wheel"]
GRAVITY = 9.81
VISCOSITY = 1.002e-3
SUBMERGENCE_SCALE = 0.366
FROUDE_DEPTH_LIMIT = 5.0


def load_stubs():
    """Messages and services, generated from `proto/` into a folder that is gone afterwards."""
    with tempfile.TemporaryDirectory() as out:
        arguments = [f"-I{ROOT / 'proto'}", f"--python_out={out}", f"--grpc_python_out={out}", f"{PROTO}.proto"]
        if protoc.main(["protoc", *arguments]) != 0:
            raise RuntimeError(f"protoc failed on {PROTO}.proto")
        sys.path.insert(0, out)
        module = PROTO.replace("/", ".")
        messages, services = (importlib.import_module(module + suffix) for suffix in ("_pb2", "_pb2_grpc"))
        sys.path.remove(out)
    return messages, services


def session(weights):
    """The network for any number of rows, scaled to force over density; one thread."""
    std, mean = weights["target_std"], weights["target_mean"]
    tensors = {name: weights[name] for name in ("w1", "b1", "w2", "b2")}
    # the last layer is linear, so the scaling of the targets goes into it
    tensors |= {"w3": weights["w3"] * std[:, None], "b3": weights["b3"] * std + mean}
    nodes = [
        helper.make_node("Gemm", ["rows", "w1", "b1"], ["z1"], transB=1),
        helper.make_node("Relu", ["z1"], ["h1"]),
        helper.make_node("Gemm", ["h1", "w2", "b2"], ["z2"], transB=1),
        helper.make_node("Relu", ["z2"], ["h2"]),
        helper.make_node("Gemm", ["h2", "w3", "b3"], ["forces"], transB=1),
    ]
    graph = helper.make_graph(
        nodes,
        "network",
        [helper.make_tensor_value_info("rows", TensorProto.FLOAT, ["K", 27])],
        [helper.make_tensor_value_info("forces", TensorProto.FLOAT, ["K", 3])],
        [numpy_helper.from_array(np.ascontiguousarray(value), name) for name, value in tensors.items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=10)
    onnx.checker.check_model(model)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.inter_op_num_threads = 1
    return onnxruntime.InferenceSession(model.SerializeToString(), options, providers=["CPUExecutionProvider"])


class Vehicle:
    """A trained bundle."""

    def __init__(self, directory):
        vehicle = tomllib.loads((directory / "vehicle.toml").read_text())
        weights = load_file(directory / "network.safetensors")
        samples = load_file(directory / "submergence.safetensors")
        surfaces = vehicle["surface"]
        self.name, self.version, self.provenance = vehicle["name"], vehicle["version"], vehicle["provenance"]
        self.z0, self.center_of_mass = vehicle["z0_m"], np.array(vehicle["center_of_mass_m"])
        self.size = [vehicle[f"{side}_m"] for side in ("length", "width", "height")]
        self.global_mean, self.global_std = weights["global_mean"], weights["global_std"]
        self.session = session(weights)

        centroids = np.array([s["centroid_m"] for s in surfaces])
        normals = np.array([s["normal"] for s in surfaces])
        areas = np.array([s["area_m2"] for s in surfaces]) / (self.size[0] * self.size[2])
        self.area_normals = areas[:, None] * normals
        # [K, 27]: the static features once and for all, the others with each state
        self.rows = np.zeros((len(surfaces), 27), np.float32)
        self.rows[range(len(surfaces)), [KINDS.index(s["kind"]) for s in surfaces]] = 1.0
        self.rows[:, 5:8] = centroids / self.size
        self.rows[:, 8:11] = normals
        self.rows[:, 11] = areas
        self.tabulate(samples["points"].astype(np.float64), samples["offsets"], centroids)

    def tabulate(self, points, offsets, centroids):
        """Wet share and wet centroid of every surface for each rank of the water among all heights: `[n + 1, K]`."""
        order = np.argsort(points[:, 2], kind="stable")
        self.heights = points[order, 2]
        surface = np.repeat(np.arange(len(centroids)), np.diff(offsets))[order]
        steps = np.zeros((len(points) + 1, len(centroids), 4))
        steps[np.arange(len(points)) + 1, surface, 0] = 1.0
        steps[np.arange(len(points)) + 1, surface, 1:] = points[order]
        sums = steps.cumsum(axis=0)
        count = sums[:, :, 0]
        self.fractions = count / np.diff(offsets)
        means = sums[:, :, 1:] / np.maximum(count, 1.0)[:, :, None]
        self.wet_centroids = np.where(count[:, :, None] > 0.0, means, centroids)

    def global_features(self, velocity, depth, density):
        """The standardized global features."""
        speed = math.hypot(*velocity)
        length = self.size[0]

        def froude(length):
            if speed == 0.0 or length <= 0.0:
                return 0.0 if speed == 0.0 else FROUDE_DEPTH_LIMIT
            return min(speed / math.sqrt(GRAVITY * length), FROUDE_DEPTH_LIMIT)

        features = [
            speed,
            density,
            depth,
            *velocity,
            froude(length),
            froude(depth),
            density * speed * length / VISCOSITY * 1e-6,
            *self.size,
        ]
        return (np.array(features, np.float32) - self.global_mean) / self.global_std, speed

    def evaluate(self, velocity, depth, density):
        """Forces, points, wetted fractions, net force and moment about the center of mass."""
        water = self.z0 + depth
        rank = self.heights.searchsorted(water, "right")
        fractions, points = self.fractions[rank], self.wet_centroids[rank]
        features, speed = self.global_features(velocity, depth, density)
        rows = self.rows
        rows[:, 12] = fractions
        rows[:, 13] = np.maximum(water - points[:, 2], 0.0) / SUBMERGENCE_SCALE
        rows[:, 14] = np.abs(self.area_normals @ velocity) / (speed or 1.0)
        rows[:, 15:] = features
        wet = fractions > 0.0
        forces = np.zeros((len(rows), 3))
        if wet.any():
            forces[wet] = self.session.run(None, {"rows": rows[wet]})[0] * density
        # sum of arm cross force, without the overhead of np.cross
        m = (points - self.center_of_mass).T @ forces
        moment = (m[1, 2] - m[2, 1], m[2, 0] - m[0, 2], m[0, 1] - m[1, 0])
        return forces, points, fractions, forces.sum(axis=0), moment


def make_servicer(vehicle, messages, services):
    """The service for one vehicle."""
    vector = messages.Vector3
    about = vector(**dict(zip("xyz", vehicle.center_of_mass)))
    summary = messages.VehicleSummary(
        name=vehicle.name,
        bundle_version=vehicle.version,
        surface_count=len(vehicle.rows),
        provenance=vehicle.provenance,
    )
    listing = messages.ListVehiclesResponse(vehicles=[summary])

    class Servicer(services.HydrodynamicsServicer):
        """Answers level states; ListVehicles is the echo, which does nothing."""

        def ListVehicles(self, request, context):
            return listing

        def Evaluate(self, request, context):
            start = time.perf_counter_ns()
            state = request.state
            if request.vehicle != vehicle.name:
                context.abort(grpc.StatusCode.NOT_FOUND, f"the only vehicle is {vehicle.name}")
            gravity = state.gravity_direction
            level = state.WhichOneof("attitude") in (None, "gravity_direction")
            level = level and gravity.x == gravity.y == 0.0 and gravity.z <= 0.0
            if not level or state.ground_contact == messages.GROUND_CONTACT_DRY:
                context.abort(grpc.StatusCode.UNIMPLEMENTED, "the baseline knows level vehicles on wet ground alone")
            v, c = state.velocity_mps, state.current_mps
            density = state.density_kgpm3 if state.HasField("density_kgpm3") else 1000.0
            forces, points, fractions, force, moment = vehicle.evaluate(
                (v.x - c.x, v.y - c.y, v.z - c.z), state.depth_m, density
            )
            return messages.EvaluateResponse(
                surface_force_n=forces.ravel().tolist(),
                surface_point_m=points.ravel().tolist(),
                wetted_fraction=fractions.tolist(),
                wrench=messages.Wrench(
                    force_n=vector(x=force[0], y=force[1], z=force[2]),
                    moment_nm=vector(x=moment[0], y=moment[1], z=moment[2]),
                    about_m=about,
                ),
                bundle_version=vehicle.version,
                provenance=vehicle.provenance,
                compute_ns=time.perf_counter_ns() - start,
            )

    return Servicer()


def main():
    """Serves until it is ended."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bundle", type=Path, default=ROOT / "vehicles" / "husky")
    parser.add_argument("--listen", default="127.0.0.1:50061")
    arguments = parser.parse_args()
    messages, services = load_stubs()
    server = grpc.server(ThreadPoolExecutor(max_workers=1))
    services.add_HydrodynamicsServicer_to_server(make_servicer(Vehicle(arguments.bundle), messages, services), server)
    server.add_insecure_port(arguments.listen)
    server.start()
    server.wait_for_termination()


if __name__ == "__main__":
    main()
