"""Axes of recordings, turned into x forward or east, y left or north, z up."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Axes = tuple[str, str, str]

#: For each of our axes the axis of the recording. The names are those of a world frame and of a body frame alike.
PRESETS: dict[str, Axes] = {
    "z up": ("x", "y", "z"),
    "y up": ("x", "-z", "y"),
    "NED": ("x", "-y", "-z"),
}
#: Right-handed axes with another axis up, beside the presets.
SINGLE_TURNS: list[Axes] = [("y", "z", "x"), ("z", "y", "-x"), ("x", "z", "-y"), ("-x", "-y", "z")]
#: Other names of the presets, in lower case.
ALIASES = {"z up": "z up", "flu": "z up", "enu": "z up", "y up": "y up", "ned": "NED", "frd": "NED"}

#: What a preset is, for messages.
MEANING = {
    "z up": "z up",
    "y up": "y up, the default of OptiTrack's export",
    "NED": "NED: north, east, down, with a body frame forward, right, down",
}


def parse_axes(value: object) -> Axes | None:
    """Axes from a name or from three signed letters; ``None`` where they are neither."""
    if isinstance(value, str):
        name = ALIASES.get(value.strip().lower())
        return PRESETS[name] if name else None
    if not isinstance(value, list | tuple) or len(value) != 3:
        return None
    letters = [str(axis).strip().lower().removeprefix("+") for axis in value]
    if sorted(axis.removeprefix("-") for axis in letters) != ["x", "y", "z"]:
        return None
    return (letters[0], letters[1], letters[2])


def axes_text(axes: Axes) -> str:
    """Axes as a mapping states them: a name where there is one."""
    for name, preset in PRESETS.items():
        if preset == axes:
            return f'"{name}"'
    return "[" + ", ".join(f'"{axis}"' for axis in axes) + "]"


def matrix(axes: Axes) -> Array:
    """The matrix that turns a vector of the recording into our axes."""
    out = np.zeros((3, 3))
    for row, axis in enumerate(axes):
        out[row, "xyz".index(axis[-1])] = -1.0 if axis.startswith("-") else 1.0
    return out


def is_left_handed(axes: Axes) -> bool:
    """True where one axis, or all three, are mirrored."""
    return bool(np.linalg.det(matrix(axes)) < 0)


def opposite(axis: str) -> str:
    """The other direction of a signed axis."""
    return axis[1:] if axis.startswith("-") else "-" + axis


def turned_about_up(axes: Axes, quarters: int) -> Axes:
    """Body axes of a tracked body that was turned about its up axis by quarters of a turn."""
    x, y, z = axes
    return [(x, y, z), (y, opposite(x), z), (opposite(x), opposite(y), z), (opposite(y), x, z)][quarters]


def rotations(quaternion: Array) -> Array:
    """Rotation matrices of quaternions ``[n, 4]`` in the order w x y z, of any length but 0."""
    w, x, y, z = (quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)).T
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], axis=-1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], axis=-1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=-1),
        ],
        axis=1,
    )


def quaternions(rotation: Array) -> Array:
    """Quaternions w x y z of rotation matrices ``[n, 3, 3]``, by the largest of the four components."""
    m = rotation
    trace = m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2]
    # squares of the components, times four
    squares = np.stack([1 + trace] + [1 + 2 * m[:, i, i] - trace for i in range(3)], axis=1)
    largest = np.argmax(squares, axis=1)
    root = 2 * np.sqrt(np.maximum(np.max(squares, axis=1), 1e-12))
    pairs = np.empty((len(m), 4, 4))
    for i in range(4):
        pairs[:, i, i] = squares[:, i]
    sums = {(1, 2): (0, 1), (1, 3): (0, 2), (2, 3): (1, 2)}
    for (a, b), (i, j) in sums.items():
        pairs[:, a, b] = pairs[:, b, a] = m[:, j, i] + m[:, i, j]
    for a, (i, j) in {1: (2, 1), 2: (0, 2), 3: (1, 0)}.items():
        pairs[:, 0, a] = pairs[:, a, 0] = m[:, i, j] - m[:, j, i]
    rows = np.arange(len(m))
    return np.asarray(pairs[rows, largest] / root[:, None])


def turned(position: Array, quaternion: Array, axes: Axes, body_axes: Axes) -> tuple[Array, Array]:
    """Positions and quaternions (w x y z) of a recording in our world and body axes."""
    world, body = matrix(axes), matrix(body_axes)
    if axes == PRESETS["z up"] and body_axes == PRESETS["z up"]:
        return position, quaternion
    return position @ world.T, quaternions(world @ rotations(quaternion) @ body.T)
