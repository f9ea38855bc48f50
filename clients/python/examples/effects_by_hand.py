"""Copies the bundles and adds effects with coefficients of one's own choice, so that a server has some to serve.

    python clients/python/examples/effects_by_hand.py --out /tmp/vehicles added_mass linear_damping
    wade serve --vehicles /tmp/vehicles

Nothing was measured: the coefficients are within what the literature has of such bodies, or what `--set` says. Effects
that trials show are added by `wade gap --apply`, and the server refuses a file that does not fit its bundle.
"""

from __future__ import annotations

import argparse
import json
import shutil
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

VEHICLES = Path(__file__).resolve().parents[3] / "vehicles"


@dataclass(frozen=True)
class Spec:
    """Coefficients in the order of the library, and the parameters in which the effect is not linear."""

    #: Name: value and unit.
    coefficients: dict[str, tuple[float, str]]
    shape: dict[str, tuple[float, str]] = field(default_factory=dict)


def _plain(**values: float) -> dict[str, tuple[float, str]]:
    return {name: (value, "1") for name, value in values.items()}


LIBRARY = {
    "added_mass": Spec(_plain(surge=0.3, sway=1.0, heave=1.5, roll=0.5, pitch=0.8, yaw=0.5)),
    "linear_damping": Spec(_plain(surge=0.02, sway=0.05, heave=0.15)),
    "drag_coefficient_error": Spec(_plain(surge=0.15, sway=0.15, heave=0.15)),
    "rotation": Spec(_plain(drag_coefficient=0.8)),
    "current": Spec({"east": (0.15, "m/s"), "north": (0.1, "m/s")}),
    "water_level_offset": Spec({"offset": (0.01, "m")}),
    "density_error": Spec(_plain(relative_error=0.02)),
    "hull_flooding": Spec({"flooded_share": (0.15, "1"), "arm_x": (0.1, "m")}, _plain(opening_ratio=0.01)),
    "water_entry_slamming": Spec(_plain(vertical=0.6, horizontal=0.6), {"wet_at": (0.0, "m")}),
    "wave_memory": Spec(
        _plain(surge=0.15, sway=0.15, heave=0.15), {"time_constant": (0.8, "s"), "frequency": (2.0, "rad/s")}
    ),
    "channel_blockage": Spec(_plain(strength=0.5), _plain(faded_at=0.0)),
    "squat": Spec(_plain(sinkage=0.3, trim=0.1), _plain(faded_at=0.0)),
    "wheel_paddle_thrust": Spec(_plain(thrust=0.4, torque=0.0)),
    "bed_motion": Spec(_plain(drag=0.1, lift=0.1)),
    "hull_lift": Spec(_plain(sway_of_yaw=0.2, yaw_of_drift=-0.3)),
}


def add_effects(vehicle: Path, effects: dict[str, dict[str, float]]) -> None:
    """Puts effects into a bundle: name of the effect to the coefficients that are not those of `LIBRARY`."""
    lines = (vehicle / "SHA256SUMS").read_text().splitlines()
    sums = {name: digest for digest, name in (line.split() for line in lines)}
    base = 'base = "physics"\n' if "radiation.safetensors" in sums else ""
    text = _file(vehicle.name, f'weights_sha256 = "{sums["network.safetensors"]}"\n{base}', effects)
    (vehicle / "effects.toml").write_text(text)
    sums["effects.toml"] = sha256(text.encode()).hexdigest()
    (vehicle / "SHA256SUMS").write_text("".join(f"{sums[name]}  {name}\n" for name in sorted(sums)))


def copy_with(effects: dict[str, dict[str, float]], out: Path, vehicles: Path = VEHICLES) -> Path:
    """A copy of the bundles of a folder, each with these effects."""
    for bundle in sorted(path for path in vehicles.iterdir() if (path / "SHA256SUMS").is_file()):
        shutil.copytree(bundle, out / bundle.name)
        if effects:
            add_effects(out / bundle.name, effects)
    return out


def _file(vehicle: str, stands_on: str, effects: dict[str, dict[str, float]]) -> str:
    parts = [
        f"format = 1\nvehicle = {json.dumps(vehicle)}\n",
        "[evidence]",
        'trials = []\ntrials_sha256 = ""\nsamples = 0\nmodel_sha256 = ""\ntool = "by hand"',
        f'generated = "chosen, not measured"\n{stands_on}',
        "[validity]",
        "depth_m = [0.0, 1.0]\nspeed_mps = [0.0, 10.0]\nacceleration_mps2 = [0.0, 1000.0]",
        "angular_speed_radps = [0.0, 20.0]\ndensity_kgpm3 = [900.0, 2000.0]\n",
    ]
    for name, values in effects.items():
        spec = LIBRARY[name]
        shape = [value for value, _ in spec.shape.values()]
        numbers = {key: (values.get(key, value), unit) for key, (value, unit) in spec.coefficients.items()}
        zeros = [[0.0] * len(numbers)] * len(numbers)
        parts += [
            f'[[effect]]\nname = "{name}"\nequation = ""\nprovisional = false\nshare_of_gap = 0.0',
            f"shape = {[*shape, 0.0, 0.0, 0.0][:3]}\nbase_drag = [1.1, 1.3, 0.9]",
            *(["channel_width = 4.0"] if name == "channel_blockage" else []),
            f"coefficients = {json.dumps(list(numbers))}\ncovariance = {zeros}\n",
        ]
        for key, (value, unit) in (numbers | spec.shape).items():
            parts.append(f'[effect.parameters.{key}]\nvalue = {float(value)}\nstd = 0.0\nunit = "{unit}"\n')
    return "\n".join(parts)


def main() -> None:
    """Copies and adds."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("effects", nargs="+", choices=LIBRARY, metavar="EFFECT", help=", ".join(LIBRARY))
    parser.add_argument("--out", type=Path, required=True, help="folder for the bundles, which must not exist")
    parser.add_argument("--vehicles", type=Path, default=VEHICLES)
    parser.add_argument("--set", action="append", default=[], metavar="EFFECT.COEFFICIENT=VALUE")
    arguments = parser.parse_args()
    effects: dict[str, dict[str, float]] = {name: {} for name in arguments.effects}
    for text in arguments.set:
        name, _, value = text.partition("=")
        effect, _, coefficient = name.partition(".")
        if effect not in effects or coefficient not in LIBRARY[effect].coefficients:
            parser.error(f"--set {text}: {name} is no coefficient of an effect that is added")
        effects[effect][coefficient] = float(value)
    copy_with(effects, arguments.out, arguments.vehicles)


if __name__ == "__main__":
    main()
