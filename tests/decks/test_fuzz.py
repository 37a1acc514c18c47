"""Mutants of decks, meshes and placements: each runs, or gives one clean error.

A mutant is made from its seed alone; ``mutate(seed)`` shows the one that a failure names. The
normal run takes some 300, ``pytest --fuzz N tests/decks/test_fuzz.py`` any number more.
"""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import GRAIN_RADIUS, DeckFolder, disc_mesh, single_deck
from peridem import DEMModel, InputError, NumericalError
from ruamel.yaml import YAML

R = GRAIN_RADIUS
CHUNK = 20
FIRST_SEED = 20_000  # of the mutants of --fuzz

Files = dict[str, str]

ODD_VALUES: tuple[Any, ...] = (
    0, -1, 1, 2, 3, 7, 0.0, -0.0, 0.5, 1e-30, 1e30, -1e30, 1e300, 1e308, -1e308, 5e-324, 2**31,
    2**53, 2**63, 10**30, float("nan"), float("inf"), float("-inf"), None, True, False, "", "abc",
    "1e-3", "..", "/", "no.file", "\0", "x" * 3000, "PDState", "circle", "constant", [], [[]], {},
    [0], [1, 2], [-1], [1, 2, 3, 4, 5, 6, 7], [float("nan")] * 3, ["a"], {"a": 1}, {"Type": 1},
    {"Type": "circle", "Parameters": [1e-3, 0, 0, 0]},
)  # fmt: skip
ODD_WORDS = (
    "nan", "inf", "-inf", "-1", "0", "1e400", "1e308", "-1e308", "1e-320", "abc", "", "1,2",
    "99999999999999999999", "0x10", "1.5", "2", "3", "4", "15", "\t", "é", "#", "$EndNodes",
    "$Elements", "&a", "*a", "<<", "!!python/object:os.system", "%", "@", "|", ">", "- ", ": ", "'",
)  # fmt: skip
FACTORS = (-1.0, 0.0, 0.1, 0.5, 0.999, 1.001, 2.0, 10.0, 1e3, 1e10, 1e-10, 1e150, 1e-150)


def bases(folder: Path) -> list[Files]:
    """Sound decks with their files, as text by name, and small enough to be quick."""
    return [
        _files(folder / "pair", _pair),
        _files(folder / "cubes", _cubes),
        _files(folder / "plate", _plate),
    ]


def _files(folder: Path, make: Callable[[DeckFolder], dict[str, Any]]) -> Files:
    folder.mkdir()
    text = json.dumps(make(DeckFolder(folder)), indent=1)
    return {path.name: path.read_text() for path in folder.iterdir()} | {"input.yaml": text}


def _pair(folder: DeckFolder) -> dict[str, Any]:
    """Two discs, the upper one held by a load, with nearly every block of a deck."""
    deck = folder.grains(rings=4, offset=(0.0, 2.35 * R), steps=100)
    for k in (1, 2):
        folder.mesh(f"disc_4_{k}", disc_mesh(R, 4))
    region = {"Type": "rectangle", "Parameters": [-R, 2.5 * R, 0, R, 3.5 * R, 0]}
    deck["Container"] = {"Geometry": {"Type": "circle", "Parameters": [5 * R, 0, 0, 0]}}
    deck["Neighbor"] = {"Search_Factor": 5, "Search_Interval": 2}
    deck["IC"] = {"Constant_Velocity": {"Velocity_Vector": [0, -1, 0], "Particle_List": [1]}}
    deck["Displacement_BC"] = {
        "Sets": 2,
        "Set_1": {
            "Particle_List": [0],
            "Direction": [1, 2],
            "Time_Function": {"Type": "rotation", "Parameters": [10, 0, 0, 0]},
        },
        "Set_2": {
            "Region": {"Geometry": region},
            "Direction": [1],
            "Time_Function": {"Type": "quadratic", "Parameters": [0, 1]},
            "Spatial_Function": {"Type": "hat_x", "Parameters": [1e-3]},
        },
    }
    deck["Force_BC"] = {
        "Gravity": [0, -10, 0],
        "Sets": 1,
        "Set_1": {
            "Particle_List": [1],
            "Particle_Exclude_List": [0],
            "Direction": [2],
            "Time_Function": {"Type": "linear_step", "Parameters": [1, 1e-6, 1e-6]},
            "Spatial_Function": {"Type": "sin_x", "Parameters": [1e3]},
        },
    }
    deck["Particle"] |= {
        "Test_Name": "compressive_test",
        "Compressive_Test": {"Particle_Id": 1, "Particle_Force_Direction": 2},
    }
    contact = {"Epsilon": 0.9, "Damping_On": True, "Friction_On": True, "Friction_Coeff": 0.2}
    deck["Contact"]["Zone_12"] |= {**contact, "Friction_Model": "history"}
    deck["Contact"]["Zone_22"] = {"Copy_Contact_Data": [1, 1]}
    deck["Contact"]["Zone_11"]["Self_Contact"] = True
    deck["Material"]["Zone_2"] = {"Copy_Material_Data": 1}
    criteria = {"Type": "max_node_dist", "Parameters": [1.0]}
    tags = ["Displacement", "Velocity", "Strain_Stress"]
    deck["Output"] |= {"Path": "out", "Tags": tags, "Output_Criteria": criteria}
    return deck


def _cubes(folder: DeckFolder) -> dict[str, Any]:
    """Two cubes of different laws."""
    deck = folder.cubes(offset=(1.0e-4, 0.5e-4, 1.2e-3), steps=100, scheme="velocity_verlet")
    deck["Material"]["Zone_2"] = {
        "Type": "RNPBond",
        "Horizon_Mesh_Ratio": 2.5,
        "Density": 1200.0,
        "E": 3e7,
        "Gc": 50.0,
        "Influence_Function": {"Type": 2, "Parameters": [1.0, 0.2]},
        "Bond_Potential": {"Check_Sc_Factor": 1.5},
    }
    return deck


def _plate(_: DeckFolder) -> dict[str, Any]:
    """One plate with the built-in mesh."""
    deck = single_deck("", {"Type": "rectangle", "Parameters": [0, 0, 0, R, 2 * R, 0]}, steps=100)
    deck["Mesh"]["Zone_1"] = {
        "CreateMesh": {"Flag": True, "Info": "uniform"},
        "Mesh_Size": R / 5,
    }
    return deck


def _places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of all keys and list entries of a deck."""
    entries = value.items() if isinstance(value, dict) else enumerate(value)
    for key, inner in entries:
        yield (*path, key)
        if isinstance(inner, dict | list):
            yield from _places(inner, (*path, key))


def _mutate_value(text: str, rng: random.Random) -> str:
    """Change a deck where it hurts: a value, a key, a block."""
    deck = json.loads(text)
    *outer, last = rng.choice(list(_places(deck)))
    block = deck
    for key in outer:
        block = block[key]
    kind = rng.randrange(5)
    if kind == 0:
        del block[last]
    elif kind == 1 and isinstance(block, dict):
        letters = list(last)
        letters[rng.randrange(len(letters))] = rng.choice("aZ_1é")
        block["".join(letters)] = block.pop(last)
    elif kind == 2 and isinstance(block[last], int | float):
        block[last] *= rng.choice(FACTORS)
    else:
        block[last] = rng.choice(ODD_VALUES)
    return re.sub(r"\bNaN\b", ".nan", re.sub(r"Infinity\b", ".inf", json.dumps(deck, indent=1)))


def _mutate_lines(text: str, rng: random.Random) -> str:
    """Take away, repeat, exchange or cut lines."""
    lines = text.split("\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    kind = rng.randrange(5)
    if kind == 0:
        del lines[i : i + rng.choice((1, 1, 2, 10))]
    elif kind == 1:
        lines.insert(j, lines[i])
    elif kind == 2:
        lines[i], lines[j] = lines[j], lines[i]
    elif kind == 3:
        lines = lines[:i]
    else:
        lines.insert(i, rng.choice(ODD_WORDS))
    return "\n".join(lines)


def _mutate_words(text: str, rng: random.Random) -> str:
    """Put an odd word where another was."""
    words = re.split(r"([\s,]+)", text)
    words[rng.randrange(0, len(words), 2)] = rng.choice(ODD_WORDS)
    return "".join(words)


def _mutate_number(text: str, rng: random.Random) -> str:
    """Multiply a number by a factor."""
    numbers = list(re.finditer(r"-?\d+(\.\d+)?(e[-+]?\d+)?", text))
    if not numbers:
        return _mutate_words(text, rng)
    found = rng.choice(numbers)
    value = float(found[0]) * rng.choice(FACTORS)
    shown = str(int(value)) if rng.random() < 0.5 and abs(value) < 1e18 else repr(value)
    return text[: found.start()] + shown + text[found.end() :]


def _mutate_characters(text: str, rng: random.Random) -> str:
    """Exchange, add or drop a character; cut the text anywhere."""
    at = rng.randrange(len(text))
    kind = rng.randrange(4)
    if kind == 0:
        return text[:at]
    character = "" if kind == 1 else chr(rng.choice((0, 9, 10, 13, 32, 45, 58, 123, 0xE9, 0x2028)))
    return text[:at] + character + text[at + (kind != 2) :]


def mutate(files: Files, seed: int) -> Files:
    """Files with one to three things changed."""
    rng = random.Random(seed)
    changed = dict(files)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        names = sorted(changed)
        name = "input.yaml" if rng.random() < 0.5 else rng.choice(names)
        ways = [_mutate_lines, _mutate_words, _mutate_number, _mutate_characters]
        if name == "input.yaml" and changed[name] == files[name]:
            ways += [_mutate_value] * 8
        changed[name] = rng.choice(ways)(changed[name] or " ", rng)
    return changed


def what_is_wrong(folder: Path, files: Files) -> str | None:
    """Build the model and take two steps; None when it stays finite or gives one clean error."""
    for name, text in files.items():
        (folder / name).write_bytes(text.encode("utf-8", "surrogatepass"))
    try:
        model = DEMModel.from_deck(folder / "input.yaml", threads=1)
        model.step(2)
    except InputError as error:
        return unclean(str(error), files)
    except NumericalError as error:
        return None if re.match(r"step \d+ \(t = .* s\): body \d+, node \d+: ", str(error)) else ""
    except Exception as error:  # whatever it is, it is the finding
        return f"{type(error).__name__}: {error}"
    state = model.state
    wrong = [name for name in ("x", "v", "f") if not np.isfinite(getattr(state, name)).all()]
    return f"not finite after the last step: {', '.join(wrong)}" if wrong else None


def unclean(text: str, files: Files) -> str | None:
    """Say what an error message lacks: lines that each name a file, no dumps."""
    if not text.strip() or len(text) > 20_000:
        return f"message of {len(text)} characters"
    for line in text.split("\n"):
        if not any(name in line for name in files):
            return f"no file in: {line[:300]!r}"
    if re.search(r"Traceback|pydantic|<[\w.]+ object|validation error", text):
        return f"a dump: {text[:300]!r}"
    return None


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> list[Files]:
    return bases(tmp_path_factory.mktemp("bases"))


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Take the mutants in chunks, so that a failure shows early."""
    if "seeds" in metafunc.fixturenames:
        count = metafunc.config.getoption("--fuzz")
        first, count = (0, 300) if count is None else (FIRST_SEED, count)
        ends = range(first, first + count, CHUNK)
        chunks = [range(start, min(start + CHUNK, first + count)) for start in ends]
        metafunc.parametrize("seeds", chunks, ids=[f"from {chunk.start}" for chunk in chunks])


def test_decks_to_mutate_are_sound(sound: list[Files], tmp_path: Path) -> None:
    for number, files in enumerate(sound):
        folder = tmp_path / str(number)
        folder.mkdir()
        for name, text in files.items():
            (folder / name).write_text(text)
        model = DEMModel.from_deck(folder / "input.yaml", threads=1)
        model.step(2)
        assert model.warnings == []


def test_mutants_run_or_give_one_clean_error(
    sound: list[Files], seeds: range, tmp_path: Path
) -> None:
    found = {}
    for seed in seeds:
        folder = tmp_path / str(seed)
        folder.mkdir()
        problem = what_is_wrong(folder, mutate(sound[seed % len(sound)], seed))
        if problem is not None:
            found[seed] = problem
    assert not found


def test_mutants_are_not_all_refused(sound: list[Files]) -> None:
    # the decks stay YAML in most mutants: otherwise only its reader would be tested
    yaml = YAML(typ="safe", pure=True)
    readable = 0
    for seed in range(0, 60, len(sound)):
        try:
            yaml.load(mutate(sound[0], seed)["input.yaml"])
            readable += 1
        except Exception:  # whatever YAML says
            pass
    assert readable > 10
