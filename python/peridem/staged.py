"""From plan to built model: when a model is built, its time step chosen, its deck written."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import astuple, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast, get_args

import numpy as np

from .background import BackgroundWriter
from .bodies import BodyPlan
from .build import BuiltModel, build_model
from .checkpoint import Checkpoint, has_checkpoint, newest_checkpoint
from .checks import check_model, time_step_notes
from .compatibility import compatibility_notes
from .deck import Deck, Output
from .deck.schema import Tag
from .duration import duration_until, exact_duration, interval_in_steps, steps_until
from .errors import InputError
from .files import path_of
from .mesh import Mesh
from .modelling.arguments import checked, choice, number, whole
from .modelling.bodies import Bodies, Body
from .modelling.export import check_sayable, spelled_out, write_deck
from .modelling.interactions import InteractionBuilder
from .modelling.plan import Composition, ModelPlan
from .restart import restart_from_deck, restore
from .view import ModelView

if TYPE_CHECKING:
    from .model import DEMModel

DECK_FOLDER = "deck"
"""Folder, in that of the output, of the deck that a model made in Python is written as."""

TAGS = ("Displacement", "Velocity", "Particle_ID", "Damage_Z", "Damage")
"""Arrays in the vtu files of a model made in Python, unless said otherwise."""

_OUTPUTS = 100  # files of a run whose interval is not given


class StagedModel(InteractionBuilder, ModelView):
    """A model that is built once it is asked for; see `DEMModel`."""

    _plan: ModelPlan | None
    _dt_wanted: float | None
    _safety: float

    _goes_on: bool
    _warned: set[str]

    @property
    def _whole(self) -> DEMModel:
        """The model, by the name under which others know it."""
        return cast("DEMModel", self)

    def _prepare(self, compatibility: str, threads: int, strict: bool, allow_overlap: bool) -> None:
        """Set what models of decks and of Python have in common."""
        self.compatibility = compatibility
        self.warnings: list[str] = []
        self.notes: list[str] = []
        self._warned: set[str] = set()
        self.stop_reason: str | None = None
        self.output_interval = 1
        self.checkpoint_every: int | None = None
        self.last_checkpoint: Path | None = None
        self.recorded = ""
        self._composition: Composition | None = None
        self._built: BuiltModel | None = None
        self._deck: Deck | None = None
        self._names: dict[str, Body | Bodies] = {}
        self._core_bodies: list[Any] = []
        self._thread_count = threads
        self._strict = strict
        self._allow_overlap = allow_overlap
        self._initialized = False
        self._duration_known = False
        self._every_wanted: float | None = None
        self._time_step_from = "the deck"
        self._output_seconds = 0.0
        self._background = BackgroundWriter()
        self._stable_time_step = None
        self._restarts = False
        self._goes_on = False
        self._tracks_energy = False

    def _note_warnings(self, texts: Sequence[str]) -> None:
        """Add warnings of a run, in place of those of the same kind of an earlier part of it."""
        kinds = {text.partition(" ")[0] for text in texts}
        self.warnings = [one for one in self.warnings if one.partition(" ")[0] not in kinds]
        self.warnings += texts

    def _take(self, deck: Deck, built: BuiltModel) -> None:
        self._deck, self._built = deck, built
        self._core_bodies = built.core.particles  # a new list of all bodies with every look
        built.core.track_energy = self._tracks_energy
        self.warnings += built.warnings
        self.notes += deck.notes
        # Where the deck says itself that defects are corrected there is nothing to tell.
        asked = "compatibility" in deck.model.model_fields_set
        if self.compatibility == "original" or not (self.scripted or asked):
            self.notes += compatibility_notes(deck, built.bodies, self.compatibility)
        self.output_interval = deck.output.output_interval

    def _parts(self) -> BuiltModel:
        """Return the built model; models made in Python are built when they are first asked."""
        if self._built is None:
            assert self._plan is not None
            output = Output.model_validate({"Tags": list(TAGS), "Output_Interval": 1})
            composition = self._plan.compose(1.0, 1, output)
            try:
                built = build_model(
                    composition.deck, threads=self._thread_count, held=composition.held
                )
            except InputError as error:
                raise InputError(composition.words.say(str(error))) from None
            self._composition = composition
            self.warnings += composition.warnings
            for body in composition.layout.order:
                body._layout = composition.layout
            self._take(composition.deck, built)
            self._put_in_words()
        return self._built  # type: ignore[return-value]

    def _put_in_words(self) -> None:
        if self._composition is not None:
            say = self._composition.words.say
            # Several sets of the deck can be one load of the model, with the same to say.
            self.warnings = list(dict.fromkeys(say(text) for text in self.warnings))
            self.notes = list(dict.fromkeys(say(text) for text in self.notes))

    @property
    def track_energy(self) -> bool:
        """Whether every step keeps accounts of works and dissipations; see `diagnostics.energies`.

        Off at first, where it costs nothing; ``record=["energy"]`` switches it on. Accounts begin
        with the first forces, or at the present state of a model that has started, and anew when
        switched off and on. They go into checkpoints and go on from them.
        """
        return self._tracks_energy if self._built is None else bool(self._core.track_energy)

    @track_energy.setter
    def track_energy(self, on: bool) -> None:
        self._tracks_energy = bool(on)
        if self._built is not None:
            self._core.track_energy = bool(on)

    @property
    def scripted(self) -> bool:
        """Whether the model was made in Python, not read from a deck."""
        return self._plan is not None

    @property
    def deck(self) -> Deck:
        """The blocks of its deck, read or made."""
        self._parts()
        assert self._deck is not None
        return self._deck

    @property
    def bodies(self) -> list[BodyPlan]:
        """Where the bodies are from, by their ids."""
        return self._parts().bodies

    @property
    def _core(self) -> Any:
        return self._parts().core

    @property
    def _bodies(self) -> list[Any]:
        self._parts()
        return self._core_bodies

    @property
    def _meshes(self) -> list[Mesh]:
        return self._parts().meshes

    def init(self) -> None:
        """Build bonds, laws and contact, check the model, set a ``Restart`` state; done once.

        Nothing can be added to the model afterwards.

        Raises
        ------
        InputError
            If bodies overlap at the start (unless allowed), a test names a body that does not
            exist or, when strict, the time step is above the estimated stable one.
        """
        self._initialize(None, None)

    def _initialize(self, until: float | None, steps: int | None) -> None:
        if self._initialized:
            if until is not None or steps is not None:
                self._fix_duration(until, steps)
            return
        core = self._core
        try:
            core.init()
        except InputError as error:
            raise InputError(self._say(f"{self.deck.path.name}: {error}")) from None
        self._initialized = True
        try:
            self._fix_duration(until, steps)
            self.warnings += check_model(
                self._whole, strict=self._strict, allow_overlap=self._allow_overlap
            )
        except InputError as error:
            self._initialized = False
            raise InputError(self._say(str(error))) from None
        self.notes += time_step_notes(self._whole)
        self._put_in_words()
        if self._restarts:
            self._restarts, self._goes_on = False, True
            restart_from_deck(self._whole)

    def _say(self, text: str) -> str:
        return text if self._composition is None else self._composition.words.say(text)

    def _fix_duration(self, until: float | None, steps: int | None) -> None:
        """Choose the time step of a model made in Python, before its first step."""
        if not self.scripted or self.started or (until is None and self._duration_known):
            return
        if until is not None and steps is not None:
            if self._dt_wanted is not None:
                raise InputError(
                    f"run: steps = {steps}: is given besides until and dt; keep two of them"
                )
            self._time_step_from = "until / steps"
            self._set_duration(until, steps)
            return
        dt = self._wanted_time_step()
        if until is not None:
            every = self._every_wanted if self._dt_wanted is None else None
            self._set_duration(*duration_until(until, dt, every))
        elif steps is not None:
            self._set_duration(*duration_until(dt * max(steps, 1), dt))
        else:
            self._set_duration(dt, 1)
            self._duration_known = False

    def _wanted_time_step(self) -> float:
        if self._dt_wanted is not None:
            self._time_step_from = "given"
            return self._dt_wanted
        limits = astuple(self.stable_time_step())
        limit = min(value for value in limits if value > 0)
        if not np.isfinite(limit) and all(body.constrained for body in self.particles):
            raise InputError(
                "DEMModel: dt: missing; there is no stable time step to estimate because no body "
                "can move: all are walls or fixed; let one move (fixed=False), or give dt"
            )
        if not np.isfinite(limit):
            raise InputError(
                "DEMModel: dt: missing; no stable time step can be estimated without bonds and "
                "contact: give it"
            )
        self._time_step_from = f"{self._safety:g} of the estimated stable one, {limit:.3g} s"
        return self._safety * float(limit)

    def _set_duration(self, final_time: float, steps: int) -> None:
        self._core.set_duration(final_time, steps)
        self._note_duration(final_time, steps)

    def _note_duration(self, final_time: float, steps: int) -> None:
        """Let the deck say how long the run is."""
        deck = self.deck
        model = deck.model.model_copy(update={"final_time": final_time, "time_steps": steps})
        deck.source.data["Model"] |= {"Final_Time": final_time, "Time_Steps": steps}
        self._deck = replace(deck, model=model)
        self._duration_known = True

    def _go_on(self, checkpoint: Checkpoint, problems: list[str], **options: bool) -> None:
        restore(self._whole, checkpoint, **options)
        self._goes_on = True
        self.warnings += problems
        self.checkpoint_every, self.last_checkpoint = checkpoint.every, checkpoint.path
        self.recorded = checkpoint.recorded

    def _last_step(self, until: float | None, steps: int | None) -> int:
        """Fix the duration and return the step to stop after."""
        if not self.scripted and until is not None and steps is not None:
            raise InputError(f"steps = {steps}: is given besides until; keep one of them")
        if until is None and steps is None and self.scripted and not self._duration_known:
            raise InputError("run: until: missing; give the time to stop at in s, or steps")
        if self.started and until is not None and steps is not None:
            raise InputError(
                f"run: steps = {steps}: is given besides until, but the time step is chosen "
                "already; keep one of them"
            )
        fresh = not self.started
        self._initialize(until, steps)
        if until is not None:
            last = self.n_steps if fresh and self.scripted else steps_until(until, self.dt)
        else:
            last = self.n_steps if steps is None else self.n + steps
        if self.scripted and last > self.n_steps:
            self._note_duration(*exact_duration(self.dt, last))
        return last

    def _resumed(self, folder: Path | None, until: float | None, steps: int | None) -> int:
        """Go on from the newest checkpoint of a folder and return the step to stop after."""
        if folder is None:
            raise InputError("run: resume = True: needs the folder of the checkpoints; give output")
        if self._built is not None and self.started:
            raise InputError("run: resume = True: the model has started already; make a new one")
        if not has_checkpoint(folder):
            return self._last_step(until, steps)
        checkpoint, problems = newest_checkpoint(folder)
        self._restarts = False  # a Restart block has had its effect
        if self.scripted:
            self._initialize(until, steps)
            # The time step of the run so far, to the last bit, whatever the end is now.
            if not 0.5 * self.dt < checkpoint.dt <= self.dt * (1 + 1e-6):
                self._check_time_step(checkpoint, until, steps)
            if until is not None:
                last = max(steps_until(until, checkpoint.dt), checkpoint.step)
            else:
                last = checkpoint.step + (steps or 0)
            final_time, n = exact_duration(checkpoint.dt, last)
            self._core.set_duration(final_time, n)
            self._note_duration(final_time, n)
            self._go_on(checkpoint, problems, changed_deck=True)
            return last
        self._go_on(checkpoint, problems)
        return self._last_step(until, steps)

    def _check_time_step(
        self, checkpoint: Checkpoint, until: float | None, steps: int | None
    ) -> None:
        raise InputError(
            f"{checkpoint.path}: time step = {checkpoint.dt!r} s: the model's is {self.dt!r} s: "
            "it is of a model with other mesh sizes, materials, contact or dt; make the model as "
            "it was, or give another output folder"
        )

    def _plan_output(
        self, folder: Path | None, every: float | None, tags: Sequence[str] | None
    ) -> None:
        """Let the deck say what is written, where and how often."""
        changes: dict[str, Any] = {}
        if every is not None:
            changes["output_interval"] = interval_in_steps("every", every, self.dt)
        elif self.scripted and not self._goes_on:
            changes["output_interval"] = max(1, self.n_steps // _OUTPUTS)
        if tags is not None:
            changes["tags"] = _checked_tags(tags)
        if changes:
            output = self.deck.output.model_copy(update=changes)
            self._deck = replace(self.deck, output=output)
            self.output_interval = output.output_interval
        if folder is not None and self.scripted:
            self._write_own_deck(folder)

    def _write_own_deck(self, folder: Path) -> None:
        """Write the model as a deck into its output folder, for `resume`, if a deck can say it."""
        composition = self._composition
        assert composition is not None
        try:
            check_sayable(self.deck, composition.held)
        except InputError:
            return
        output = self.deck.output.model_copy(update={"path": Path("..")})
        path = write_deck(
            replace(self.deck, output=output), composition.held, folder / DECK_FOLDER
        ).resolve()
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        self._deck = replace(self.deck, path=path, sha256=digest)

    @checked
    def to_deck(
        self,
        folder: str | os.PathLike[str],
        *,
        until: float | None = None,
        steps: int | None = None,
    ) -> Path:
        """Write the model as a deck of the original's format that gives the same run, bit for bit.

        Parameters
        ----------
        folder : path-like
            Gets input.yaml, the meshes and particle_locations.csv; created when missing.
        until, steps : float, int, optional
            Duration as in `run`; that of the last run when left out.

        Returns
        -------
        Path
            The file input.yaml, for `DEMModel.from_deck` and ``peridem run``.

        Raises
        ------
        InputError
            If a deck has no words for something (a Python function, chosen nodes), the model is
            of a deck already, its duration is unknown, or a file cannot be written.
        """
        composition = self._composed(until, steps)
        return write_deck(
            self._deck_to_write(), composition.held, path_of(folder, "to_deck: folder")
        )

    def _deck_to_write(self) -> Deck:
        first: dict[int, int] = {}
        for body in self._bodies:
            first.setdefault(body.zone, body.id)

        def stiffness(i: int, j: int) -> float:
            return float(self._core.contact_law(first[i], first[j])["kn"])

        x = self.state.x_ref
        return spelled_out(self.deck, stiffness, np.array([x.min(axis=0), x.max(axis=0)]))

    def _composed(self, until: float | None, steps: int | None) -> Composition:
        if self._plan is None:
            raise InputError(
                f"to_deck: the model is that of {self.deck.path}; copy the files of the deck"
            )
        if until is not None or steps is not None:
            end = None if until is None else number(until, "to_deck: until", above=0, unit="s")
            self._last_step(end, None if steps is None else whole(steps, "to_deck: steps", 1))
        elif not self._duration_known:
            raise InputError(
                "to_deck: until: missing; give the time to stop at in s, or call run before"
            )
        assert self._composition is not None
        return self._composition


def _checked_tags(tags: Any) -> tuple[str, ...]:

    given = [tags] if isinstance(tags, str) else list(tags)
    for tag in given:
        choice(tag, get_args(Tag), "tags")
    return tuple(dict.fromkeys(given))
