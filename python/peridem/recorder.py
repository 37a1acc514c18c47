"""What a run leaves behind while it goes: vtu files, csv files, its last state."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .background import BackgroundWriter, Job
from .body_table import bodies_path, write_bodies
from .diagnostics import StopCriterion, TestWriter
from .diagnostics.fragments import fragments
from .diagnostics.network import contact_network, contacts_path, write_contacts
from .errors import InputError
from .output import OutputWriter, write_particle_locations
from .strain import StrainField

if TYPE_CHECKING:
    from .model import DEMModel

__all__ = ["Recorder"]

_ALWAYS_LAST = ("Displacement", "Velocity", "Force_Density", "Particle_ID", "Damage_Z")
"""Tags of the last state after a numerical failure, besides those of the deck."""


class Recorder:
    """Write the outputs of the deck's ``Output`` block and of its test while a run goes.

    The state is copied at the step of an output; the file is made of the copy in the background.

    Parameters
    ----------
    model : DEMModel
        The model, initialised.
    folder : Path or None
        Output folder; without it nothing is written, and only the stop criterion is watched.
    goes_on : bool
        Keep what an earlier part of the run has written up to the model's time.
    background : BackgroundWriter, optional
        Who writes the vtu and csv files of the outputs; by default `record` does. It has to be
        done with its jobs before this is closed.

    Attributes
    ----------
    stop_reason : str or None
        Why ``Output_Criteria`` ends the run; None as long as it does not.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """

    def __init__(
        self,
        model: DEMModel,
        folder: Path | None,
        *,
        goes_on: bool = False,
        background: BackgroundWriter | None = None,
    ) -> None:
        self.model = model
        self._background = background
        self.folder = folder
        self.stop_reason: str | None = None
        self._criterion = StopCriterion(model) if StopCriterion.serves(model) else None
        self._stack = ExitStack()
        self._writer: OutputWriter | None = None
        self._test: TestWriter | None = None
        self._strain: tuple[StrainField, OutputWriter] | None = None
        if folder is None:
            return
        if model.deck.output.perform_out:
            self._writer = self._stack.enter_context(self._open(folder, goes_on))
            write_bodies(bodies_path(self._writer.series), model)
            if "Strain_Stress" in model.deck.output.tags:
                field = StrainField(model)
                if len(field):
                    series = self._open(folder, goes_on, name="output_strain")
                    self._strain = field, self._stack.enter_context(series)
        if TestWriter.serves(model):
            self._test = TestWriter(folder, model, goes_on=goes_on)

    @property
    def intervals(self) -> list[int]:
        """Numbers of steps at whose multiples `record` has to be called."""
        interval = self.model.output_interval
        return [interval] if self._test is None else [interval, self._test.interval]

    def record(self) -> None:
        """Write what is due at the model's step, and look at the stop criterion.

        The criterion is looked at where a run goes on, too: one that it has stopped stays stopped.
        """
        n = self.model.n
        if self._test is not None and n % self._test.interval == 0:
            self._test.write(self.model)
        if n % self.model.output_interval:
            return
        if self._writer is not None:
            writer = self._writer
            if self._background is None:
                self._take(writer)()
            else:
                self._background.submit(lambda: self._take(writer))
        if self._criterion is not None and n > 0:
            reason = self._criterion.reason(self.model)
            if reason is not None and self._criterion.new_interval is None:
                self.stop_reason = reason
            elif reason is not None and self._criterion.new_interval is not None:
                self.model.output_interval = self._criterion.new_interval

    def record_end(self) -> None:
        """Write the last state of a run of a model made in Python, if `record` has not.

        Its number is that of the next output, which replaces it when the run goes on. Decks keep
        to the steps that they name.
        """
        model, writer = self.model, self._writer
        if writer is None or not model.scripted or model.n % model.output_interval == 0:
            return
        if self._background is None:
            self._take(writer, after=1)()
        else:
            self._background.submit(lambda: self._take(writer, after=1))

    def write_last(self) -> Path | None:
        """Write the present state as ``output_last.vtu``, outside the series.

        Returns
        -------
        Path or None
            The file; None without a folder or when it cannot be written.
        """
        if self.folder is None:
            return None
        if self._background is not None:
            self._background.settle()
        try:
            writer = self._writer or self._open(self.folder, True)
            tags = (*writer.tags, *_ALWAYS_LAST)
            arrays = {tag: make() for tag, make in self._arrays().items() if tag in tags}
            model = self.model
            return writer.write_last(model.n, model.time, arrays, points=model.state.x)
        except InputError:
            return None

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stack.close()

    def _open(self, folder: Path, goes_on: bool, *, name: str = "output") -> OutputWriter:
        settings = self.model.deck.output
        of_nodes = name == "output"
        return OutputWriter(
            folder,
            name=name,
            tags=[tag for tag in settings.tags if tag in self._arrays()] if of_nodes else (),
            interval=settings.output_interval,
            cells=self.model.cells if of_nodes else (),
            tag_pp=settings.tag_pp or None,
            fe_output=settings.perform_fe_out,
            compress=None if settings.compress_type == "none" else settings.compress_type,
            keep_until=self.model.time if goes_on else None,
        )

    def _take(self, writer: OutputWriter, after: int = 0) -> Job:
        """Copy what an output of the present step needs; the job writes its files.

        `after` is added to the number of the output.
        """
        model = self.model
        # Numbered by the shorter interval, so that numbers grow when New_Interval sets in.
        k = model.n // min(self.model.output_interval, writer.interval) + after
        n, time = model.n, model.time
        arrays = {tag: _own(make()) for tag, make in self._arrays().items() if tag in writer.tags}
        points = _own(model.state.x)
        jobs: list[Job] = [lambda: writer.write(k, n, time, arrays, points=points)]
        if self._strain is not None:
            jobs.append(self._take_strain(*self._strain, k))
        if "Particle_Locations" in model.deck.output.tags:
            stem = writer.path(k).stem.replace("output", "particle_locations")
            jobs.append(self._take_locations(writer.folder / f"{stem}.csv"))
        contacts = contacts_path(writer.path(k))
        if "Contact_Network" in model.deck.output.tags:
            network = contact_network(model)
            jobs.append(lambda: write_contacts(contacts, network))
        elif contacts.exists():  # of an earlier run, whose output is replaced
            jobs.insert(0, contacts.unlink)

        def write() -> None:
            for job in jobs:
                job()

        return write

    def _take_strain(self, field: StrainField, writer: OutputWriter, k: int) -> Job:
        n, time = self.model.n, self.model.time
        strain, stress = field.compute()
        values: dict[str, NDArray[Any]] = {
            "Strain": strain,
            "Stress": stress,
            "Particle_ID": field.particle_id,
        }
        points = _own(field.points())
        return lambda: writer.write(k, n, time, values, points=points)

    def _take_locations(self, path: Path) -> Job:
        bodies = self.model.particles
        zones = [body.zone for body in bodies]
        centres = np.array([body.center for body in bodies])
        radii = [body.bounding_radius for body in bodies]
        return lambda: write_particle_locations(path, zone=zones, centre=centres, radius=radii)

    def _arrays(self) -> dict[str, Callable[[], NDArray[Any]]]:
        """How the nodal array of each output tag is made."""
        s = self.model.state
        return {
            "Displacement": lambda: s.u,
            "Velocity": lambda: s.v,
            "Force_Density": lambda: s.f,
            "Force": lambda: s.f * s.volume[:, None],
            "Fixity": lambda: s.fixity.astype(np.int32),
            "Force_Fixity": lambda: s.force_fixity.astype(np.int32),
            "Particle_ID": lambda: s.particle_id,
            "Zone_ID": lambda: s.zone_id,
            "Nodal_Volume": lambda: s.volume,
            "Damage_Z": lambda: s.damage_z,
            "Damage": self.model.broken_fraction,
            "Theta": lambda: s.theta,
            "Fragment_ID": lambda: fragments(self.model).labels.astype(np.int32),
        }


def _own(values: NDArray[Any]) -> NDArray[Any]:
    """Return the values in memory that the next step does not touch."""
    return values if values.flags.owndata else values.copy()
