"""``mapping.toml``: which channel of a recording becomes which column, in which units and axes."""

import math
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .axes import PRESETS, Axes, is_left_handed, parse_axes
from .errors import TrialsError
from .source import Clock
from .units import UNITS, canonical_unit, quantity_of, si_unit

#: Version of the format.
FORMAT = 1
MAPPING_FILE = "mapping.toml"

Triple = tuple[float, float, float]

#: Columns of a trial that a channel may become, beside ``NAME_fx`` and so on.
COLUMNS = (
    *("vx", "vy", "vz", "wx", "wy", "wz", "roll", "pitch", "yaw", "depth", "water_level", "bed_clearance", "bed"),
    *("cx", "cy", "cz", "ax", "ay", "az", "alx", "aly", "alz", "rho"),
    *("wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr", "fx", "fy", "fz", "mx", "my", "mz"),
    *("sim_fx", "sim_fy", "sim_fz", "sim_mx", "sim_my", "sim_mz"),
)
WRENCH = ("fx", "fy", "fz", "mx", "my", "mz")
#: What a quaternion turns: vectors of the body into the world, or of the world into the body.
DIRECTIONS = ("world_from_body", "body_from_world")


@dataclass(frozen=True)
class Processing:
    """Rates and filter; the defaults are the paper's."""

    #: Rate after resampling [Hz].
    rate_hz: float = 111.0
    #: Window of the Savitzky-Golay filter [samples].
    window: int = 9
    #: Order of its polynomial.
    order: int = 2


@dataclass(frozen=True)
class Body:
    """What must be known of the vehicle; ``wade vehicle show`` states it."""

    #: Height of the ground-contact plane in the body frame [m].
    ground_contact_z_m: float
    #: In the body frame [m].
    center_of_mass_m: Triple
    mass_kg: float | None = None


@dataclass(frozen=True)
class Pose:
    """A tracked point and its axes, in the frame of the cameras."""

    position: tuple[str, str, str]
    quaternion: tuple[str, str, str, str]
    #: Order of the four channels, ``wxyz`` or ``xyzw``.
    quaternion_order: str = "wxyz"
    #: What the quaternion turns, ``world_from_body``, or ``body_from_world``, its conjugate.
    quaternion_direction: str = "world_from_body"
    position_unit: str = "m"
    #: For each of our world axes (z up) the one of the recording.
    axes: Axes = PRESETS["z up"]
    #: For each of our body axes (forward, left, up) the one of the tracked body.
    body_axes: Axes = PRESETS["z up"]
    #: Vector from the tracked point to the body origin, body frame [m].
    tracked_point_to_origin_m: Triple = (0.0, 0.0, 0.0)

    @property
    def is_conjugate(self) -> bool:
        """True where the quaternion turns vectors of the world into the body."""
        return self.quaternion_direction != DIRECTIONS[0]


@dataclass(frozen=True)
class Wrench:
    """A load cell. An empty name is a component that was not measured."""

    force: tuple[str, str, str]
    moment: tuple[str, str, str] = ("", "", "")
    force_unit: str = "N"
    moment_unit: str = "N m"
    axes: Axes = PRESETS["z up"]
    #: 1 where the cell states what the water does to the vehicle, -1 where it states the reaction.
    sign: int = 1
    #: Point about which the cell states moments, body frame [m].
    point_m: Triple = (0.0, 0.0, 0.0)
    #: Weight that the cell bears in its reading [N]; 0 where it was zeroed in air.
    weight_n: float = 0.0


@dataclass(frozen=True)
class Imu:
    """An inertial sensor: the pose and the attitude are checked against it; it becomes no column."""

    specific_force: tuple[str, str, str]
    angular_velocity: tuple[str, str, str] = ("", "", "")
    force_unit: str = "m/s2"
    rate_unit: str = "rad/s"
    axes: Axes = PRESETS["z up"]


@dataclass(frozen=True)
class Column:
    """A channel that becomes a column as it is, or a constant."""

    channel: str = ""
    unit: str = ""
    #: Multiplies the channel, beside the unit; -1 turns its sign.
    factor: float = 1.0
    #: The value where there is no channel, in SI units.
    constant: float | None = None


@dataclass(frozen=True)
class Trial:
    """One recording."""

    file: str
    #: Altitude of the still water in our world frame, in meters.
    water_level_m: float | None = None
    #: Water depth over the flat ground, measured at rest [m].
    depth_m: float | None = None
    start_s: float | None = None
    end_s: float | None = None
    #: Spans of time that are left out [s].
    leave_out_s: tuple[tuple[float, float], ...] = ()
    #: Span in which the vehicle was at rest [s]; found from the motion where it is not stated.
    rest_s: tuple[float, float] | None = None
    channel_width_m: float | None = None
    sha256: str = ""


@dataclass
class Mapping:
    """All that an import needs, so that it can be repeated."""

    path: Path
    vehicle: str
    trials: dict[str, Trial]
    body: Body | None = None
    generated: str = ""
    fluid_density_kgpm3: float = 1000.0
    #: Speed above which a unit is in doubt [m/s].
    max_speed_mps: float = 12.0
    processing: Processing = field(default_factory=Processing)
    clock: Clock = field(default_factory=Clock)
    pose: Pose | None = None
    wrench: Wrench | None = None
    imu: Imu | None = None
    columns: dict[str, Column] = field(default_factory=dict)
    #: Keys of trials.toml that are taken over as they are.
    manifest: dict[str, Any] = field(default_factory=dict)
    #: Checks whose finding does not stop the import.
    accept: list[str] = field(default_factory=list)
    #: Fields that were guessed, with the reason.
    guesses: dict[str, str] = field(default_factory=dict)

    @classmethod
    def read(cls, path: Path) -> "Mapping":
        """Reads and checks the file."""
        try:
            table = tomllib.loads(path.read_text(encoding="utf-8"))
        except OSError as error:
            raise TrialsError(path, "", f"{error.strerror}: write one with wade-trials map") from None
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise TrialsError(path, "", f"it is not TOML: {error}") from None
        return _Reader(path).mapping(table)

    def channels(self) -> list[str]:
        """Every channel that is read, once."""
        names: list[str] = []
        if self.pose:
            names += [*self.pose.position, *self.pose.quaternion]
        if self.wrench:
            names += [*self.wrench.force, *self.wrench.moment]
        if self.imu:
            names += [*self.imu.specific_force, *self.imu.angular_velocity]
        names += [column.channel for column in self.columns.values()]
        return list(dict.fromkeys(name for name in names if name))

    def field_of(self, channel: str) -> str:
        """The field that names a channel."""
        for key in ("position", "quaternion"):
            if self.pose and channel in getattr(self.pose, key):
                return f"pose.{key}"
        for key in ("force", "moment"):
            if self.wrench and channel in getattr(self.wrench, key):
                return f"wrench.{key}"
        for key in ("specific_force", "angular_velocity"):
            if self.imu and channel in getattr(self.imu, key):
                return f"imu.{key}"
        found = next((name for name, column in self.columns.items() if column.channel == channel), "")
        return f"columns.{found}.channel"


class _Reader:
    """Turns tables into dataclasses; a fault names the field and what it must be."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def fault(self, name: str, message: str) -> TrialsError:
        return TrialsError(self.path, name, message)

    def mapping(self, table: dict[str, Any]) -> Mapping:
        known = [
            *("format", "vehicle", "generated", "fluid_density_kgpm3", "max_speed_mps", "accept", "body", "processing"),
            *("time", "pose", "wrench", "imu", "columns", "manifest", "guesses", "trials"),
        ]
        self.no_others("", table, known)
        if table.get("format") != FORMAT:
            raise self.fault("format", f"it must be {FORMAT}")
        trials = self.table("trials", table)
        if not trials:
            raise self.fault("trials", "there is none: write [trials.NAME] with file = PATH")
        mapping = Mapping(
            path=self.path,
            vehicle=self.text("vehicle", table),
            trials={name: self.trial(f"trials.{name}", self.table(name, trials, "trials.")) for name in trials},
            generated=self.text("generated", table, ""),
            fluid_density_kgpm3=self.number("fluid_density_kgpm3", table, 1000.0, 500.0, 3000.0),
            max_speed_mps=self.number("max_speed_mps", table, 12.0, 0.1, 50.0),
            accept=[str(name) for name in table.get("accept", [])],
            manifest=self.table("manifest", table),
            guesses={key: str(why) for key, why in self.table("guesses", table).items()},
        )
        if not mapping.vehicle:
            raise self.fault("vehicle", 'it names the vehicle\'s bundle: vehicle = "warthog"')
        if "body" in table:
            body = self.table("body", table)
            self.no_others("body.", body, ["ground_contact_z_m", "center_of_mass_m", "mass_kg"])
            mass = self.number("body.mass_kg", body, -1.0, 0.0, 1e8)
            mapping.body = Body(
                self.number("body.ground_contact_z_m", body, None, -10.0, 10.0),
                self.triple("body.center_of_mass_m", body, (0.0, 0.0, 0.0)),
                mass if mass > 0 else None,
            )
        mapping.processing = self.processing(self.table("processing", table))
        time = self.table("time", table)
        self.no_others("time.", time, ["channel", "unit", "rate_hz"])
        rate = self.number("time.rate_hz", time, 0.0, 1e-3, 1e6)
        mapping.clock = Clock(self.text("time.channel", time, ""), self.text("time.unit", time, ""), rate)
        mapping.pose = self.pose(self.table("pose", table)) if "pose" in table else None
        mapping.wrench = self.wrench(self.table("wrench", table)) if "wrench" in table else None
        mapping.imu = self.imu(self.table("imu", table)) if "imu" in table else None
        columns = self.table("columns", table)
        mapping.columns = {name: self.column(name, columns[name]) for name in columns}
        self.consistent(mapping)
        return mapping

    def consistent(self, mapping: Mapping) -> None:
        has = mapping.columns
        if mapping.pose is None:
            for name in ("vx", "vy", "vz", "wx", "wy", "wz"):
                if name not in has:
                    raise self.fault(
                        f"columns.{name}",
                        "it is missing: state a channel, constant = 0.0 where the vehicle was held, or a [pose]",
                    )
        elif mapping.body is None:
            raise self.fault("body.ground_contact_z_m", "it is missing, and the depth needs it: see wade vehicle show")
        else:
            made = ("vx", "vy", "vz", "wx", "wy", "wz", "roll", "pitch", "yaw", "depth")
            if twice := next((name for name in made if name in has), None):
                raise self.fault(f"columns.{twice}", "the pose gives this column, too: leave one of the two out")
        if mapping.wrench:
            measured = [n for n, c in zip(WRENCH, mapping.wrench.force + mapping.wrench.moment, strict=True) if c]
            if twice := next((name for name in measured if name in has), None):
                raise self.fault(f"columns.{twice}", "[wrench] gives this column, too: leave one of the two out")
            if mapping.body is None and any(mapping.wrench.moment):
                raise self.fault("body.center_of_mass_m", "it is missing, and moments are stated about it")
        if "depth" in has and "water_level" in has:
            raise self.fault("columns.water_level", "depth is there, too: leave one of the two out")
        level = "depth" in has or "water_level" in has
        for name, trial in mapping.trials.items():
            if mapping.pose and trial.water_level_m is None and "water_level" not in has:
                raise self.fault(
                    f"trials.{name}.water_level_m",
                    "it is missing: the altitude of the still water in the frame of the cameras, z up [m]",
                )
            if not mapping.pose and not level and trial.depth_m is None:
                raise self.fault(f"trials.{name}.depth_m", "neither it nor a column depth or water_level is stated")

    def trial(self, at: str, table: dict[str, Any]) -> Trial:
        known = ["file", "water_level_m", "depth_m", "start_s", "end_s", "leave_out_s", "rest_s", "channel_width_m"]
        self.no_others(at + ".", table, [*known, "sha256"])
        name = at.split(".", 1)[1]
        if not name or any(c in name for c in "/\\\0") or name.startswith("."):
            raise self.fault(at, "the name of a trial becomes that of a file: use letters, digits, - and _")
        optional = {
            key: self.number(f"{at}.{key}", table, None, low, high)
            for key, low, high in (
                ("water_level_m", -1000.0, 1000.0),
                ("depth_m", 1e-4, 20.0),
                ("start_s", -1e9, 1e9),
                ("end_s", -1e9, 1e9),
                ("channel_width_m", 1e-2, math.inf),
            )
            if key in table
        }
        spans = table.get("leave_out_s", [])
        if not isinstance(spans, list):
            raise self.fault(f"{at}.leave_out_s", "it is a list of spans: [[3.2, 4.0]]")
        rest = table.get("rest_s")
        return Trial(
            file=self.text(f"{at}.file", table),
            leave_out_s=tuple(self.span(f"{at}.leave_out_s", span) for span in spans),
            rest_s=None if rest is None else self.span(f"{at}.rest_s", rest),
            sha256=self.text(f"{at}.sha256", table, ""),
            **optional,
        )

    def span(self, at: str, value: object) -> tuple[float, float]:
        ok = isinstance(value, list) and len(value) == 2 and all(isinstance(v, int | float) for v in value)
        if not ok or value[0] >= value[1]:  # type: ignore[index]
            raise self.fault(at, "a span is [FROM, TO] in seconds, FROM before TO")
        return (float(value[0]), float(value[1]))  # type: ignore[index]

    def processing(self, table: dict[str, Any]) -> Processing:
        self.no_others("processing.", table, ["rate_hz", "window", "order"])
        window, order = table.get("window", 9), table.get("order", 2)
        if not isinstance(window, int) or window < 3 or window % 2 == 0:
            raise self.fault("processing.window", "it is an odd number of samples, 3 or more")
        if not isinstance(order, int) or not 1 <= order < window or order > 10:
            raise self.fault("processing.order", "it is 1 to 10 and less than the window")
        return Processing(self.number("processing.rate_hz", table, 111.0, 1.0, 1e4), window, order)

    def pose(self, table: dict[str, Any]) -> Pose:
        known = ["position", "quaternion", "quaternion_order", "quaternion_direction", "position_unit"]
        self.no_others("pose.", table, [*known, "axes", "body_axes", "tracked_point_to_origin_m"])
        order = self.text("pose.quaternion_order", table, "wxyz")
        if order not in ("wxyz", "xyzw"):
            raise self.fault("pose.quaternion_order", 'it is "wxyz" or "xyzw", the order of the four channels')
        direction = self.text("pose.quaternion_direction", table, DIRECTIONS[0])
        if direction not in DIRECTIONS:
            raise self.fault("pose.quaternion_direction", f'it is "{DIRECTIONS[0]}" or its conjugate "{DIRECTIONS[1]}"')
        axes = self.axes("pose.axes", table)
        body_axes = self.axes("pose.body_axes", table, axes)
        if is_left_handed(axes) != is_left_handed(body_axes):
            raise self.fault(
                "pose.axes", "one of axes and body_axes is left-handed and the other is not: check a sign in them"
            )
        if "tracked_point_to_origin_m" not in table:
            raise self.fault(
                "pose.tracked_point_to_origin_m",
                "it is missing: the vector from the tracked point to the middle of the hull, forward, left, up [m]",
            )
        position, quaternion = self.names("pose.position", table, 3), self.names("pose.quaternion", table, 4)
        return Pose(
            (position[0], position[1], position[2]),
            (quaternion[0], quaternion[1], quaternion[2], quaternion[3]),
            order,
            direction,
            self.unit("pose.position_unit", table, "length"),
            axes,
            body_axes,
            self.triple("pose.tracked_point_to_origin_m", table, (0.0, 0.0, 0.0)),
        )

    def wrench(self, table: dict[str, Any]) -> Wrench:
        known = ["force", "moment", "force_unit", "moment_unit", "axes", "sign", "point_m", "weight_n"]
        self.no_others("wrench.", table, known)
        sign = table.get("sign", 1)
        if sign not in (1, -1):
            raise self.fault("wrench.sign", "it is 1, or -1 where the cell states the reaction")
        force = self.names("wrench.force", table, 3, empty=True)
        moment = self.names("wrench.moment", table, 3, empty=True) if "moment" in table else ("", "", "")
        axes = self.axes("wrench.axes", table)
        # a component that was not measured stays one in our axes
        return Wrench(
            (force[0], force[1], force[2]),
            (moment[0], moment[1], moment[2]),
            self.unit("wrench.force_unit", table, "force"),
            self.unit("wrench.moment_unit", table, "moment"),
            axes,
            int(sign),
            self.triple("wrench.point_m", table, (0.0, 0.0, 0.0)),
            self.number("wrench.weight_n", table, 0.0, 0.0, 1e8),
        )

    def imu(self, table: dict[str, Any]) -> Imu:
        self.no_others("imu.", table, ["specific_force", "angular_velocity", "force_unit", "rate_unit", "axes"])
        force = self.names("imu.specific_force", table, 3)
        rate = self.names("imu.angular_velocity", table, 3) if "angular_velocity" in table else ("", "", "")
        return Imu(
            (force[0], force[1], force[2]),
            (rate[0], rate[1], rate[2]),
            self.unit("imu.force_unit", table, "acceleration"),
            self.unit("imu.rate_unit", table, "angular velocity"),
            self.axes("imu.axes", table),
        )

    def column(self, name: str, value: object) -> Column:
        at = f"columns.{name}"
        if name not in COLUMNS and name.rsplit("_", 1)[-1] not in WRENCH:
            raise self.fault(at, f"a trial has no such column: {', '.join(COLUMNS)}, or NAME_fx and so on")
        if isinstance(value, str):
            return Column(value, si_unit(quantity_of(name)))
        if not isinstance(value, dict):
            raise self.fault(at, 'it is the name of a channel, or { channel = "NAME", unit = "kN" }')
        self.no_others(at + ".", value, ["channel", "unit", "factor", "constant"])
        if ("channel" in value) == ("constant" in value):
            raise self.fault(at, "it has either a channel or a constant")
        if "constant" in value:
            return Column(constant=self.number(f"{at}.constant", value, None, -1e8, 1e8))
        return Column(
            self.text(f"{at}.channel", value),
            self.unit(f"{at}.unit", value, quantity_of(name)),
            self.number(f"{at}.factor", value, 1.0, -1e6, 1e6),
        )

    # values of a kind

    def no_others(self, prefix: str, table: dict[str, Any], known: list[str]) -> None:
        for key in table:
            if key not in known:
                raise self.fault(f"{prefix}{key}", f"there is no such field; there are: {', '.join(known)}")

    def table(self, key: str, table: dict[str, Any], prefix: str = "") -> dict[str, Any]:
        value = table.get(key, {})
        if not isinstance(value, dict):
            raise self.fault(prefix + key, f"it is a table: [{prefix}{key}]")
        return value

    def text(self, at: str, table: dict[str, Any], default: str | None = None) -> str:
        value = table.get(at.rsplit(".", 1)[-1], default)
        if not isinstance(value, str):
            raise self.fault(at, "it is missing or no text in quotes")
        return value

    def number(self, at: str, table: dict[str, Any], default: float | None, low: float, high: float) -> float:
        value = table.get(at.rsplit(".", 1)[-1], default)
        if not isinstance(value, int | float) or isinstance(value, bool) or math.isnan(value):
            raise self.fault(at, "it is missing or no number")
        if value != default and not low <= value <= high:
            raise self.fault(at, f"{value} must be between {low:g} and {high:g}")
        return float(value)

    def triple(self, at: str, table: dict[str, Any], default: Triple) -> Triple:
        value = table.get(at.rsplit(".", 1)[-1], list(default))
        ok = isinstance(value, list) and len(value) == 3 and all(isinstance(v, int | float) for v in value)
        if not ok or any(not abs(v) <= 100 for v in value):
            raise self.fault(at, "it is three numbers in meters: [x, y, z], forward, left, up")
        return (float(value[0]), float(value[1]), float(value[2]))

    def names(self, at: str, table: dict[str, Any], count: int, *, empty: bool = False) -> tuple[str, ...]:
        value = table.get(at.rsplit(".", 1)[-1])
        ok = isinstance(value, list) and len(value) == count and all(isinstance(v, str) for v in value)
        if not ok or (not all(value or [""]) and not empty) or not any(value or []):
            rest = '; "" is a component that was not measured' if empty else ""
            raise self.fault(at, f"it is a list of {count} names of channels{rest}")
        return tuple(value or [])

    def axes(self, at: str, table: dict[str, Any], default: Axes = PRESETS["z up"]) -> Axes:
        value = table.get(at.rsplit(".", 1)[-1], list(default))
        axes = parse_axes(value)
        if axes is None:
            raise self.fault(
                at, f'{value!r} are no axes: "z up", "y up", "NED", or the source of our x, y, z, as ["x", "-z", "y"]'
            )
        return axes

    def unit(self, at: str, table: dict[str, Any], quantity: str) -> str:
        value = self.text(at, table, si_unit(quantity))
        unit = canonical_unit(quantity, value)
        if unit is None:
            raise self.fault(at, f'"{value}" is no unit of {quantity}: {", ".join(UNITS[quantity])}')
        return unit
