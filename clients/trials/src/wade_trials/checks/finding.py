"""What a check found."""

from dataclasses import dataclass
from typing import Literal

#: The checks that a mapping may accept.
CHECKS = (
    *("frozen", "depth", "upright", "motion", "speed", "jump", "direction", "lift", "gravity", "rates", "angles"),
    "wheels",
)
Level = Literal["ok", "doubt", "wrong", "skipped"]


@dataclass(frozen=True)
class Finding:
    """What a check found in a trial."""

    check: str
    level: Level
    trial: str
    #: Field of the mapping.
    field: str
    message: str
    #: What corrects it, in the words of the mapping; empty where nothing does.
    write: str = ""

    def __str__(self) -> str:
        way_out = f": write {self.write}" if self.write else ""
        return f"{self.trial}: {self.field}: {self.message}{way_out}"
