"""Axes, units, the order of quaternions and frozen channels, compared with what is known of the vehicle and the trial.

A finding names the check, the field, what is wrong and what to write. ``wrong`` stops the import unless the mapping
accepts the check; ``doubt`` does not; ``skipped`` says what is needed for the check.
"""

from .columns import check_columns
from .finding import CHECKS, Finding
from .frozen import check_clock, check_frozen
from .imu import check_imu
from .pose import check_pose

__all__ = ["CHECKS", "Finding", "check_clock", "check_columns", "check_frozen", "check_imu", "check_pose"]
