"""Units that recordings come in, as factors to SI."""

import math

#: Factor to the SI unit, by quantity and unit.
UNITS: dict[str, dict[str, float]] = {
    "length": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254, "ft": 0.3048},
    "velocity": {"m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2, "km/h": 1 / 3.6, "mph": 0.44704, "kn": 1852 / 3600},
    "angle": {"rad": 1.0, "deg": math.pi / 180},
    "angular velocity": {"rad/s": 1.0, "deg/s": math.pi / 180, "rpm": math.pi / 30},
    "angular acceleration": {"rad/s2": 1.0, "deg/s2": math.pi / 180},
    "acceleration": {"m/s2": 1.0, "g": 9.81, "mm/s2": 1e-3},
    "force": {"N": 1.0, "kN": 1e3, "lbf": 4.4482216152605, "kgf": 9.80665},
    "moment": {"N m": 1.0, "kN m": 1e3, "N mm": 1e-3, "lbf ft": 1.3558179483314},
    "density": {"kg/m3": 1.0, "g/cm3": 1e3},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "share": {"1": 1.0, "%": 1e-2},
}

#: Other spellings, in lower case and without blanks.
SPELLINGS = {
    "meter": "m", "meters": "m", "millimeters": "mm", "millimeter": "mm", "centimeters": "cm", "inches": "in",
    "feet": "ft", "mps": "m/s", "m/sec": "m/s", "kmh": "km/h", "km/hr": "km/h", "kph": "km/h", "knots": "kn",
    "radian": "rad", "radians": "rad", "°": "deg", "degree": "deg", "degrees": "deg", "rad/sec": "rad/s",
    "radps": "rad/s", "°/s": "deg/s", "degps": "deg/s", "dps": "deg/s", "deg/sec": "deg/s", "1/min": "rpm",
    "rev/min": "rpm", "m/s^2": "m/s2", "m/s²": "m/s2", "mps2": "m/s2", "gn": "g", "nm": "N m", "n*m": "N m",
    "n·m": "N m", "knm": "kN m", "nmm": "N mm", "lbfft": "lbf ft", "ft-lbf": "lbf ft", "kg/m^3": "kg/m3",
    "kg/m³": "kg/m3", "kgpm3": "kg/m3", "sec": "s", "seconds": "s", "second": "s", "milliseconds": "ms", "µs": "us",
    "rad/s^2": "rad/s2", "lb": "lbf", "newton": "N", "newtons": "N", "": "1", "-": "1",
}  # fmt: skip


def canonical_unit(quantity: str, text: str) -> str | None:
    """The unit of a quantity under its own spelling; ``None`` for a unit that the quantity does not have."""
    squeezed = text.strip().replace(" ", "")
    own = {unit.replace(" ", "").lower(): unit for unit in UNITS[quantity]}
    lower = squeezed.lower()
    found = own.get(lower) or SPELLINGS.get(lower)
    return found if found in UNITS[quantity] else None


def quantity_of(column: str) -> str:
    """The quantity of a trial's column."""
    exact = {"t": "time", "depth": "length", "water_level": "length", "bed_clearance": "length", "rho": "density"}
    if column in exact:
        return exact[column]
    if column in ("vx", "vy", "vz", "cx", "cy", "cz"):
        return "velocity"
    if column in ("wx", "wy", "wz") or column.startswith("wheel_"):
        return "angular velocity"
    if column in ("roll", "pitch", "yaw"):
        return "angle"
    if column in ("ax", "ay", "az"):
        return "acceleration"
    if column in ("alx", "aly", "alz"):
        return "angular acceleration"
    end = column.rsplit("_", 1)[-1]
    if end in ("fx", "fy", "fz"):
        return "force"
    if end in ("mx", "my", "mz"):
        return "moment"
    return "share"


def si_unit(quantity: str) -> str:
    """The SI unit of a quantity."""
    return next(iter(UNITS[quantity]))
