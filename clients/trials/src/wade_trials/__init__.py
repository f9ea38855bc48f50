"""Imports recordings as a folder of trials for ``wade gap`` and ``wade validate``.

Reading order: ``source`` (channels of a file), ``readers`` (one module a format), ``mapping`` (which channel becomes
which column), ``guess`` (a first mapping), ``motion`` (the processing), ``checks`` (axes, units and frozen channels),
``run`` (the import), ``cli``.
"""

from .checks import Finding
from .errors import TrialsError
from .mapping import Mapping
from .run import Result, import_trials

__version__ = "0.2.0"
__all__ = ["Finding", "Mapping", "Result", "TrialsError", "import_trials"]
