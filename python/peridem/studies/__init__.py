"""Studies: a function run for many sets of parameters, over processes, with a table of results."""

from .run import study
from .sampling import sample
from .table import StudyWarning

__all__ = ["StudyWarning", "sample", "study"]
