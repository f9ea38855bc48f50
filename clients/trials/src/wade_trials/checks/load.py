"""The load: its vertical part at rest is rho g V, and its part along x opposes the motion."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from .. import limits, wade
from ..axes import (
    PRESETS,
    SINGLE_TURNS,
    axes_text,
    opposite,
)
from ..errors import TrialsError
from ..mapping import Mapping
from ..units import UNITS
from .finding import Finding

Array = NDArray[np.float64]


def check_lift(name: str, mapping: Mapping, columns: dict[str, Array], rest: NDArray[np.bool_]) -> Iterator[Finding]:
    """The measured vertical force at rest is rho g V."""
    if "fz" not in columns:
        return
    field = "wrench.force" if mapping.wrench else "columns.fz"
    if not rest.any():
        message = "the lift was not checked: no half second at rest was found; state rest_s where there is one"
        yield Finding("lift", "skipped", name, f"trials.{name}.rest_s", message)
        return
    if "depth" not in columns:
        yield Finding("lift", "skipped", name, field, "the lift was not checked: it needs a depth")
        return
    depth = float(np.median(columns["depth"][rest]))
    density = mapping.fluid_density_kgpm3
    if depth <= 0:
        yield Finding("lift", "skipped", name, field, "the lift was not checked: the vehicle rests on dry ground")
        return
    try:
        lift, low, high = (
            wade.buoyancy(mapping.vehicle, round(max(d, 1e-3), 4), density)
            for d in (depth, depth - limits.LIFT_DEPTH, depth + limits.LIFT_DEPTH)
        )
    except TrialsError as error:
        yield Finding("lift", "skipped", name, field, f"the lift was not checked: {error}")
        return
    low, high = low * (1 - limits.LIFT_SHARE), high * (1 + limits.LIFT_SHARE)

    def fits(value: float) -> bool:
        return low <= value <= high

    fz = float(np.mean(columns["fz"][rest]))
    if fits(fz):
        yield Finding("lift", "ok", name, field, f"{fz:.0f} N at rest, rho g V is {lift:.0f} N")
        return
    message = f"fz at rest is {fz:.4g} N, rho g V at {depth:.3f} m is {lift:.4g} N"
    likely, write = _likely_lift(mapping, columns, rest, fz, fits)
    yield Finding("lift", "wrong", name, field, message + likely, write)


def drag_of(columns: dict[str, Array]) -> float | None:
    """Mean of fx against the motion [N]; ``None`` where the vehicle hardly moves or fx was not measured."""
    moving = np.abs(columns["vx"]) > limits.MOVING
    if "fx" not in columns or np.count_nonzero(moving) < limits.FROZEN_SAMPLES:
        return None
    return -float(np.mean(columns["fx"][moving] * np.sign(columns["vx"][moving])))


def check_drag(name: str, mapping: Mapping, columns: dict[str, Array]) -> Iterator[Finding]:
    """The load along x opposes the motion; a cell that also bears the drive may not show it."""
    drag = drag_of(columns)
    if drag is None:
        return
    field = "wrench.force" if mapping.wrench else "columns.fx"
    noise = float(np.std(columns["fx"])) / 10
    if drag > -noise:
        yield Finding("drag", "ok", name, field, f"fx opposes the motion by {drag:.1f} N on average")
        return
    message = f"fx is along the motion, by {-drag:.1f} N on average, and drag opposes it"
    stated = mapping.columns.get("fx")
    write = f"factor = {-stated.factor:g} in [columns] fx" if stated else "axes with the other sign under [wrench]"
    yield Finding("drag", "doubt", name, field, message, write)


def _likely_lift(
    mapping: Mapping,
    columns: dict[str, Array],
    rest: NDArray[np.bool_],
    fz: float,
    fits: Callable[[float], bool],
) -> tuple[str, str]:
    """What explains a wrong lift, and what to write."""
    wrench = mapping.wrench
    weight = (mapping.body.mass_kg or 0.0) * limits.GRAVITY if mapping.body else 0.0
    where = "under [wrench]" if wrench else "in [columns] fz"
    if wrench:
        unit_key, stated, reverse = "force_unit", wrench.force_unit, f"sign = {-wrench.sign}"
    else:
        column = mapping.columns["fz"]
        unit_key, stated, reverse = "unit", column.unit or "N", f"factor = {-column.factor:g}"
    if fits(-fz):
        message = "; the sign is reversed: "
        drag = drag_of(columns)
        if not wrench or drag is None:
            message += "it is the reaction on the cell, or z points down (NED)"
            return message, f'{reverse}, or axes = "NED", {where}' if wrench else f"{reverse} {where}"
        if drag > 0:
            return message + "z points down (NED), since fx opposes the motion", f'axes = "NED" {where}'
        return message + "it is the reaction on the cell, since fx is along the motion, too", f"{reverse} {where}"
    for unit, scale in UNITS["force"].items():
        for sign, also in ((1, ""), (-1, f" and {reverse}")):
            if unit != stated and fits(sign * fz * scale / UNITS["force"][stated]):
                return f"; it fits {unit}", f'{unit_key} = "{unit}"{also} {where}'
    for at, axis in enumerate(("fx", "fy")):
        value = float(np.mean(columns[axis][rest])) if axis in columns else 0.0
        if wrench and fits(abs(value)):
            up = wrench.axes[at] if value * wrench.sign > 0 else opposite(wrench.axes[at])
            axes = next((a for a in (*PRESETS.values(), *SINGLE_TURNS) if a[2] == up), PRESETS["z up"])
            return (
                f"; {axis} has that value, so {up} of the cell points up",
                f"axes = {axes_text(axes)} {where}",
            )
    if weight and fits(fz + weight):
        message = "; the reading holds the weight of the vehicle"
        return message, f"weight_n = {weight:.1f} {where}" if wrench else ""
    return "; neither sign, unit, axis nor weight explain it: was the cell zeroed in air?", ""
