"""What is watched during a run: the csv of the tests, the criterion that stops a run."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError, NumericalError
from ..files import cannot_write, make_folder, replace_file

if TYPE_CHECKING:
    from ..model import DEMModel

__all__ = ["StopCriterion", "TestWriter", "check_finite", "compressive_row", "two_particle_row"]

TWO_PARTICLE = ("step", "t", "distance", "penetration", "max_distance", "contact_force")
COMPRESSIVE = (
    *("step", "t", "wall_displacement", "penetration"),
    *("contact_force", "gravity_force", "total_force"),
)
_UNITS = {"step": "", "t": "s"}


def two_particle_row(model: DEMModel, farthest: float) -> list[float]:
    """Row of the test ``two_particle``: body 1 strikes body 0.

    Parameters
    ----------
    model : DEMModel
        The model.
    farthest : float
        ``max_distance`` of the row before, NaN before the bodies have touched.

    Returns
    -------
    list of float
        `TWO_PARTICLE` but for the step: time [s]; distance [m] of the centres; penetration
        Rc - (distance - R0 - R1) [m], R the bounding radii, negative before contact; largest
        distance [m] of the centres since the bodies first touched, from which restitution
        follows, NaN before; contact and damping force [N, N/m in 2D] on body 1 away from body 0.
    """
    below, above = model.particle(0), model.particle(1)
    line = above.center - below.center
    distance = float(np.linalg.norm(line))
    forces = model.contact_forces()[above.start : above.stop]
    volumes = model.state.volume[above.start : above.stop]
    # (line / distance) is without direction when the centres coincide
    force = float(volumes @ (forces @ line)) / distance if distance > 0 else math.nan
    gap = distance - below.bounding_radius - above.bounding_radius
    if forces.any() or not math.isnan(farthest):
        farthest = max(distance, farthest) if not math.isnan(farthest) else distance
    return [model.time, distance, model.contact_radius(0, 1) - gap, farthest, force]


def compressive_row(model: DEMModel, sense: float = 0.0) -> list[float]:
    """Row of the test ``compressive_test``: motion and load of a wall in one direction.

    Parameters
    ----------
    model : DEMModel
        The model.
    sense : float
        The sign of the direction in which the wall moved first, 0 before it has moved: its
        present displacement has it then.

    Returns
    -------
    list of float
        `COMPRESSIVE` but for the step: time [s]; displacement [m] of the wall's centre, with its
        sign; penetration [m], the same counted positive in the direction in which the wall moved
        first, so that a wall that presses down has a negative displacement and a positive
        penetration; forces [N, N/m in 2D] on the wall, summed over its nodes: contact and
        damping, gravity, and all together (prescribed forces too). Displacement and forces are
        components along ``Particle_Force_Direction``.
    """
    test = model.deck.compressive_test
    assert test is not None  # the schema wants it
    wall, d = model.particle(test.particle_id), test.particle_force_direction - 1
    nodes = slice(wall.start, wall.stop)
    state, volumes = model.state, model.state.volume[nodes]
    displacement = float(wall.center[d] - model.start_center(wall.id)[d])
    return [
        model.time,
        displacement,
        displacement * sense if sense else abs(displacement),
        float(volumes @ model.contact_forces()[nodes, d]),
        float(volumes @ state.density[nodes]) * model.deck.gravity[d],
        float(volumes @ state.f[nodes, d]),
    ]


class TestWriter:
    """Write ``pp_<test>_<tag>.csv``, a line at a time.

    Every line is flushed to the system before the next step, so that a crash of the program
    loses none.

    Parameters
    ----------
    folder : Path
        Output folder; created when missing.
    model : DEMModel
        The model, of a deck whose ``Test_Name`` is two_particle or compressive_test.
    goes_on : bool
        Keep the lines before the model's step, which a resumed run goes on from; otherwise the
        file starts anew.

    Attributes
    ----------
    path : Path
        The file.
    interval : int
        Steps between lines.

    Raises
    ------
    InputError
        If the file cannot be written.
    """

    __test__ = False  # not a test of pytest

    def __init__(self, folder: Path, model: DEMModel, *, goes_on: bool = False) -> None:
        output = model.deck.output
        name, tag = model.deck.test_name, output.tag_pp
        self.path = folder / (f"pp_{name}_{tag}.csv" if tag else f"pp_{name}.csv")
        self.interval = output.test_output_interval or output.output_interval
        self._pair = name == "two_particle"
        self._farthest = math.nan
        self._sense = 0.0
        make_folder(folder)
        columns = TWO_PARTICLE if self._pair else COMPRESSIVE
        header = ",".join(_titled(column, model.dimension) for column in columns)
        kept = _lines_before(self.path, header, model.n) if goes_on else []
        if kept and self._pair:
            self._farthest = float(kept[-1].split(",")[columns.index("max_distance")])
        elif kept:
            moved = (float(line.split(",")[columns.index("wall_displacement")]) for line in kept)
            self._sense = next((math.copysign(1, d) for d in moved if d), 0.0)
        with replace_file(self.path) as temporary:
            temporary.write_text("\n".join([header, *kept, ""]), encoding="ascii")

    @staticmethod
    def serves(model: DEMModel) -> bool:
        """Whether the deck's test has a csv."""
        return model.deck.test_name in ("two_particle", "compressive_test")

    def write(self, model: DEMModel) -> None:
        """Write the line of the model's present state."""
        if self._pair:
            row = two_particle_row(model, self._farthest)
            self._farthest = row[TWO_PARTICLE.index("max_distance") - 1]
        else:
            row = compressive_row(model, self._sense)
            moved = row[COMPRESSIVE.index("wall_displacement") - 1]
            self._sense = self._sense or (math.copysign(1, moved) if moved else 0.0)
        line = ",".join([str(model.n), *(repr(value) for value in row)])
        try:
            # One write to a file without buffer: the line is the system's when it returns.
            with self.path.open("ab", buffering=0) as file:
                _write_all(file.fileno(), f"{line}\n".encode("ascii"))
        except OSError as error:
            raise InputError(cannot_write(self.path, error.strerror or str(error))) from error


def _write_all(descriptor: int, data: bytes) -> None:
    while data:
        data = data[os.write(descriptor, data) :]


def _titled(column: str, dimension: int) -> str:
    """Name of a column with its unit."""
    force = "N" if dimension == 3 else "N/m"
    unit = _UNITS.get(column, force if column.endswith("force") else "m")
    return f"{column} [{unit}]" if unit else column


def _lines_before(path: Path, header: str, step: int) -> list[str]:
    """Whole lines of an existing file before a step; none when it is of another kind."""
    try:
        text = path.read_text(encoding="ascii")
    except (OSError, UnicodeDecodeError):
        return []
    lines = text.split("\n")[:-1]  # what follows the last line end was cut off by a crash
    if not lines or lines[0] != header:
        return []
    kept: list[str] = []
    last = -1
    for line in lines[1:]:
        found = _step_of(line, header.count(",") + 1)
        if found is None or not last < found < step:
            break
        kept.append(line)
        last = found
    return kept


def _step_of(line: str, columns: int) -> int | None:
    values: Sequence[str] = line.split(",")
    try:
        numbers = [float(value) for value in values]
        return int(values[0]) if len(numbers) == columns else None
    except ValueError:
        return None


def check_finite(model: DEMModel) -> None:
    """Check that positions, velocities and forces of all nodes are finite numbers.

    The core looks at velocities when it makes them; the forces of the last step, which no
    velocity has taken up yet, are seen only here.

    Raises
    ------
    NumericalError
        If one is not, naming step, body and node.
    """
    state = model.state
    for what, values in (
        ("position", state.x),
        ("velocity", state.v),
        ("force density", state.f),
    ):
        if np.isfinite(values).all():
            continue
        node = int(np.argmin(np.isfinite(values).all(axis=1)))
        body = model.particle(int(state.particle_id[node]))
        numbers = ", ".join(f"{value:g}" for value in values[node])
        raise NumericalError(
            f"step {model.n} (t = {model.time:g} s): body {body.id}, node {node - body.start}: "
            f"{what} = ({numbers}): must be finite; use a smaller time step (dt = {model.dt:g} s), "
            "or check loads, stiffnesses and overlapping bodies"
        )


class StopCriterion:
    """``Output.Output_Criteria``: ends a run early, or changes the interval of the outputs.

    It is looked at with every output. Without ``New_Interval`` the run stops when it is met;
    with ``New_Interval`` the run goes on, and from then on that is the interval of the outputs.

    Parameters
    ----------
    model : DEMModel
        The model, of a deck with ``Output_Criteria``.

    Attributes
    ----------
    new_interval : int or None
        Steps between outputs once the criterion is met; None stops the run.
    """

    def __init__(self, model: DEMModel) -> None:
        criteria = model.deck.output.output_criteria
        assert criteria is not None
        self.new_interval = criteria.new_interval
        self._limit = criteria.parameters[0]
        self._of_centers = criteria.type == "max_particle_dist"

    @staticmethod
    def serves(model: DEMModel) -> bool:
        """Whether the deck has a criterion that can be met."""
        criteria = model.deck.output.output_criteria
        if criteria is None:
            return False
        return criteria.type == "max_node_dist" or model.deck.test_name == "two_particle"

    def reason(self, model: DEMModel) -> str | None:
        """Say why the criterion is met; None when it is not."""
        if self._of_centers:
            below, above = model.particle(0), model.particle(1)
            distance = float(np.linalg.norm(above.center - below.center))
            what = "the centres of bodies 0 and 1 are"
            limit = f"{self._limit:g} m apart"
        else:
            squared = np.einsum("ij,ij->i", model.state.x, model.state.x)
            node = int(squared.argmax())
            distance = float(np.sqrt(squared[node]))
            body = model.particle(int(model.state.particle_id[node]))
            what = f"node {node - body.start} of body {body.id} is"
            limit = f"{self._limit:g} m from the origin"
        if not distance > self._limit:
            return None
        return f"Output_Criteria: {what} {distance:.6g} m, more than {limit}"
