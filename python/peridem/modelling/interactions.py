"""Walls, contact and loads: what bodies do to each other, and what is done to them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from ..errors import InputError
from ..materials import Material
from ..mesh import Mesh
from .adding import BodyBuilder
from .arguments import checked, did_you_mean, show_value
from .bodies import Body, MeshableShape
from .contact import make_rule
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

Matches = Callable[[Body], bool]


class InteractionBuilder(BodyBuilder):
    """Adds walls, contact and loads to the plan of a model; see `DEMModel`."""

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
            Whether nothing moves it but `prescribe`: by default when it has no velocity. False is
            for a wall that is to be pushed or to deform where nothing is prescribed.
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
