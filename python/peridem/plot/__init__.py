"""Pictures: states coloured by a field, force chains, time series, animations, notebooks.

`render` draws the outputs of a run, a model or a result; `plot_series` what a run has recorded.
Matplotlib draws without a display and without its global state; PyVista draws 3D where it can.
"""

from .chains import Chains, make_chains
from .fields import FIELDS, Field
from .outputs import Frame, Outputs
from .render import RenderWarning, render
from .snapshot import Snapshot
from .timelines import plot_series

__all__ = [
    "FIELDS",
    "Chains",
    "Field",
    "Frame",
    "Outputs",
    "RenderWarning",
    "Snapshot",
    "make_chains",
    "plot_series",
    "render",
]
