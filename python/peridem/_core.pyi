"""C++ core of peridem: bodies, bonds, contact, time stepping.

Types of cpp/bindings. What each member means stands in the headers of cpp/peridem: deck.h,
state.h, particle.h, bonds.h, model.h. Members without a setter are read-only.
"""

from collections.abc import Callable, Sequence
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Vec3 = Sequence[float]
_NodeFunction = Callable[[float], NDArray[np.float64]]

__version__: str

class Compatibility(Enum):
    corrected = 0
    original = 1

class TimeScheme(Enum):
    central_difference = 0
    velocity_verlet = 1

class MaterialType(Enum):
    pd_state = 0
    pmb_bond = 1
    rnp_bond = 2
    pd_elastic_bond = 3

class BondBreaking(Enum):
    both = 0
    tension = 1

class InfluenceType(Enum):
    constant = 0
    linear = 1
    gaussian = 2

class CellType(Enum):
    none = 0
    line = 1
    triangle = 2
    quad = 3
    tetra = 4

class DampingCriterion(Enum):
    centers = 0
    nodes = 1

class FrictionModel(Enum):
    slip = 0
    history = 1

class TimeFunctionType(Enum):
    constant = 0
    linear = 1
    quadratic = 2
    sin = 3
    rotation = 4
    linear_step = 5
    linear_slow_fast = 6

class Mesh:
    def __init__(
        self,
        points: ArrayLike,
        cell_type: CellType,
        cells: ArrayLike,
        volumes: Sequence[float] = ...,
    ) -> None: ...

class InfluenceDeck:
    type: InfluenceType
    parameters: Sequence[float]
    def __init__(self) -> None: ...

class MaterialDeck:
    type: MaterialType
    density: float
    horizon: float
    horizon_mesh_ratio: float
    youngs_modulus: float
    bulk_modulus: float
    shear_modulus: float
    poisson_ratio: float
    fracture_energy: float
    critical_stress_factor: float
    law_parameters: Sequence[float]
    bond_breaking: BondBreaking
    irreversible_fracture: bool
    check_sc_factor: float
    influence: InfluenceDeck
    def __init__(self) -> None: ...

class ZoneDeck:
    name: str
    is_wall: bool
    all_dofs_constrained: bool
    mesh: int
    center: _Vec3
    bounding_radius: float
    material: MaterialDeck
    def __init__(self) -> None: ...

class BodyDeck:
    zone: int
    site: _Vec3
    axis: _Vec3
    angle: float
    scale: float
    constrained: bool
    def __init__(self) -> None: ...

class ContactDeck:
    contact_radius: float
    contact_radius_factor: float
    kn: float
    kn_factor: float
    damping_on: bool
    epsilon: float
    beta_n_factor: float
    friction_on: bool
    friction_coeff: float
    center_damping_criterion: DampingCriterion
    node_damping: bool
    friction_model: FrictionModel
    tangential_stiffness_ratio: float
    self_contact: bool
    def __init__(self) -> None: ...

class TimeFunction:
    type: TimeFunctionType
    parameters: Sequence[float]
    def __init__(self, type: TimeFunctionType, parameters: Sequence[float]) -> None: ...

class DisplacementSet:
    nodes: Sequence[int]
    amplitude: Sequence[float]
    directions: int
    time_function: TimeFunction
    rotation_axis: _Vec3
    zero_displacement: bool
    def __init__(self) -> None: ...
    def set_displacement(self, function: _NodeFunction, /) -> None: ...
    def set_velocity(self, function: _NodeFunction, /) -> None: ...

class ForceSet:
    nodes: Sequence[int]
    amplitude: Sequence[float]
    directions: int
    time_function: TimeFunction
    def __init__(self) -> None: ...
    def set_density(self, function: _NodeFunction, /) -> None: ...

class InitialVelocity:
    bodies: Sequence[int]
    velocity: _Vec3
    spin: _Vec3
    def __init__(self) -> None: ...

class ModelDeck:
    dimension: int
    final_time: float
    time_steps: int
    time_scheme: TimeScheme
    compatibility: Compatibility
    gravity: _Vec3
    meshes: Sequence[Mesh]
    zones: Sequence[ZoneDeck]
    bodies: Sequence[BodyDeck]
    contacts: Sequence[ContactDeck]
    def __init__(self) -> None: ...

class State:
    """Arrays over all nodes, without copies."""

    @property
    def x_ref(self) -> NDArray[np.float64]: ...
    @property
    def x(self) -> NDArray[np.float64]: ...
    @property
    def u(self) -> NDArray[np.float64]: ...
    @property
    def v(self) -> NDArray[np.float64]: ...
    @property
    def f(self) -> NDArray[np.float64]: ...
    @property
    def volume(self) -> NDArray[np.float64]: ...
    @property
    def density(self) -> NDArray[np.float64]: ...
    @property
    def theta(self) -> NDArray[np.float64]: ...
    @property
    def weighted_volume(self) -> NDArray[np.float64]: ...
    @property
    def damage_z(self) -> NDArray[np.float64]: ...
    @property
    def particle_id(self) -> NDArray[np.int32]: ...
    @property
    def zone_id(self) -> NDArray[np.int32]: ...
    @property
    def fixity(self) -> NDArray[np.uint8]: ...
    @property
    def force_fixity(self) -> NDArray[np.uint8]: ...
    def __len__(self) -> int: ...

class Particle:
    """A body: particle or wall."""

    @property
    def id(self) -> int: ...
    @property
    def zone(self) -> int: ...
    @property
    def is_wall(self) -> bool: ...
    @property
    def constrained(self) -> bool: ...
    @property
    def start(self) -> int: ...
    @property
    def stop(self) -> int: ...
    @property
    def center_node(self) -> int: ...
    @property
    def bounding_radius(self) -> float: ...
    @property
    def mesh_size(self) -> float: ...
    @property
    def horizon(self) -> float: ...
    @property
    def volume(self) -> float: ...
    @property
    def density(self) -> float: ...
    @property
    def bulk_modulus(self) -> float: ...
    @property
    def self_contact_radius(self) -> float: ...
    @property
    def self_contact_kn(self) -> float: ...

class BondTable:
    """Compressed bond lists, without copies."""

    @property
    def offsets(self) -> NDArray[np.int64]: ...
    @property
    def indices(self) -> NDArray[np.int32]: ...
    @property
    def intact(self) -> NDArray[np.uint8]: ...

def memory_costs() -> dict[str, int]: ...
def lengths_pay(bytes: float, /) -> bool: ...
def nodes_of_piece(nodes: int, /) -> int: ...

class DEMModel:
    def __init__(self, deck: ModelDeck, threads: int) -> None: ...
    def add_displacement_set(self, set: DisplacementSet, /) -> None: ...
    def add_force_set(self, set: ForceSet, /) -> None: ...
    def add_initial_velocity(self, velocity: InitialVelocity, /) -> None: ...
    def init(self) -> None: ...
    def set_duration(self, final_time: float, time_steps: int) -> None: ...
    def start(self) -> None: ...
    def advance(self, n: int, seconds: float) -> int: ...
    def compute_forces(self) -> None: ...
    def compute_peridynamic_forces(self) -> None: ...
    def compute_contact_forces(self) -> None: ...
    def compute_external_forces(self) -> None: ...
    def compute_external_displacement_bc(self) -> None: ...
    def stable_time_step(self) -> tuple[float, float, float]: ...
    def contact_forces(self) -> NDArray[np.float64]: ...
    @property
    def track_energy(self) -> bool: ...
    @track_energy.setter
    def track_energy(self, on: bool, /) -> None: ...
    def energies(self) -> dict[str, float]: ...
    def energy_flows(self) -> dict[str, float]: ...
    def energy_forces(
        self,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]: ...
    def restore_energy(
        self,
        flows: dict[str, float],
        friction: NDArray[np.float64],
        damping: NDArray[np.float64],
        sets: NDArray[np.float64],
        prescribed_works: NDArray[np.float64],
    ) -> None: ...
    def prescribed_works(self) -> NDArray[np.float64]: ...
    def bond_virials(self) -> NDArray[np.float64]: ...
    def fragment_labels(self) -> NDArray[np.int32]: ...
    def node_contacts(self) -> tuple[NDArray[np.int32], NDArray[np.float64]]: ...
    def body_dampings(self) -> tuple[NDArray[np.int32], NDArray[np.float64]]: ...
    def touching_nodes(self) -> NDArray[np.int32]: ...
    def slips(self) -> tuple[NDArray[np.int32], NDArray[np.float64]]: ...
    def restore(
        self, n: int, time: float, nodes: NDArray[np.int32], elongations: ArrayLike
    ) -> None: ...
    def compute_damage(self) -> None: ...
    def set_intact(self, intact: NDArray[np.uint8]) -> None: ...
    def bond_constants(self) -> NDArray[np.float64]: ...
    def timings(self) -> dict[str, float]: ...
    def contact_law(self, body_i: int, body_j: int) -> dict[str, float]: ...
    def contact_candidates(self) -> int: ...
    def contact_rebuilds(self) -> int: ...
    @property
    def instruction_set(self) -> str: ...
    @property
    def memory_bytes(self) -> int: ...
    @property
    def state(self) -> State: ...
    @property
    def bonds(self) -> BondTable: ...
    @property
    def particles(self) -> list[Particle]: ...
    @property
    def time(self) -> float: ...
    @property
    def dt(self) -> float: ...
    @property
    def n(self) -> int: ...
    @property
    def threads(self) -> int: ...
    @property
    def started(self) -> bool: ...
