"""Adding bodies to a model."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import InputError
from ..materials import Material
from ..mesh import Mesh
from .arguments import checked, did_you_mean, number, show_value, vector, vectors
from .bodies import Bodies, Body, Form, MeshableShape
from .plan import Composition, ModelPlan
from .sources import rows_of


class BodyBuilder:
    """Adds particles to the plan of a model; see `DEMModel`."""

    _plan: ModelPlan | None
    _composition: Composition | None
    _names: dict[str, Body | Bodies]

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
        axis: Any = None,
        velocity: Any = None,
        spin: Any = None,
        fixed: bool = False,
        name: str | None = None,
    ) -> Bodies:
        """Add many particles.

        Parameters
        ----------
        source : Packing or DataFrame, optional
            A packing; or a table with the columns x, y[, z] and optionally scale (or radius, the
            bounding radius of the body), angle[, ax, ay, az], vx, vy[, vz], spin (about z) or wx,
            wy, wz, and shape (the position in a sequence of shapes). Without it `shape` and `at`
            are needed.
        material : Material
            Their material.
        mesh_size : float
            Edge length [m] of the mesh of each shape as it is given, before scaling.
        shape : shape or sequence of shapes, optional
            Their shape, or as many as there are particles.
        at : array_like, shape (n, 2) or (n, 3), optional
            Where the origins of the shapes are placed [m].
        scale, angle : float or array_like of shape (n,), optional
            Factor on the shape; turn [rad] about `axis`.
        axis : array_like, shape (3,) or (n, 3), optional
            Axis of the turn; z when left out.
        velocity : array_like, shape (2,), (3,), (n, 2) or (n, 3), optional
            Velocity [m/s] at the start.
        spin : float or array_like, shape (n,), (n, 3) or in 3D (3,), optional
            Angular velocity [rad/s] at the start: about z, or vectors. Three numbers for three
            particles are one for each; write [(wx, wy, wz)] then.
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
        given = {
            "at": at, "scale": scale, "angle": angle, "axis": axis, "velocity": velocity,
            "spin": spin,
        }  # fmt: skip
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

    def body(self, name: str) -> Body | Bodies:
        """Return the body or group of bodies of this name."""
        if name not in self._names:
            remedy = did_you_mean(name, self._names) if self._names else "bodies have ids only"
            raise InputError(f"body: name = {name!r}: there is none; {remedy}")
        return self._names[name]

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
