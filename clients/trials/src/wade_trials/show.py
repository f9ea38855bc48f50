"""The mapping and the findings as tables for a terminal."""

from collections.abc import Sequence

from .axes import PRESETS, axes_text
from .checks import Finding
from .mapping import WRENCH, Mapping


def table(rows: Sequence[tuple[str, ...]], header: tuple[str, ...]) -> str:
    """Columns of text, each as wide as its widest cell."""
    widths = [max(len(row[at]) for row in [header, *rows]) for at in range(len(header))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in [header, *rows]]
    return "\n".join(line.rstrip() for line in lines)


def together(names: Sequence[str]) -> str:
    """Names with what they share written once: ``/cell/wrench.force.{x, y, z}``."""
    shown = [name or "(none)" for name in names]
    prefixes = {name[: max(name.rfind("."), name.rfind("/")) + 1] for name in shown}
    shared = prefixes.pop() if len(prefixes) == 1 else ""
    rest = ", ".join(name[len(shared) :] for name in shown)
    return f"{shared}{{{rest}}}" if shared else rest


def mapping_table(mapping: Mapping) -> str:
    """Which channel becomes which column, with units and axes; guesses have a number that a line below explains."""
    rows: list[tuple[str, ...]] = []
    reasons: list[str] = []

    def basis(*fields: str) -> str:
        numbers = []
        for field in fields:
            if field in mapping.guesses:
                reason = f"{field}: {mapping.guesses[field]}"
                # the fields of columns are guessed for one reason
                reason = mapping.guesses[field] if field.startswith("columns.") else reason
                if reason not in reasons:
                    reasons.append(reason)
                numbers.append(str(reasons.index(reason) + 1))
        return f"guess {', '.join(numbers)}" if numbers else "stated"

    def axis(axes: tuple[str, str, str]) -> str:
        name = next((name for name, preset in PRESETS.items() if preset == axes), "")
        return name or axes_text(axes)

    if mapping.pose:
        pose = mapping.pose
        fields = basis("pose.position", "pose.position_unit", "pose.axes")
        rows.append((together(pose.position), "vx vy vz, depth", pose.position_unit, axis(pose.axes), fields))
        turn = f"{axis(pose.body_axes)}, {' '.join(pose.quaternion_order)}"
        turn += ", conjugate" if pose.is_conjugate else ""
        fields = basis("pose.quaternion_order", "pose.quaternion_direction", "pose.body_axes", "pose.quaternion")
        rows.append((together(pose.quaternion), "wx wy wz, roll pitch yaw", "1", turn, fields))
        arm = "({}, {}, {}) m to the body origin".format(*pose.tracked_point_to_origin_m)
        rows.append(("(tracked point)", "vx vy vz, depth", "m", arm, basis("pose.tracked_point_to_origin_m")))
    if mapping.wrench:
        wrench = mapping.wrench
        how = axis(wrench.axes) + ("" if wrench.sign == 1 else ", reversed")
        for group, at, unit in ((wrench.force, 0, wrench.force_unit), (wrench.moment, 3, wrench.moment_unit)):
            if any(group):
                columns = " ".join(WRENCH[at : at + 3])
                shown = together(group)
                fields = basis("wrench.axes", "wrench.force_unit", "wrench.force", "wrench.sign")
                fields = (
                    fields if at == 0 else basis("wrench.axes", "wrench.moment_unit", "wrench.sign", "wrench.point_m")
                )
                rows.append((shown, columns, unit, how, fields))
    if mapping.imu:
        imu = mapping.imu
        rows.append((together(imu.specific_force), "(check)", imu.force_unit, axis(imu.axes), basis("imu.axes")))
        if any(imu.angular_velocity):
            shown = together(imu.angular_velocity)
            rows.append((shown, "(check)", imu.rate_unit, axis(imu.axes), basis("imu.rate_unit", "imu.axes")))
    for name, column in mapping.columns.items():
        source = column.channel if column.constant is None else f"constant {column.constant:g}"
        unit = column.unit + ("" if column.factor == 1 else f" x {column.factor:g}")
        rows.append((source, name, unit, "", basis(f"columns.{name}")))
    notes = [f"guess {at + 1}: {reason}" for at, reason in enumerate(reasons)]
    return "\n".join([table(rows, ("channel", "column", "unit", "axes", "basis")), *notes])


def findings_table(findings: list[Finding]) -> str:
    """One row a check and trial."""
    rows = [(f.trial, f.check, f.level, f.message) for f in findings if f.level in ("ok", "skipped")]
    return table(rows, ("trial", "check", "result", "")) if rows else ""
