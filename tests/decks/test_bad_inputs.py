"""Inputs with one thing wrong, through the command line: one clear error, or the right result.

Every row is the deck of two grains about to collide with one change, or one way to call the
program. `docs/bad_inputs.md` holds what each gives; this file writes it::

    python tests/decks/test_bad_inputs.py

and a test keeps it in step.
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Callable, Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))  # for the script; pytest has it

from helpers import GRAIN_RADIUS, DeckFolder, box_mesh, changed, disc_mesh, write_msh
from peridem.cli import main
from peridem.output import read_pvd
from peridem.vtu import read_vtu

R = GRAIN_RADIUS
DOCUMENT = Path(__file__).parents[2] / "docs" / "bad_inputs.md"
REMOVE = object()
STEPS = 20


def base_deck(folder: DeckFolder) -> dict[str, Any]:
    """Two grains in contact after a few steps, with every block that the rows change."""
    deck = folder.grains(offset=(0.0, 2 * R + 1.02 * 0.95 * R / 6), steps=STEPS)
    for k in (1, 2):
        folder.mesh(f"disc_6_{k}", disc_mesh(R))
    folder.places((0, 0, 0, 0, R, 0), (1, 0, 2 * R + 1.02 * 0.95 * R / 6, 0, R, 0))
    contact = {"Damping_On": True, "Epsilon": 0.9, "Friction_On": True, "Friction_Coeff": 0.2}
    deck["Contact"] = {name: pair | contact for name, pair in deck["Contact"].items()}
    deck["Neighbor"] = {"Update_Criteria": "simple_all", "Search_Factor": 5, "Search_Interval": 1}
    velocity = {"Velocity_Vector": [0, -20, 0], "Particle_List": [1]}
    deck["IC"] = {"Constant_Velocity": velocity}
    function = {"Type": "quadratic", "Parameters": [0.1, 2.0]}
    deck["Displacement_BC"] = {
        "Sets": 1,
        "Set_1": {"Particle_List": [0], "Direction": [1], "Time_Function": function},
    }
    deck["Output"] = {
        "Path": "out",
        "Tags": ["Displacement", "Velocity", "Force_Density", "Damage_Z"],
        "Output_Interval": 10,
    }
    return deck


def without(deck: Mapping[str, Any], path: str) -> dict[str, Any]:
    """A deck without a key."""
    result = changed(deck, {})
    *blocks, key = path.split(".")
    block = result
    for name in blocks:
        block = block[name]
    del block[key]
    return result


@dataclass(frozen=True)
class Row:
    """One thing wrong, and what comes of it.

    `says` are parts of the message that matter; `{deck}` is its name and `{line:key}` the line
    of a key. `check` looks at the output folder of a run that is right.
    """

    name: str
    changes: Mapping[str, Any] = field(default_factory=dict)
    files: Callable[[DeckFolder], None] | None = None
    arguments: tuple[str, ...] | None = None
    code: int = 2
    says: tuple[str, ...] = ()
    check: Callable[[Path], None] | None = None


def replace_text(name: str, old: str, new: str) -> Callable[[DeckFolder], None]:
    """Change the text of a file; it must be there."""

    def apply(folder: DeckFolder) -> None:
        path = folder.folder / name
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, 1))

    return apply


def write_text(name: str, text: str) -> Callable[[DeckFolder], None]:
    return lambda folder: (folder.folder / name).write_text(text) and None


def delete(name: str) -> Callable[[DeckFolder], None]:
    return lambda folder: (folder.folder / name).unlink()


def truncate(folder: DeckFolder) -> None:
    path = folder.folder / "disc_6_1.msh"
    path.write_text(path.read_text()[: path.stat().st_size // 2])


def write_msh_4(folder: DeckFolder) -> None:
    """The first grain's mesh as MSH 4.1 text: one block of nodes, one of triangles."""
    mesh = disc_mesh(R)
    n, m = len(mesh.points), len(mesh.cells)
    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$Nodes", f"1 {n} 1 {n}", f"2 1 0 {n}"]
    lines += [str(k + 1) for k in range(n)]
    lines += [f"{x!r} {y!r} {z!r}" for x, y, z in mesh.points.tolist()]
    lines += ["$EndNodes", "$Elements", f"1 {m} 1 {m}", f"2 1 2 {m}"]
    for k, cell in enumerate(mesh.cells.tolist(), 1):
        lines.append(f"{k} " + " ".join(str(node + 1) for node in cell))
    text = "\n".join([*lines, "$EndElements", ""])
    (folder.folder / "disc_6_1.msh").write_text(text)


def coarse_mesh(folder: DeckFolder) -> None:
    """A first grain of 3 x 3 nodes: mesh size 1 mm."""
    write_msh(folder.folder / "disc_6_1.msh", box_mesh((2 * R, 2 * R), (2, 2)))


def last_output(out: Path) -> dict[str, np.ndarray]:
    (_, _), (_, _), (_, path) = read_pvd(out / "output.pvd")
    return read_vtu(path)["arrays"]


def grains_push_each_other(out: Path) -> None:
    """The lower grain, at rest before, moves down; all is finite."""
    arrays = last_output(out)
    assert all(np.isfinite(values).all() for values in arrays.values())
    assert arrays["Velocity"][:127, 1].min() < -1e-3


def both_laws_act(out: Path) -> None:
    """Both grains strain inside: the damage of each is above zero."""
    grains_push_each_other(out)
    damage = last_output(out)["Damage_Z"]
    assert damage[:127].max() > 0
    assert damage[127:].max() > 0


def stopped_early(out: Path) -> None:
    """The last state is there for inspection."""
    assert read_vtu(out / "output_last.vtu")["step"] is not None


CD = "Model.Discretization_Type.Time"
TIME = "Displacement_BC.Set_1.Time_Function"
PMB = {"Type": "PMBBond", "Horizon": 6e-4, "Density": 1200.0, "K": 2.16e7, "Gc": 50.0}
SOUND_ONLY = {
    "V_Max": 1.0,
    "Contact_Radius_Factor": 0.95,
    "Damping_On": False,
    "Friction_On": False,
}

ROWS = [
    Row("input file missing", arguments=("run", "none.yaml"), says=("none.yaml' does not exist",)),
    Row("no arguments", arguments=("run",), says=("Missing argument 'DECK'",)),
    Row("nThreads abc", arguments=("run", "{deck}", "--threads", "abc"), says=("'abc' is not",)),
    Row("nThreads 0", arguments=("run", "{deck}", "--threads", "0"), says=("0 is not in the",)),
    Row(
        "mesh file missing",
        files=delete("disc_6_1.msh"),
        says=("{line:Mesh.Zone_1.File}: Mesh.Zone_1.File = disc_6_1.msh: no such file; check",),
    ),
    Row(
        "csv missing",
        files=delete("places.csv"),
        says=("{line:Particle_Generation.From_File}: Particle_Generation.From_File = places.csv:",),
    ),
    Row(
        "csv bad header",
        files=replace_text("places.csv", "i, x, y, z, r, o", "zone, x, y, z, r, o"),
        says=("places.csv:1: column 'zone': unknown; did you mean i?",),
    ),
    Row(
        "csv nan",
        files=replace_text("places.csv", "0, 0, 0, 0,", "0, nan, 0, 0,"),
        says=("places.csv:2: x = nan: must be a finite number; correct it",),
    ),
    Row(
        "csv negative radius",
        files=replace_text("places.csv", "0, 0, 0, 0, 0.001", "0, 0, 0, 0, -0.001"),
        says=("places.csv:2: r = -0.001: must be positive; give the radius in m",),
    ),
    Row(
        "csv only header",
        files=write_text("places.csv", "i, x, y, z, r, o\n"),
        says=("places.csv: only a header: it must place bodies; add a line for each",),
    ),
    Row("no Model", {"Model": REMOVE}, says=("{deck}: Model: missing; give the block",)),
    Row(
        "no Dimension",
        {"Model.Dimension": REMOVE},
        says=("{line:Model}: Model.Dimension: missing; give the dimension, 2 or 3",),
    ),
    Row(
        "no Final Time",
        {"Model.Final_Time": REMOVE},
        says=("{line:Model}: Model.Final_Time: missing; give the end of the simulated time in s",),
    ),
    Row(
        "no Discretization",
        {"Model.Discretization_Type": REMOVE},
        says=("{line:Model}: Model.Discretization_Type: missing; give the block with the time",),
    ),
    Row(
        "time scheme typo",
        {CD: "central_diference"},
        says=("{line:" + CD + "}: " + CD + " = central_diference: ", "mean central_difference?"),
    ),
    Row(
        "no Material", {"Material": REMOVE}, says=("{deck}: Material: missing; give the material",)
    ),
    Row(
        "material type typo",
        {"Material.Zone_1.Type": "PDSate"},
        says=("{line:Material.Zone_1.Type}: Material.Zone_1.Type = PDSate: ", "mean PDState?"),
    ),
    Row(
        "no Horizon",
        {"Material.Zone_1.Horizon": REMOVE},
        says=("{line:Material.Zone_1}: Material.Zone_1.Horizon: missing; give the horizon in",),
    ),
    Row(
        "horizon negative",
        {"Material.Zone_1.Horizon": -6e-4},
        says=("{line:Material.Zone_1.Horizon}: Material.Zone_1.Horizon = -0.0006: must be pos",),
    ),
    Row(
        "horizon below h",
        {"Material.Zone_1.Horizon": 6e-5},
        says=(
            "{line:Material.Zone_1.Horizon}: Material.Zone_1.Horizon = 6e-05: must exceed the ",
            "mesh size 0.000166667 of body 0, or its nodes have no neighbours; use 0.0005 to ",
        ),
    ),
    Row(
        "K nan",
        {"Material.Zone_1.K": float("nan")},
        says=("{line:Material.Zone_1.K}: Material.Zone_1.K = nan: must be a finite number; give",),
    ),
    Row(
        "K text",
        {"Material.Zone_1.K": "soft"},
        says=("{line:Material.Zone_1.K}: Material.Zone_1.K = soft: must be a number; give the ",),
    ),
    Row(
        "no Gc",
        {"Material.Zone_1.Gc": REMOVE},
        says=("{line:Material.Zone_1}: Material.Zone_1.Gc: missing; give Gc",),
    ),
    Row(
        "density zero",
        {"Material.Zone_1.Density": 0},
        says=("{line:Material.Zone_1.Density}: Material.Zone_1.Density = 0: must be positive; ",),
    ),
    Row(
        "density negative",
        {"Material.Zone_1.Density": -1200},
        says=("{line:Material.Zone_1.Density}: Material.Zone_1.Density = -1200: must be pos",),
    ),
    Row("no Contact", {"Contact": REMOVE}, says=("{deck}: Contact: missing; give Zone_ij for",)),
    Row(
        "no Contact 12",
        {"Contact.Zone_12": REMOVE},
        says=("{line:Contact}: Contact.Zone_12: missing; give the contact of this pair of zones",),
    ),
    Row(
        "contact V Max only",
        {"Contact.Zone_12": SOUND_ONLY},
        says=(
            "{line:Contact.Zone_12.V_Max}: Contact.Zone_12.V_Max = 1.0: no stiffness follows ",
            "give Kn in N/m^7",
        ),
    ),
    Row(
        "epsilon zero",
        {"Contact.Zone_12.Epsilon": 0},
        says=("{line:Contact.Zone_12.Epsilon}: Contact.Zone_12.Epsilon = 0: must be positive; ",),
    ),
    Row("no Neighbor", {"Neighbor": REMOVE}, code=0, check=grains_push_each_other),
    Row(
        "search interval 0",
        {"Neighbor.Search_Interval": 0},
        says=("{line:Neighbor.Search_Interval}: Neighbor.Search_Interval = 0: must be at least 1",),
    ),
    Row("no Zone", {"Zone": REMOVE}, says=("{deck}: Zone: missing; give Zones, the number of",)),
    Row(
        "no Particle Zone 2",
        {"Particle.Zone_2": REMOVE},
        says=("{line:Particle}: Particle.Zone_2: missing; give the shape of its bodies",),
    ),
    Row(
        "geometry typo",
        {"Particle.Zone_1.Type": "circel"},
        says=("{line:Particle.Zone_1.Type}: Particle.Zone_1.Type = circel: ", "mean circle?"),
    ),
    Row(
        "IC particle out of range",
        {"IC.Constant_Velocity.Particle_List": [7]},
        says=(
            "{line:IC.Constant_Velocity.Particle_List}: IC.Constant_Velocity.Particle_List = [7]:",
            "no body 7: the deck has bodies 0 to 1; correct the list",
        ),
    ),
    Row("no Output", {"Output": REMOVE}, says=("{deck}: Output: missing; give the block with ",)),
    Row(
        "output dir missing",
        {"Output.Path": "new/folder"},
        code=0,
        check=lambda out: grains_push_each_other(out.parent / "new" / "folder"),
    ),
    Row(
        "output interval 0",
        {"Output.Output_Interval": 0},
        says=("{line:Output.Output_Interval}: Output.Output_Interval = 0: must be at least 1; ",),
    ),
    Row(
        "unknown key typo",
        {"Material.Zone_1.Densty": 1.0},
        says=("{line:Material.Zone_1.Densty}: Material.Zone_1.Densty = 1.0: unk", "mean Density?"),
    ),
    Row(
        "restart file missing",
        {"Restart": {"File": "none.vtu", "Step": 10}},
        says=("{line:Restart.File}: Restart.File = none.vtu: no such file; check the name",),
    ),
    Row(
        "BC without Time Function p0",
        {TIME: {"Type": "linear"}},
        says=("{line:" + TIME + "}: " + TIME + ".Parameters: linear needs 1 parameter, has 0; ",),
    ),
    Row(
        "BC without Direction",
        {"Displacement_BC.Set_1.Direction": REMOVE},
        says=("{line:Displacement_BC.Set_1}: Displacement_BC.Set_1.Direction: missing; give the ",),
    ),
    Row(
        "BC time function typo",
        {f"{TIME}.Type": "linaer"},
        says=("{line:" + TIME + ".Type}: " + TIME + ".Type = linaer: must be ", "mean linear?"),
    ),
    Row(
        "BC quadratic 1param",
        {f"{TIME}.Parameters": [0.1]},
        says=(
            "{line:" + TIME + ".Parameters}: " + TIME + ".Parameters = [0.1]: quadratic needs 2 ",
        ),
    ),
    Row(
        "compressive test bad id",
        {
            "Particle.Test_Name": "compressive_test",
            "Particle.Compressive_Test": {"Particle_Id": 9, "Particle_Force_Direction": 2},
        },
        says=(
            "{line:Particle.Compressive_Test.Particle_Id}: Particle.Compressive_Test.Particle_Id =",
            " 9: no such body: the deck has bodies 0 to 1, zone by zone; correct it",
        ),
    ),
    Row(
        "overlapping particles",
        files=replace_text("places.csv", "1, 0, 0.002", "1, 0, 0.001"),
        says=(
            "places.csv:2: bodies 0 and 1 (from places.csv:3) overlap at the start",
            "shrink one",
        ),
    ),
    Row(
        "dim 3 for 2d mesh",
        {"Model.Dimension": 3, "Particle.Zone_1.Type": "sphere", "Particle.Zone_2.Type": "sphere"},
        says=("disc_6_1.msh", "Mesh.Zone_1.File"),
    ),
    Row(
        "dt too large",
        {"Model.Final_Time": 1e-3, "Model.Time_Steps": 400},  # 3 times the stable step
        code=3,
        says=(
            "warning: {line:Model.Time_Steps}: Model.Time_Steps = 400: the time step 2.5e-06 s",
            "numerical failure: step ",
            "must be finite and below",
            "the last state is in ",
        ),
        check=stopped_early,
    ),
    Row("mesh v4", files=write_msh_4, code=0, check=grains_push_each_other),
    Row("mesh truncated", files=truncate, says=("disc_6_1.msh", "{line:Mesh.Zone_1.File}: Mesh")),
    Row("mixed bond and state", {"Material.Zone_2": PMB}, code=0, check=both_laws_act),
]
GOOD = Row("nothing wrong", code=0, check=grains_push_each_other)


@dataclass(frozen=True)
class Outcome:
    """What a row gave: exit code, all that was printed but for the report of a good run."""

    code: int
    text: str
    folder: Path
    deck: Path

    def line_of(self, key: str) -> str:
        """File and line of a key of the deck, which is written with a key on each line."""
        lines = self.deck.read_text().splitlines()
        number = -1
        for depth, name in enumerate(key.split("."), 1):
            start = " " * depth + f'"{name}":'
            number = next(n for n in range(number + 1, len(lines)) if lines[n].startswith(start))
        return f"{self.deck.name}:{number + 1}"


def give(row: Row, folder: Path) -> Outcome:
    """Call the command line with the row's deck, in an empty folder."""
    decks = DeckFolder(folder)
    deck = base_deck(decks)
    for path, value in row.changes.items():
        deck = without(deck, path) if value is REMOVE else changed(deck, {path: value})
    if row.files is not None:
        row.files(decks)
    path = decks.write(deck)
    # JSON writes NaN; YAML's is .nan
    path = path.rename(folder / "input.yaml")
    path.write_text(path.read_text().replace("NaN", ".nan"))
    words = row.arguments if row.arguments is not None else ("run", "{deck}", "--quiet")
    printed = StringIO()
    with redirect_stdout(printed), redirect_stderr(printed), pytest.raises(SystemExit) as end:
        main([word.format(deck=path) for word in words], prog_name="peridem")
    text = printed.getvalue().replace(f"{folder}/", "").replace(str(folder), ".")
    return Outcome(int(end.value.code or 0), text, folder, path)


@pytest.mark.parametrize("row", [GOOD, *ROWS], ids=lambda row: row.name)
def test_bad_input_gives_one_clear_error_or_the_right_result(row: Row, tmp_path: Path) -> None:
    outcome = give(row, tmp_path)
    assert outcome.code == row.code, outcome.text
    assert "Traceback" not in outcome.text
    for part in row.says:
        wanted = re.sub(r"\{line:([^}]*)\}", lambda m: outcome.line_of(m[1]), part)
        wanted = wanted.replace("{deck}", outcome.deck.name)
        assert wanted in outcome.text, outcome.text
    errors = [line for line in outcome.text.splitlines() if "rror: " in line or "failure: " in line]
    assert len(errors) == (0 if row.code == 0 else 1), outcome.text
    if row.check is not None:
        row.check(tmp_path / "out")


def test_strict_refuses_what_is_only_a_warning_otherwise(tmp_path: Path) -> None:
    slow = {"Model.Final_Time": STEPS * 1e-6}  # 1.3 times the stable step
    words = ("check", "{deck}")
    for folder, extra, code in (("plain", (), 0), ("strict", ("--strict",), 2)):
        (tmp_path / folder).mkdir()
        outcome = give(Row(folder, slow, arguments=(*words, *extra)), tmp_path / folder)
        assert outcome.code == code, outcome.text
        assert "1e-06 s is above the estimated stable one" in outcome.text


def test_overlap_may_be_allowed(tmp_path: Path) -> None:
    # centres 2 R + 0.4 Rc apart: 0.4 of the contact radius between the nearest nodes
    near = replace_text("places.csv", "0.0021615", f"{2 * R + 0.4 * 0.95 * R / 6!r}")
    words = ("run", "{deck}", "--quiet")
    for folder, extra, code in (("refused", (), 2), ("allowed", ("--allow-overlap",), 0)):
        (tmp_path / folder).mkdir()
        row = Row(folder, files=near, arguments=(*words, *extra))
        assert give(row, tmp_path / folder).code == code


def test_stop_criterion_is_a_good_end_with_a_word_in_the_summary(tmp_path: Path) -> None:
    # the top of the upper grain starts at 3.16 mm from the origin
    criteria = {"Type": "max_node_dist", "Parameters": [3.0e-3]}
    changes = {"Output.Output_Criteria": criteria}
    outcome = give(Row("stop", changes, arguments=("run", "{deck}")), tmp_path)
    assert outcome.code == 0, outcome.text
    assert "Stopped by Output_Criteria after step 10, t = " in outcome.text
    assert "Output_Criteria: node " in outcome.text


HEAD = """\
# Bad input: what it gives

Each row is a deck of two grains with one thing wrong, or a way to call the program. Exit code 2
is bad input, 3 a numerical failure, 0 the right result. Several things wrong are reported at
once, a line for each. This page is written by `python tests/decks/test_bad_inputs.py`.

| what is wrong | exit | what is printed |
|---|---|---|
"""


def document() -> str:
    """The page, from what every row gives."""
    lines = []
    for row in ROWS:
        with tempfile.TemporaryDirectory() as name:
            outcome = give(row, Path(name).resolve())
        text = " ".join(outcome.text.split()).removeprefix("peridem: ").replace("|", "\\|")
        text = re.sub(r"^Usage: .*?Error: ", "error: ", text)
        shown = f"`{text}`" if text else "nothing: the deck runs"
        lines.append(f"| {row.name} | {outcome.code} | {shown} |")
    return HEAD + "\n".join(lines) + "\n"


def test_page_of_bad_inputs_is_in_step() -> None:
    shortened = re.compile(r"Stopped by .*? m/s: must")  # numbers of the runaway are not pinned
    written = shortened.sub("#", DOCUMENT.read_text(encoding="utf-8"))
    assert written == shortened.sub("#", document())


if __name__ == "__main__":
    DOCUMENT.write_text(document(), encoding="utf-8")
