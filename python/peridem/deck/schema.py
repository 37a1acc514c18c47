"""The schema of a deck: every block and every key, with unit, default and bounds.

The models mirror the YAML file block by block; `DeckFile` is the whole of it. Materials and
contact are in `materials`, loads in `loads`. What needs more than one block (zones that must
exist, copies) is checked in `resolve`.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from annotated_types import Gt, Len, Lt

from .fields import (
    REQUIRED,
    Block,
    Count,
    FileName,
    Flag,
    Index,
    Integer,
    NonNegative,
    Numbered,
    Positive,
    Text,
    key,
)
from .loads import Displacements, Forces, InitialCondition
from .materials import ContactZones, MaterialZones
from .shapes import Geometry, ShapeKeys

#: Tags of the original without content: accepted, noted and not written.
EMPTY_TAGS = ("Contact_Nodes", "Contact_Data", "No_Fail_Node", "Boundary_Node_Flag")

Tag = Literal[
    "Displacement",
    "Velocity",
    "Force_Density",
    "Force",
    "Fixity",
    "Force_Fixity",
    "Particle_ID",
    "Zone_ID",
    "Nodal_Volume",
    "Damage_Z",
    "Damage",
    "Theta",
    "Fragment_ID",
    "Strain_Stress",
    "Particle_Locations",
    "Contact_Network",
    "Contact_Nodes",
    "Contact_Data",
    "No_Fail_Node",
    "Boundary_Node_Flag",
]


class Discretization(Block):
    """Model.Discretization_Type: how space and time are discretised."""

    spatial: Literal["finite_difference"] = key(
        "Spatial", "the spatial discretisation; nodes carry volumes", default="finite_difference"
    )
    time: Literal["central_difference", "velocity_verlet"] = key(
        "Time", "the time integrator", default=REQUIRED
    )


class Model(Block):
    """Model: dimension, duration and kind of the run."""

    dimension: Literal[2, 3] = key("Dimension", "the dimension, 2 or 3", default=REQUIRED)
    discretization_type: Discretization = key(
        "Discretization_Type", "the block with the time integrator", default=REQUIRED
    )
    final_time: Positive = key(
        "Final_Time", "the end of the simulated time", unit="s", default=REQUIRED
    )
    time_steps: Count = key(
        "Time_Steps", "the number of steps up to Final_Time", default=REQUIRED, le=10**15
    )
    particle_sim_type: Literal["Multi_Particle", "Single_Particle"] = key(
        "Particle_Sim_Type", "the kind of run: many bodies or one", default="Multi_Particle"
    )
    compatibility: Literal["original", "corrected"] = key(
        "Compatibility",
        "whether the defects of the original are reproduced or corrected",
        default="corrected",
    )
    seed: Index = key("Seed", "the seed of the random orientations", default=1, le=2**31 - 1)
    quad_approximation_order: Annotated[Integer, Gt(0), Lt(6)] = key(
        "Quad_Approximation_Order", "the quadrature order of Strain_Stress (1 to 5)", default=1
    )
    horizon: Positive | None = key(
        "Horizon", "a length", unit="m", ignored="the horizon of each zone is in Material.Zone_k"
    )
    horizon_h_ratio: Positive | None = key(
        "Horizon_h_Ratio", "a ratio", ignored="use Material.Zone_k.Horizon_Mesh_Ratio"
    )
    mesh_size: Positive | None = key(
        "Mesh_Size", "a length", unit="m", ignored="the mesh size of each body is measured"
    )
    populate_element_node_connectivity: Flag = key(
        "Populate_ElementNodeConnectivity",
        "true or false",
        default=False,
        ignored="the connectivity is always at hand",
    )

    def remarks(self) -> Iterator[tuple[str, str]]:
        """Yield the lengths that have no effect here."""
        for name in ("horizon", "horizon_h_ratio", "mesh_size"):
            if getattr(self, name) is not None:
                info = type(self).model_fields[name]
                extra = info.json_schema_extra
                reason = extra.get("ignored") if isinstance(extra, dict) else ""
                yield str(info.alias), f"has no effect; {reason}"

    @property
    def dt(self) -> float:
        """Time step [s]."""
        return self.final_time / self.time_steps


class Container(Block):
    """Container: the region around all bodies."""

    geometry: Geometry = key("Geometry", "the shape of the container", default=REQUIRED)


class Zone(ShapeKeys):
    """Zone.Zone_k: a class of bodies sharing mesh, shape and material."""

    is_wall: Flag | None = key("Is_Wall", "whether the bodies of the zone are walls")

    def rules(self) -> Iterator[tuple[str, str]]:
        """Leave the shape unchecked: the bodies' shape is in Particle.Zone_k."""
        return iter(())

    def remarks(self) -> Iterator[tuple[str, str]]:
        """Yield the shape, which has no effect."""
        if self.type is not None:
            yield "Type", "has no effect; the shape of the bodies is read from Particle.Zone_k"


MOST_ZONES = 2000
"""Pairs of zones grow with the square: memory for 2 million of them is still no matter."""

MOST_JOINED = 110
"""With more zones names such as Zone_1111 mean two pairs, (1, 111) and (11, 11)."""


class Zones(Block):
    """Zone: the number of zones and their kinds."""

    numbered: ClassVar[Numbered | None] = Numbered("Zone_k", Zone)

    zones: Count = key(
        "Zones",
        "the number of zones",
        default=REQUIRED,
        le=MOST_ZONES,
        remedy="give the number of zones",
    )


class ParticleZone(ShapeKeys):
    """Particle.Zone_k: the shape of the zone's bodies."""

    is_wall: Flag | None = key("Is_Wall", "whether the bodies of the zone are walls")
    all_dofs_constrained: Flag = key(
        "All_Dofs_Constrained", "whether the bodies never move", default=False
    )
    create_from_geometry: Flag = key(
        "Create_Particle_Using_ParticleZone_GeomObject",
        "whether the zone is one body, its mesh taken as it is, without a line in the csv",
        default=False,
    )
    near_bd_nodes_tol: NonNegative = key(
        "Near_Bd_Nodes_Tol", "a length", default=0.5, ignored="every node may come into contact"
    )

    def rules(self) -> Iterator[tuple[str, str]]:
        """Yield what is wrong with the shape."""
        if self.type is None:
            yield "Type", "missing; give the shape of the zone's bodies, e.g. circle"
        yield from super().rules()


class CompressiveTest(Block):
    """Particle.Compressive_Test: the body whose reaction is written."""

    retired: ClassVar[dict[str, str]] = {
        "Wall_Id": "walls and particles share one numbering: use Particle_Id",
        "Wall_Force_Direction": "use Particle_Force_Direction",
    }

    particle_id: Index = key("Particle_Id", "the id of the body, from 0", default=REQUIRED)
    particle_force_direction: Annotated[Count, Lt(4)] = key(
        "Particle_Force_Direction", "the direction of the reaction, 1 to 3", default=REQUIRED
    )


class Particles(Block):
    """Particle: shapes of the bodies and the test to perform."""

    numbered: ClassVar[Numbered | None] = Numbered("Zone_k", ParticleZone)

    test_name: Text = key(
        "Test_Name",
        "the name of the test; two_particle and compressive_test have effects",
        default="",
    )
    compressive_test: CompressiveTest | None = key(
        "Compressive_Test", "the body and direction of a compressive_test"
    )

    def rules(self) -> Iterator[tuple[str, str]]:
        """Yield a compressive test without its block."""
        if self.test_name == "compressive_test" and self.compressive_test is None:
            yield (
                "Compressive_Test",
                "missing; compressive_test needs it: give Particle_Id and Particle_Force_Direction",
            )


class ParticleGeneration(Block):
    """Particle_Generation: where the bodies are."""

    file: FileName = key(
        "From_File", "the csv file with the places of the bodies", default=REQUIRED
    )
    data_type: Literal["loc_rad", "loc_rad_orient"] = key(
        "File_Data_Type", "whether the csv gives orientations", default="loc_rad"
    )


class CreateMesh(Block):
    """Mesh.Zone_k.CreateMesh: the built-in mesh."""

    flag: Flag = key("Flag", "whether a mesh is created", default=False)
    info: Literal["uniform"] = key("Info", "the kind of mesh", default="uniform")
    geometry: Geometry | None = key(
        "Geometry", "the rectangle to mesh; the particle's shape when left out"
    )


class MeshZone(Block):
    """Mesh.Zone_k: the reference mesh of the zone's bodies."""

    file: FileName | None = key("File", "the mesh file (.msh, .vtu or .csv)")
    mesh_size: Positive | None = key("Mesh_Size", "the edge length of the created mesh", unit="m")
    create_mesh: CreateMesh | None = key("CreateMesh", "how to create the mesh")
    reference_particle: Geometry | None = key(
        "Reference_Particle", "the shape of the reference mesh, when not that of Particle.Zone_k"
    )

    @property
    def creates(self) -> bool:
        """Whether the mesh is created instead of read."""
        return self.create_mesh is not None and self.create_mesh.flag

    def rules(self) -> Iterator[tuple[str, str]]:
        """Yield what is wrong with the choice between file and created mesh."""
        if self.creates and self.file is not None:
            yield "File", "is given besides CreateMesh.Flag: true; keep one of them"
        if self.creates and self.mesh_size is None:
            yield "Mesh_Size", "missing; CreateMesh needs it: give the edge length in m"
        if not self.creates and self.file is None:
            yield "File", "missing; give the mesh file, or CreateMesh with Flag: true"


class Meshes(Block):
    """Mesh: the reference meshes."""

    numbered: ClassVar[Numbered | None] = Numbered("Zone_k", MeshZone)


class Neighbor(Block):
    """Neighbor: how often contact candidates are searched; results do not depend on it."""

    update_criteria: Text = key(
        "Update_Criteria", "a name", default="simple_all", ignored="results do not depend on it"
    )
    search_factor: Positive = key(
        "Search_Factor", "the search radius as a multiple of the contact radius", default=1.0
    )
    search_interval: Count = key(
        "Search_Interval", "the number of steps between searches, at least 1", default=1
    )


class OutputCriteria(Block):
    """Output.Output_Criteria: when to stop early, looked at with every output.

    ``max_node_dist``: a node is farther than d from the origin; ``max_particle_dist`` (of
    Test_Name: two_particle): the centres of bodies 0 and 1 are farther than d apart.
    """

    type: Literal["max_particle_dist", "max_node_dist"] = key(
        "Type", "the quantity that is watched", default=REQUIRED
    )
    parameters: Annotated[tuple[Positive, ...], Len(1, 1)] = key(
        "Parameters", "the distance at which to stop, as [d]", unit="m", default=REQUIRED
    )
    new_interval: Count | None = key(
        "New_Interval",
        "the number of steps between outputs once the criterion is met; the run stops without it",
    )


class Output(Block):
    """Output: what is written, where and how often."""

    path: FileName = key("Path", "the output folder", default=Path())
    tags: tuple[Tag, ...] = key("Tags", "the list of quantities to write", default=())
    output_interval: Count = key(
        "Output_Interval", "the number of steps between outputs, at least 1", default=REQUIRED
    )
    perform_out: Flag = key("Perform_Out", "whether vtu files are written", default=True)
    perform_fe_out: Flag = key("Perform_FE_Out", "whether elements are written", default=True)
    compress_type: Literal["zlib", "ascii", "none"] = key(
        "Compress_Type", "the compression of the vtu files", default="zlib"
    )
    file_format: Literal["vtu"] = key(
        "File_Format", "the file format; only vtu is written", default="vtu"
    )
    test_output_interval: Count | None = key(
        "Test_Output_Interval", "the number of steps between lines of the test's csv, at least 1"
    )
    tag_pp: Text = key(
        "Tag_PP",
        "a tag for file names, made of letters, digits, _ . + -",
        default="",
        pattern=r"^[\w.+-]*$",
    )
    output_criteria: OutputCriteria | None = key("Output_Criteria", "when to stop early")
    debug: Integer = key(
        "Debug", "a level", default=0, ignored="the command line has its own options"
    )

    def remarks(self) -> Iterator[tuple[str, str]]:
        """Yield the tags without content."""
        for position, tag in enumerate(self.tags):
            if tag in EMPTY_TAGS:
                yield (
                    f"Tags[{position}]",
                    f"{tag} is written empty by the original and ignored here",
                )


class Restart(Block):
    """Restart: the state to go on from."""

    file: FileName = key("File", "the vtu or checkpoint file to go on from", default=REQUIRED)
    step: Index = key("Step", "the number of steps already done", default=REQUIRED)
    change_reference_free_dofs: Flag = key(
        "Change_Reference_Free_Dofs",
        "whether free nodes take their current place as reference",
        default=False,
    )


class Policy(Block):
    """Policy: accepted, without effect."""

    enable_post_processing: Flag = key(
        "Enable_PostProcessing", "true or false", default=False, ignored="the original ignores it"
    )


class Hpx(Block):
    """HPX: settings of older versions of the original; accepted, without effect."""

    partitions: Integer = key(
        "Partitions", "a number", default=1, ignored="threads are chosen on the command line"
    )


class DeckFile(Block):
    """A deck: the blocks of the YAML file."""

    retired: ClassVar[dict[str, str]] = {
        "Wall": "walls are zones like any other: give Zone.Zone_k.Is_Wall: true and describe "
        "the body in Particle.Zone_k",
    }

    model: Model = key("Model", "the block with dimension and time", default=REQUIRED)
    container: Container | None = key("Container", "the region around all bodies")
    zone: Zones | None = key("Zone", "the number of zones and their kinds")
    particle: Particles | None = key("Particle", "the shapes of the bodies")
    particle_generation: ParticleGeneration | None = key(
        "Particle_Generation", "where the bodies are"
    )
    mesh: Meshes = key("Mesh", "the reference mesh of each zone", default=REQUIRED)
    material: MaterialZones = key("Material", "the material of each zone", default=REQUIRED)
    contact: ContactZones | None = key("Contact", "the contact laws of pairs of zones")
    neighbor: Neighbor | None = key("Neighbor", "how often contact candidates are searched")
    force_bc: Forces | None = key("Force_BC", "gravity and force sets")
    displacement_bc: Displacements | None = key("Displacement_BC", "prescribed displacements")
    ic: InitialCondition | None = key("IC", "the initial velocity")
    output: Output = key(
        "Output", "the block with Output_Interval, Path and Tags", default=REQUIRED
    )
    restart: Restart | None = key("Restart", "the state to go on from")
    policy: Policy | None = key("Policy", "without effect")
    hpx: Hpx | None = key("HPX", "without effect")
