"""The modelling functions of a model: bodies, contact, loads."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..deck import Deck
from ..errors import InputError
from ..materials import Material
from ..mesh import Mesh
from .arguments import checked, did_you_mean, number, show_value, vector, vectors
from .bodies import Bodies, Body, Form, MeshableShape
from .contact import make_rule
from .export import write_deck
from .loads import (
    Target,
    force_parts,
    motion_parts,
    parse_directions,
    parse_nodes,
    parse_region,
    parse_space,
    rotation_part,
)
from .plan import Composition, ModelPlan
from .sources import rows_of

Matches = Callable[[Body], bool]


class ModelBuilder:
    """What `DEMModel` can be told before its first step; see there."""

    _plan: ModelPlan | None
    _composition: Composition | None
    _names: dict[str, Body | Bodies]

    # Bodies.

    @checked
    def add_particle(
        self,
        shape: MeshableShape | None = None,
        *,
        material: Material,
        at: Sequence[float] = (0.0, 0.0, 0.0),
        mesh_size: float | None = None,
        mesh: Mesh | None = None,
        angle: float = 0.0,
        axis: Sequence[float] | None = None,
        scale: float = 1.0,
        velocity: Sequence[float] | None = None,
        spin: float | Sequence[float] | None = None,
        fixed: bool = False,
        name: str | None = None,
    ) -> Body:
        """Add a particle.

        Parameters
        ----------
        shape : shape, optional
            Its shape, such as `peridem.Circle`; may be left out when `mesh` is given.
        material : Material
            Its material.
        at : sequence of 2 or 3 floats
            Where the origin of the shape is placed [m].
        mesh_size : float, optional
            Edge length [m] of the mesh of the shape as it is given, before scaling.
        mesh : Mesh, optional
            A mesh in the reference position, instead of `mesh_size`.
        angle : float
            Turn [rad] about `axis` through the origin of the shape.
        axis : sequence of 3 floats, optional
            Axis of the turn; z when left out.
        scale : float
            Factor on the shape and its mesh.
        velocity : sequence of 2 or 3 floats, optional
            Velocity [m/s] at the start.
        spin : float or sequence of 3 floats, optional
            Angular velocity [rad/s] at the start, about the centre of mass.
        fixed : bool
            Whether the body never moves, while others may touch it.
        name : str, optional
            Its name; made from the shape's when left out.

        Returns
        -------
        Body
            A handle for contact, loads and recorders.

        Raises
        ------
        InputError
            If an argument breaks a rule, or the model is built already.
        """
        form = self._form("add_particle", shape, mesh_size, mesh)
        body = self._new_body(
            "add_particle", form, material, at=at, angle=angle, axis=axis, scale=scale,
            velocity=velocity, spin=spin, fixed=fixed,
            name=self._new_name("add_particle", name, form),
        )  # fmt: skip
        return self._added(body)

    @checked
    def add_particles(
        self,
        source: Any = None,
        *,
        material: Material,
        mesh_size: float | None = None,
        shape: MeshableShape | Sequence[MeshableShape] | None = None,
        at: Any = None,
        scale: Any = None,
        angle: Any = None,
        velocity: Any = None,
        spin: Any = None,
        fixed: bool = False,
        name: str | None = None,
    ) -> Bodies:
        """Add many particles.

        Parameters
        ----------
        source : Packing or DataFrame, optional
            A packing; or a table with the columns x, y[, z], and optionally scale, angle,
            vx, vy[, vz], spin, and shape (the position in a sequence of shapes). Without it `shape`
            and `at` are needed.
        material : Material
            Their material.
        mesh_size : float
            Edge length [m] of the mesh of each shape as it is given, before scaling.
        shape : shape or sequence of shapes, optional
            Their shape, or as many as there are particles.
        at : array_like, shape (n, 2) or (n, 3), optional
            Where the origins of the shapes are placed [m].
        scale, angle : float or array_like of shape (n,), optional
            Factor on the shape; turn [rad] about z.
        velocity : array_like, shape (2,), (3,), (n, 2) or (n, 3), optional
            Velocity [m/s] at the start.
        spin : float or array_like of shape (n,), optional
            Angular velocity [rad/s] about z at the start.
        fixed : bool
            Whether they never move.
        name : str, optional
            Name of the group.

        Returns
        -------
        Bodies
            A sequence of handles that stands for all of them.

        Raises
        ------
        InputError
            If an argument breaks a rule, or the model is built already.
        """
        plan = self._open_plan("add_particles")
        given = {"at": at, "scale": scale, "angle": angle, "velocity": velocity, "spin": spin}
        rows = rows_of(source, shape, given, plan.dimension)
        forms: dict[int, Form] = {}
        for row in rows:
            if id(row["shape"]) not in forms:
                forms[id(row["shape"])] = self._form("add_particles", row["shape"], mesh_size, None)
        first = forms[id(rows[0]["shape"])]
        group = self._new_name("add_particles", name, first, plural=True)
        bodies = []
        for number_, row in enumerate(rows, 1):
            form = forms[id(row.pop("shape"))]
            body = self._new_body(
                "add_particles", form, material, name=f"{group}-{number_}", fixed=fixed, **row
            )
            bodies.append(body)
        members = Bodies(group, bodies)
        plan.bodies += bodies
        self._names[group] = members
        self._names.update({body.name: body for body in bodies})
        return members

    @checked
    def add_wall(
        self,
        shape: MeshableShape | None = None,
        *,
        material: Material,
        at: Sequence[float] = (0.0, 0.0, 0.0),
        mesh_size: float | None = None,
        mesh: Mesh | None = None,
        angle: float = 0.0,
        axis: Sequence[float] | None = None,
        scale: float = 1.0,
        velocity: Sequence[float] | None = None,
        fixed: bool | None = None,
        name: str | None = None,
    ) -> Body:
        """Add a wall: a body that does not act on other walls and is not damped by its centre.

        Parameters
        ----------
        velocity : sequence of 2 or 3 floats, optional
            Constant velocity [m/s] the wall is driven with; other motions are given by `prescribe`.
        fixed : bool, optional
            Whether it never moves: by default when it has no velocity. Give False for a wall to
            be moved by `prescribe`.
        shape, material, at, mesh_size, mesh, angle, axis, scale, name
            As in `add_particle`.

        Returns
        -------
        Body
            A handle for contact, loads and recorders.

        Raises
        ------
        InputError
            If an argument breaks a rule, or the model is built already.
        """
        form = self._form("add_wall", shape, mesh_size, mesh)
        held = velocity is None if fixed is None else fixed
        if held and velocity is not None:
            raise InputError(
                f"add_wall: velocity = {show_value(velocity)}: is given to a wall with fixed = "
                "True; keep one of them"
            )
        body = self._new_body(
            "add_wall", form, material, at=at, angle=angle, axis=axis, scale=scale, fixed=held,
            is_wall=True, name=self._new_name("add_wall", name, form, base="wall"),
        )  # fmt: skip
        self._added(body)
        if velocity is not None:
            self.prescribe(body, velocity=velocity)
        return body

    def body(self, name: str) -> Body | Bodies:
        """Return the body or group of bodies of this name."""
        if name not in self._names:
            raise InputError(
                f"body: name = {name!r}: there is none; {did_you_mean(name, self._names)}"
            )
        return self._names[name]

    # Contact.

    @checked
    def set_contact(
        self,
        a: Any = None,
        b: Any = None,
        *,
        friction: float | None = None,
        damping_ratio: float | None = None,
        damping_factor: float | None = None,
        radius: float | None = None,
        radius_factor: float | None = None,
        stiffness: float | None = None,
        stiffness_factor: float | None = None,
        damping_criterion: str | None = None,
        node_damping: bool | None = None,
        friction_model: str | None = None,
        tangential_stiffness_ratio: float | None = None,
        self_contact: bool | None = None,
    ) -> None:
        """Set the contact between all bodies, or between some.

        What is said of two kinds of bodies (`a` and `b`) overrides what is said of one (`a`, with
        any other), and that what is said of all; of equals the later holds. What is said
        nowhere has its default: contact radius 0.95 of the smallest mesh size of the model,
        stiffness 18 kappa/(pi horizon^5), no friction, no damping.

        Parameters
        ----------
        a, b : Material, Body, Bodies, str or sequence of them, optional
            The bodies: of a material, those named, or all.
        friction : float, optional
            Friction coefficient; 0 for none.
        damping_ratio : float, optional
            Epsilon of the damping, above 0 and at most 1 (no damping): about the ratio of the
            speeds after and before an impact of two rigid bodies.
        damping_factor : float, optional
            Factor on the damping coefficient; 1 when left out.
        radius : float, optional
            Contact radius Rc [m]; or
        radius_factor : float, optional
            Rc as a multiple of the smallest mesh size of the model.
        stiffness : float, optional
            Normal stiffness Kn [N/m^7].
        stiffness_factor : float, optional
            Factor on Kn, given or not.
        damping_criterion : {"centers", "nodes"}, optional
            Whether damping acts when centres or when nodes are close.
        node_damping : bool, optional
            Whether the relative velocity of nodes is damped too.
        friction_model : {"slip", "history"}, optional
            Friction along the momentary slip, or by a tangential spring with Coulomb's cap.
        tangential_stiffness_ratio : float, optional
            Stiffness of that spring as a fraction of Kn; 2/7 when left out.
        self_contact : bool, optional
            Whether nodes of one body that were never bonded touch.

        Raises
        ------
        InputError
            If an argument breaks a rule, nothing is given, or the model is built already.

        References
        ----------
        Jha et al. (2021), eqs. 17 to 27 and 36.
        """
        plan = self._open_plan("set_contact")
        values = {
            "friction": friction,
            "damping_ratio": damping_ratio,
            "damping_factor": damping_factor,
            "radius": radius,
            "radius_factor": radius_factor,
            "stiffness": stiffness,
            "stiffness_factor": stiffness_factor,
            "damping_criterion": damping_criterion,
            "node_damping": node_damping,
            "friction_model": friction_model,
            "tangential_stiffness_ratio": tangential_stiffness_ratio,
            "self_contact": self_contact,
        }
        sides = [
            None if one is None else self._matching(one, f"set_contact: {argument}")
            for argument, one in (("a", a), ("b", b))
        ]
        plan.rules.append(make_rule(sides[0], sides[1], values, "set_contact"))

    # Loads.

    @checked
    def prescribe(
        self,
        bodies: Any = None,
        *,
        displacement: Any = None,
        velocity: Any = None,
        rotation: float | None = None,
        about: Sequence[float] | None = None,
        axis: Sequence[float] | None = None,
        space: Any = None,
        directions: Any = None,
        region: Any = None,
        nodes: Any = None,
        name: str | None = None,
    ) -> None:
        """Prescribe the motion of bodies, or of some of their nodes.

        Parameters
        ----------
        bodies : Body, Bodies, Material, str or sequence of them, optional
            Bodies that move; all when left out.
        displacement : float, vector, (name, parameters...) or callable, optional
            Displacement [m]: constant; by direction, None leaving one free; the built-in function
            of time ``("linear", rate)``, ``("quadratic", a, b)`` (a t + b t^2) or
            ``("sin", amplitude, p)`` (amplitude sin(pi p t)); or a Python function of the time [s],
            called once per step, that returns a number, one for each direction or each node, or an
            array of shape (n_nodes, n_directions).
        velocity : float, vector or callable, optional
            Velocity [m/s]: constant, or a Python function of time. Together with a function as
            displacement it is the velocity the nodes report; left out, that is the last change of
            the displacement by the time step. Alone, displacements are summed up from it.
        rotation : float, optional
            Angular velocity [rad/s] of a rotation about the point `about` and the `axis` (z).
        space : str or (name, p), optional
            Factor in space: ``("hat_x", p)``, ``("sin_x", p)``, ``("linear_x", p)`` or the same
            with y, of the reference position.
        directions : str or sequence of int, optional
            Directions that are prescribed, ``"x"``, ``"xy"`` or [1, 2]; all when left out.
        region : optional
            Nodes: two corners, a shape, keys of a shape in a deck, or a function of positions
            (n, 3) that returns n flags.
        nodes : sequence of int, optional
            Nodes: their numbers in each of the bodies, from 0.
        name : str, optional
            What messages call it.

        Raises
        ------
        InputError
            If an argument breaks a rule, or the model is built already.
        """
        target, label = self._target(
            "prescribe",
            bodies=bodies,
            space=space,
            directions=directions,
            region=region,
            nodes=nodes,
            name=name,
        )
        plan = self._open_plan("prescribe")
        if rotation is None:
            for argument, one in (("about", about), ("axis", axis)):
                if one is not None:
                    raise InputError(
                        f"{label}: {argument} = {show_value(one)}: belongs to a rotation; give "
                        "rotation, the angular velocity in rad/s"
                    )
            plan.loads += motion_parts(target, label, displacement, velocity)
            return
        if displacement is not None or velocity is not None:
            raise InputError(
                f"{label}: rotation = {show_value(rotation)}: is given besides displacement or "
                "velocity; keep one of them"
            )
        plan.loads.append(rotation_part(target, label, rotation, about, axis))

    @checked
    def apply_force(
        self,
        bodies: Any = None,
        *,
        density: Any,
        space: Any = None,
        directions: Any = None,
        region: Any = None,
        nodes: Any = None,
        name: str | None = None,
    ) -> None:
        """Apply a force density on bodies, or on some of their nodes.

        Parameters
        ----------
        density : float, vector, (name, parameters...) or callable
            Force density [N/m^3]: constant, by direction or the same in all; a built-in function
            of time ``("linear", rate)``, ``("linear_step", rate, rise, rest)``,
            ``("linear_slow_fast", a, t1, slow, fast)`` or ``("sin", amplitude, p)``; or a Python
            function of the time [s] as in `prescribe`.
        bodies, space, directions, region, nodes, name
            As in `prescribe`.

        Raises
        ------
        InputError
            If an argument breaks a rule, or the model is built already.
        """
        target, label = self._target(
            "apply_force",
            bodies=bodies,
            space=space,
            directions=directions,
            region=region,
            nodes=nodes,
            name=name,
        )
        self._open_plan("apply_force").loads += force_parts(target, label, density)

    # Decks.

    def to_deck(self, folder: str | os.PathLike[str]) -> Path:
        """Write the model as a deck of the original's format that gives the same run, bit for bit.

        Parameters
        ----------
        folder : path-like
            Gets input.yaml, the meshes and particle_locations.csv; created when missing.

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
        composition = self._composed("to_deck")
        return write_deck(self._deck_to_write(), composition.held, Path(folder))

    def _deck_to_write(self) -> Deck:
        raise NotImplementedError

    def _composed(self, who: str) -> Composition:
        raise NotImplementedError

    # What these have in common.

    def _open_plan(self, who: str) -> ModelPlan:
        """Return the plan, when it can still be added to."""
        if self._plan is None:
            raise InputError(
                f"{who}: the model is that of a deck; change the deck, or make a DEMModel()"
            )
        if self._composition is not None:
            raise InputError(
                f"{who}: the model is built already (by init, step or run); add everything before"
            )
        return self._plan

    def _form(
        self, who: str, shape: MeshableShape | None, mesh_size: float | None, mesh: Mesh | None
    ) -> Form:
        plan = self._open_plan(who)
        if shape is None and mesh is None:
            raise InputError(f"{who}: shape: missing; give a shape such as Circle(radius=1e-3)")
        if mesh is not None and not isinstance(mesh, Mesh):
            raise InputError(
                f"{who}: mesh = {show_value(mesh)}: must be a peridem.mesh.Mesh; read one with "
                "peridem.mesh.read_mesh"
            )
        if shape is not None:
            _check_shape(who, shape, plan.dimension, needs_mesh=mesh is None)
        if mesh is not None:
            if mesh_size is not None:
                raise InputError(
                    f"{who}: mesh_size = {mesh_size!r}: is given besides mesh; keep one of them"
                )
            return Form(shape, None, mesh)
        if mesh_size is None:
            if not _meshes_itself(shape):
                raise InputError(
                    f"{who}: mesh_size: missing; give the edge length of the mesh in m"
                )
            return Form(shape, None, None)
        return Form(shape, number(mesh_size, f"{who}: mesh_size", above=0, unit="m"), None)

    def _new_body(
        self,
        who: str,
        form: Form,
        material: Any,
        *,
        at: Any,
        name: str,
        angle: Any = 0.0,
        axis: Any = None,
        scale: Any = 1.0,
        velocity: Any = None,
        spin: Any = None,
        is_wall: bool = False,
        fixed: Any = False,
    ) -> Body:
        dimension = self._open_plan(who).dimension
        if not isinstance(material, Material):
            raise InputError(
                f"{who}: material = {show_value(material)}: must be a material; give PDState(...) "
                "or another law"
            )
        if not isinstance(fixed, bool | np.bool_):
            raise InputError(f"{who}: fixed = {fixed!r}: must be True or False; write one of them")
        if fixed and (velocity is not None or spin is not None):
            given = "velocity" if velocity is not None else "spin"
            raise InputError(
                f"{who}: {given} = {show_value(velocity if velocity is not None else spin)}: is "
                "given to a body that is fixed; leave one of them out"
            )
        return Body(
            name=name,
            form=form,
            material=material,
            at=_three(vector(at, f"{who}: at", dimension)),
            angle=number(angle, f"{who}: angle", unit="rad"),
            axis=_axis(axis, who, dimension),
            scale=number(scale, f"{who}: scale", above=0),
            velocity=_motion(velocity, f"{who}: velocity", dimension, "m/s"),
            spin=_spin(spin, f"{who}: spin", dimension),
            is_wall=is_wall,
            fixed=bool(fixed),
        )

    def _added(self, body: Body) -> Body:
        self._open_plan("add").bodies.append(body)
        self._names[body.name] = body
        return body

    def _new_name(
        self, who: str, name: Any, form: Form, *, base: str = "", plural: bool = False
    ) -> str:
        if name is None:
            stem = base or form.label + ("s" if plural else "")
            used = 1
            while (candidate := stem if used == 1 else f"{stem}-{used}") in self._names:
                used += 1
            return candidate
        if not isinstance(name, str) or not name:
            raise InputError(f"{who}: name = {name!r}: must be text; write it in quotes")
        if name in self._names:
            raise InputError(f"{who}: name = {name!r}: is taken already; choose another")
        return name

    def _matching(self, which: Any, where: str) -> Matches:
        """Tell bodies by handle, group, name, material, or a sequence of these."""
        if isinstance(which, Material):
            return lambda body: body.material == which
        members = set(self._members(which, where))
        return members.__contains__

    def _members(self, which: Any, where: str) -> Iterable[Body]:
        if isinstance(which, str):
            if which not in self._names:
                raise InputError(
                    f"{where} = {which!r}: there is no body of this name; "
                    f"{did_you_mean(which, self._names)}"
                )
            which = self._names[which]
        if isinstance(which, Body):
            if which not in self._open_plan(where).bodies:
                raise InputError(f"{where} = {which!r}: is a body of another model; use its own")
            return [which]
        if isinstance(which, Material):
            return [body for body in self._open_plan(where).bodies if body.material == which]
        if isinstance(which, Iterable) and not isinstance(which, Mapping):
            found = [body for one in which for body in self._members(one, where)]
            if found:
                return found
        raise InputError(
            f"{where} = {show_value(which)}: must be bodies, by handle, name or material; give "
            "what add_particle returned"
        )

    def _target(
        self,
        who: str,
        *,
        bodies: Any,
        space: Any,
        directions: Any,
        region: Any,
        nodes: Any,
        name: Any,
    ) -> tuple[Target, str]:
        plan = self._open_plan(who)
        label = who if name is None else f"{who} {name!r}"
        matches: Matches | None = None
        if bodies is not None:
            matches = self._matching(bodies, f"{label}: bodies")
        keys, by_region = parse_region(region, plan.dimension, label)
        by_number = parse_nodes(nodes, label)
        if by_region is not None and by_number is not None:
            raise InputError(f"{label}: nodes: are given besides a region; keep one of them")
        if matches is None and keys is None:
            matches = _every
        given = parse_directions(directions, plan.dimension, label)
        target = Target(
            matches=matches,
            region=keys,
            choose=by_region or by_number,
            directions=given or list(range(1, plan.dimension + 1)),
            dimension=plan.dimension,
            space=parse_space(space, label),
        )
        return target, label


def _every(_: Body) -> bool:
    return True


def _three(values: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = values
    return x, y, z


def _check_shape(who: str, shape: Any, dimension: int, *, needs_mesh: bool) -> None:
    needed = ["geometry", "deck_keys"] + (["mesh"] if needs_mesh else [])
    if isinstance(shape, type) or any(not hasattr(shape, one) for one in needed):
        raise InputError(
            f"{who}: shape = {show_value(shape)}: must be a shape; give for instance "
            "Circle(radius=1e-3)"
        )
    if shape.dimension != dimension:
        raise InputError(
            f"{who}: shape = {shape!r}: has dimension {shape.dimension}, the model "
            f"{dimension}; use a shape of the model's dimension"
        )


def _meshes_itself(shape: Any) -> bool:
    """Whether a shape has its mesh already, and needs no size for it."""
    parameter = inspect.signature(shape.mesh).parameters.get("mesh_size")
    return parameter is None or parameter.default is not parameter.empty


def _axis(value: Any, who: str, dimension: int) -> tuple[float, float, float]:
    if value is None:
        return 0.0, 0.0, 1.0
    axis = _three(vector(value, f"{who}: axis", 3, unit=""))
    if not any(axis):
        raise InputError(f"{who}: axis = {show_value(value)}: has no direction; give (0, 0, 1)")
    if dimension == 2 and any(axis[:2]):
        raise InputError(f"{who}: axis = {show_value(value)}: must be z in 2D; leave it out")
    return axis


def _motion(value: Any, where: str, dimension: int, unit: str) -> tuple[float, float, float]:
    if value is None:
        return 0.0, 0.0, 0.0
    return _three(vectors([value], where, dimension, unit=unit)[0].tolist())


def _spin(value: Any, where: str, dimension: int) -> tuple[float, float, float]:
    if value is None:
        return 0.0, 0.0, 0.0
    if np.ndim(value) == 0:
        return 0.0, 0.0, number(value, where, unit="rad/s")
    spin = _motion(value, where, 3, "rad/s")
    if dimension == 2 and any(spin[:2]):
        raise InputError(f"{where} = {show_value(value)}: must be about z in 2D; give a number")
    return spin
