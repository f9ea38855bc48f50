"""Forces for tables of states in Parquet, by actors of Ray Data that ask wade servers."""

from .forces import Forces
from .tables import Progress, RowsLost, predict

__all__ = ["Forces", "Progress", "RowsLost", "predict"]
