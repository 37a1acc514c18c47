"""A whole model in NumPy, from the deck and the placed nodes of a `peridem.DEMModel`."""

# ruff: noqa: N806 - symbols of the paper

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from peridem.geometry import make_shape
from peridem.loads import amplitude, select_nodes

from . import bonds as bd
from . import contact as ct
from . import external as ex
from . import material as mt
from . import peridynamic as pd


@dataclass
class Body:
    """A particle or wall and its nodes [start, stop)."""

    id: int
    zone: int
    is_wall: bool
    constrained: bool
    start: int
    stop: int
    center: int
    radius: float
    rho: float
    volume: float
    h: float
    horizon: float
    K: float
    solid: pd.Solid
    intact: np.ndarray

    @property
    def nodes(self):
        """Slice of the body's nodes."""
        return slice(self.start, self.stop)


class ReferenceModel:
    """The same model as a `peridem.DEMModel`, stepped by readable kernels.

    Reference positions, nodal volumes and the bodies' shapes are taken over; all constants,
    neighbours and bonds are made anew from the deck.
    """

    def __init__(self, model):
        deck, s = model.deck, model.state
        self.deck = deck
        self.original = model.compatibility == "original"
        self.dimension = deck.model.dimension
        self.verlet = deck.model.discretization_type.time == "velocity_verlet"
        self.dt = deck.model.final_time / deck.model.time_steps
        self.t = 0.0
        self.gravity = np.array(deck.gravity)
        self.state = SimpleNamespace(
            X=s.x_ref.copy(),
            x=s.x.copy(),
            u=s.u.copy(),
            v=s.v.copy(),
            f=np.zeros_like(s.f),
            V=s.volume.copy(),
            rho=s.density.copy(),
            theta=np.zeros(len(s)),
            Z=np.zeros(len(s)),
        )
        self.bodies = [self._body(model, particle) for particle in model.particles]
        self._make_contact_laws()
        self._make_loads(model)
        self.copy_state(model)

    def copy_state(self, model):
        """Take over positions, velocities, time and broken bonds."""
        for name in ("x", "u", "v"):
            getattr(self.state, name)[:] = getattr(model.state, name)
        intact = model.bonds.intact.astype(bool)
        for body in self.bodies:
            begin, end = model.bonds.offsets[[body.start, body.stop]]
            body.intact[:] = intact[begin:end]
        self.t = model.time

    @property
    def intact(self):
        """All bonds, body by body, True while unbroken."""
        return np.concatenate([body.intact for body in self.bodies])

    def _body(self, model, particle):
        plan, deck = model.bodies[particle.id], self.deck
        X = self.state.X[particle.start : particle.stop]
        V = self.state.V[particle.start : particle.stop]
        material = deck.materials[particle.zone]
        h = bd.mesh_size(X, fuzzy=self.original)
        ratio = material.horizon_mesh_ratio
        horizon = material.horizon if ratio is None else ratio * h
        # The original weighs all bonds by the influence function of the first zone.
        weighed = deck.materials[0] if self.original else material
        influence = mt.Influence.of(weighed, self.dimension)
        law = mt.make_law(material, influence, horizon, self.dimension)
        links = bd.make_bonds(X, V, horizon, h, influence)
        Kn_self = 18 * mt.law_bulk_modulus(law, horizon) / (np.pi * horizon**5)
        # In the original the law of body 0 decides on the state-based stage of all bodies.
        first = deck.materials[model.particles[0].zone].type
        dilates = not self.original or first == "PDState"
        mesh = model._meshes[particle.zone].points
        shape = plan.shape
        center = bd.center_node(mesh, shape.center, shape.bounding_radius, fuzzy=self.original)
        return Body(
            id=particle.id,
            zone=particle.zone,
            is_wall=bool(deck.zones[particle.zone].is_wall),
            constrained=particle.constrained,
            start=particle.start,
            stop=particle.stop,
            center=particle.start + center,
            radius=plan.scale * shape.bounding_radius,
            rho=material.density,
            volume=V.sum(),
            h=h,
            horizon=horizon,
            K=mt.contact_bulk_modulus(material, law, horizon),
            solid=pd.Solid(X, V, links, law, 0.95 * h, Kn_self, dilates),
            intact=np.ones(len(links.i), dtype=bool),
        )

    def _make_contact_laws(self):
        h_min = bd.smallest([body.h for body in self.bodies], fuzzy=self.original)
        self.contact_laws = {}
        for p in self.bodies:
            for q in self.bodies:
                if (p.is_wall and q.is_wall) or not self.deck.contacts:
                    continue
                pair = (min(p.zone, q.zone), max(p.zone, q.zone))
                kappa, horizon = ct.harmonic(p.K, q.K), max(p.horizon, q.horizon)
                law = ct.make_contact_law(self.deck.contacts[pair], kappa, h_min, horizon)
                if p is q and (p.constrained or not law.self_contact):
                    continue
                self.contact_laws[p.id, q.id] = law
        self.springs = {ids: {} for ids in self.contact_laws}

    def _make_loads(self, model):
        self.displacement_sets = [
            self._load(model, load, "displacement") for load in self.deck.displacement_sets
        ]
        self.force_sets = [self._load(model, load, "force") for load in self.deck.force_sets]
        self.locked = np.zeros_like(self.state.x, dtype=bool)
        for load in self.displacement_sets:
            for d in load.directions:
                self.locked[load.nodes, d] = True
        self.held = self.locked[:, : self.dimension].all(axis=1)
        for body in self.bodies:
            if body.constrained:
                self.locked[body.nodes] = True

    def _load(self, model, load, kind):
        shape = None
        if load.region is not None:
            g = load.region.geometry
            shape = make_shape(g.type, g.parameters, g.vec_type, g.vec_flag, self.dimension)
        ids = model.state.particle_id
        nodes = select_nodes(load, self.state.X, ids, shape)
        boxes = [model.bodies[k].box if shape is None else shape.box for k in ids[nodes]]
        values = amplitude(load, kind, self.state.X[nodes], np.array(boxes).reshape(-1, 2, 3))
        time = load.time_function
        directions = tuple(d - 1 for d in load.direction)
        zero = getattr(load, "zero_displacement", False)
        return ex.LoadSet(nodes, values, directions, time.type, time.parameters, zero)

    # One step.

    def start(self):
        """Initial velocity, prescribed motion and forces at t = 0."""
        initial = self.deck.initial_velocity
        for k in initial.particle_list if initial else ():
            self.state.v[self.bodies[k].nodes] = initial.velocity_vector
        self.prescribe()
        self.compute_forces()

    def step(self):
        """Central difference (32), or velocity Verlet: half kicks on both sides of the forces."""
        s, kick = self.state, self.dt / 2 if self.verlet else self.dt
        free = ~self.locked
        free[:, self.dimension :] = False
        a = s.f / s.rho[:, None]
        s.v[free] += kick * a[free]
        s.u[free] += self.dt * s.v[free]
        s.x[free] += self.dt * s.v[free]
        self.t += self.dt
        self.prescribe()
        self.compute_forces(slip_time=self.dt)
        if self.verlet:
            s.v[free] += kick * (s.f / s.rho[:, None])[free]

    def prescribe(self):
        """Impose the displacement sets."""
        for load in self.displacement_sets:
            ex.prescribe(self.state, load, self.t, original=self.original)

    # Forces.

    def compute_forces(self, slip_time=0.0):
        """Force density of the current state; springs of friction slip for `slip_time`."""
        self.state.f[:] = 0
        self.add_internal_forces()
        self.add_contact_forces(slip_time)
        self.add_external_forces()

    def add_internal_forces(self):
        """Inside every body that can move."""
        for body in self.bodies:
            if body.constrained:
                continue
            found = pd.internal_force(body.solid, self.state.u[body.nodes], body.intact)
            self.state.f[body.nodes] += found.f
            self.state.Z[body.nodes] = found.Z
            self.state.theta[body.nodes] = found.theta

    def takes_contact(self, body):
        """Nodes of a body that contact forces act on.

        In the original, bodies that never move get none and walls never do; held wall nodes get
        theirs all the same, which moves nothing and makes the reaction right.
        """
        whole = np.ones(body.stop - body.start, dtype=bool)
        if not self.original:
            return whole
        if not body.is_wall:
            return whole & (not body.constrained)
        return self.held[body.nodes] | body.constrained

    def _touching_bodies(self):
        for (p, q), law in self.contact_laws.items():
            yield self.bodies[p], self.bodies[q], law

    def pairs(self, slip_time=0.0):
        """Contact forces on p from q for every ordered pair (p, q), as in `contact.Pairs`."""
        for p, q, law in self._touching_bodies():
            if p.constrained and q.constrained:
                continue
            memory = {"springs": self.springs[p.id, q.id], "slip_time": slip_time}
            yield p, q, ct.pair_forces(self.state, p, q, law, **memory, original=self.original)

    def add_contact_forces(self, slip_time=0.0):
        """Nodes against nodes, then dashpots."""
        for p, _, found in self.pairs(slip_time):
            on = self.takes_contact(p)[found.i - p.start]
            np.add.at(self.state.f, found.i[on], found.total[on])
        for p, q, law in self._touching_bodies():
            if law.beta == 0 or p.is_wall or p is q:
                continue
            if q.is_wall:
                self._add_wall_damping(p, q, law)
            elif p.id < q.id:
                self._add_center_damping(p, q, law)

    def _damped_volume(self, body):
        return ct.damped_volume(body, original=self.original)

    def _add_center_damping(self, p, q, law):
        volumes = self._damped_volume(p), self._damped_volume(q)
        found = ct.center_damping(self.state, p, q, law, volumes)
        if found is not None:
            self.state.f[p.nodes] += found[0]
            self.state.f[q.nodes] += found[1]

    def _add_wall_damping(self, p, wall, law):
        if p.constrained:
            return
        volume = self._damped_volume(p)
        on_p, nodes, reaction = ct.wall_damping(self.state, p, wall, law, volume)
        self.state.f[p.nodes] += on_p
        on = self.takes_contact(wall)[nodes - wall.start]
        self.state.f[nodes[on]] += reaction[on]

    def add_external_forces(self):
        """Gravity on every node, and the force sets."""
        self.state.f += self.state.rho[:, None] * self.gravity
        for load in self.force_sets:
            ex.add_force_set(self.state.f, load, self.t)

    # Balances.

    def energy(self):
        """Kinetic, strain and contact energy [J, per unit thickness in 2D]."""
        s = self.state
        kinetic = 0.5 * np.sum(s.rho * s.V * np.sum(s.v**2, axis=1))
        strain = sum(
            pd.strain_energy(body.solid, s.u[body.nodes], body.intact)
            for body in self.bodies
            if not body.constrained
        )
        contact = sum(ct.contact_energy(s, *pair) for pair in self._touching_bodies())
        contact *= 0.5  # every pair of nodes counts from both ends
        return kinetic, strain, contact
