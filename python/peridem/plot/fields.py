"""What can be drawn: names of arrays and their parts, words, units and colours."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..modelling.arguments import did_you_mean

if TYPE_CHECKING:
    from matplotlib.colors import Colormap, Normalize

__all__ = ["FIELDS", "Field", "colour_scale", "find_field", "label_colours", "value_range"]

FloatArray = NDArray[np.float64]

DAMAGE_CAP = 2.0
"""End of the colour scale of Damage_Z: twice the stretch that breaks a bond."""

# Lightness falls all the way, so that the order of the colours survives in grey; at the first
# broken bond it falls at once, and blue turns to orange.
_SOUND = ((0.0, "#f0f4f8"), (1.0, "#9fbbd8"))
_BROKEN = ((0.0, "#f0803c"), (0.45, "#c42f3a"), (1.0, "#4f0718"))

# Distinct hues of about one lightness (Okabe and Ito's order, softened), for bodies and fragments.
_LABELS = (
    *("#4e79a7", "#f28e2b", "#59a14f", "#e15759", "#76b7b2", "#edc948", "#b07aa1", "#9c755f"),
    *("#86bcb6", "#d37295", "#a0cbe8", "#8cd17d", "#b6992d", "#fabfd2", "#79706e", "#d4a6c8"),
)

_COMPONENTS = ("xx", "yy", "zz", "xy", "xz", "yz")
_MEASURES = (*_COMPONENTS, "von_mises", "mean", "max", "min")


@dataclass(frozen=True)
class Field:
    """How an array is drawn.

    Attributes
    ----------
    tag : str
        Its name in the outputs.
    label : str
        What the colour bar says.
    unit : str
        Unit of the numbers.
    kind : {"sequential", "diverging", "damage", "fraction", "labels"}
        Kind of colour scale.
    attribute : str
        Where the state of a model keeps it, if it does.
    component : str or None
        Part of a vector (x, y, z) or tensor (xx, ..., von_mises, mean, max, min); None is the
        length of a vector, and von Mises' equivalent of a tensor.
    """

    tag: str
    label: str
    unit: str = ""
    kind: str = "sequential"
    attribute: str = ""
    component: str | None = None

    @property
    def name(self) -> str:
        """Name as `find_field` takes it, for file names."""
        part = "" if self.component is None else f"_{self.component}"
        return f"{self.tag}{part}".lower()

    def of(self, array: Any) -> FloatArray:
        """Numbers to be coloured, one for each row of an array of the outputs."""
        values = np.asarray(array, dtype=np.float64)
        if values.ndim == 1:
            return values
        if values.shape[1] == 6:
            return _measure(values, self.component or "von_mises", self.tag == "Strain")
        if self.component in ("x", "y", "z"):
            return np.asarray(values[:, "xyz".index(self.component)])
        return np.asarray(np.linalg.norm(values, axis=1))


FIELDS = {
    field.tag: field
    for field in (
        Field("Damage_Z", "Damage $Z = \\max\\,|s|/s_0$", "", "damage", "damage_z"),
        Field("Damage", "Fraction of broken bonds", "", "fraction"),
        Field("Displacement", "Displacement", "m", attribute="u"),
        Field("Velocity", "Speed", "m/s", attribute="v"),
        Field("Force_Density", "Force density", "N/m³", attribute="f"),
        Field("Force", "Force", "N"),
        Field("Theta", "Dilatation $\\theta$", "", "diverging", "theta"),
        Field("Nodal_Volume", "Nodal volume", "", attribute="volume"),
        Field("Particle_ID", "Body", "", "labels", "particle_id"),
        Field("Zone_ID", "Zone", "", "labels", "zone_id"),
        Field("Fixity", "Fixity", "", "labels", "fixity"),
        Field("Fragment_ID", "Fragment", "", "labels"),
        Field("Stress", "Von Mises stress", "Pa"),
        Field("Strain", "Equivalent strain"),
    )
}
"""The arrays whose words are known; any other array is drawn under its own name."""

_OTHER_NAMES = {
    "broken_fraction": "Damage",
    "broken": "Damage",
    "z": "Damage_Z",
    "speed": "Velocity",
    "fragment": "Fragment_ID",
    "fragments": "Fragment_ID",
    "body": "Particle_ID",
    "bodies": "Particle_ID",
    "zone": "Zone_ID",
    "von_mises": "Stress",
    "u": "Displacement",
    "v": "Velocity",
}

_VECTORS = ("Displacement", "Velocity", "Force_Density", "Force")
_COMPONENT_WORDS = {
    "von_mises": "Von Mises {}",
    "mean": "Mean {} (tension > 0)",
    "max": "Largest principal {}",
    "min": "Smallest principal {}",
}


def find_field(name: str, known: Iterable[str], where: str = "render: field") -> Field:
    """Find the field of a name among the arrays there are.

    Parameters
    ----------
    name : str
        Name of an array in any case, perhaps with a part: ``velocity_x``, ``stress_xx``,
        ``stress_von_mises``.
    known : iterable of str
        Names of the arrays.
    where : str
        Argument, for messages.

    Raises
    ------
    InputError
        If there is none, listing what there is.
    """
    arrays = list(known)
    if not isinstance(name, str) or not name:
        raise InputError(
            f"{where} = {name!r}: must be the name of an array; use one of {', '.join(arrays)}"
        )
    by_word = {tag.lower(): tag for tag in arrays}
    word = name.strip().lower().replace(" ", "_").replace("-", "_")
    other = _OTHER_NAMES.get(word)
    if word not in by_word and other in arrays:
        return field_of(other)
    if word in by_word:
        return field_of(by_word[word])
    for tag in sorted(arrays, key=len, reverse=True):
        part = word.removeprefix(f"{tag.lower()}_")
        if part != word and part in _parts(tag):
            return field_of(tag, part)
    raise InputError(f"{where} = {name}: is not in the data; {_remedy(word, other, arrays)}")


def field_of(tag: str, component: str | None = None) -> Field:
    """Return how an array, or a part of it, is drawn."""
    field = FIELDS.get(tag, Field(tag, tag.replace("_", " ")))
    if component is None:
        return field
    if component in _COMPONENT_WORDS:
        label = _COMPONENT_WORDS[component].format(tag.lower())
    else:
        label = f"{'Velocity' if tag == 'Velocity' else field.tag.replace('_', ' ')} {component}"
    kind = "sequential" if component == "von_mises" else "diverging"
    return replace(field, label=label, component=component, kind=kind)


def _parts(tag: str) -> Sequence[str]:
    if tag in ("Stress", "Strain"):
        return _MEASURES
    return () if tag in FIELDS and tag not in _VECTORS else ("x", "y", "z")


def _remedy(word: str, other: str | None, arrays: list[str]) -> str:
    if word.startswith(("stress", "strain", "pressure", "von_mises")):
        return (
            "run with the tag Strain_Stress to have it; there are "
            f"{', '.join(arrays) or 'no arrays'}"
        )
    if other is not None:
        return f"run with the tag {other} to have it; there are {', '.join(arrays)}"
    near = did_you_mean(word, [tag.lower() for tag in arrays])
    listed = f"there are {', '.join(arrays) or 'no arrays'}"
    return f"{near.removesuffix('?')}? {listed}" if near.startswith("did") else listed


def _measure(values: FloatArray, measure: str, is_strain: bool) -> FloatArray:
    """Part of symmetric tensors, shape (n, 6), in the order of `_COMPONENTS`."""
    if measure in _COMPONENTS:
        return np.asarray(values[:, _COMPONENTS.index(measure)])
    mean = values[:, :3].mean(axis=1)
    if measure == "mean":
        return np.asarray(mean)
    if measure == "von_mises":
        # sqrt(3/2 s:s) of the deviator s of a stress, sqrt(2/3 e:e) of that of a strain
        square = ((values[:, :3] - mean[:, None]) ** 2).sum(axis=1)
        square += 2 * (values[:, 3:] ** 2).sum(axis=1)
        return np.asarray(np.sqrt((2 / 3 if is_strain else 3 / 2) * square))
    xx, yy, zz, xy, xz, yz = values.T
    tensors = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=1).reshape(-1, 3, 3)
    finite = np.isfinite(values).all(axis=1)
    principal = np.full((len(values), 3), np.nan)
    principal[finite] = np.linalg.eigvalsh(tensors[finite])
    return np.asarray(principal[:, 2 if measure == "max" else 0])


def value_range(field: Field, values: FloatArray) -> tuple[float, float] | None:
    """Return the ends of a colour scale for some values; None where none is finite.

    A few values far from all others (a fragment that flies off) do not use up the scale: then it
    ends at the quantiles 0.002 and 0.998, and the colour bar has an arrow there.
    """
    if field.kind == "damage":
        return 0.0, DAMAGE_CAP
    if field.kind == "fraction":
        return 0.0, 1.0
    finite = values[np.isfinite(values)]
    if not len(finite):
        return None
    low, high = float(finite.min()), float(finite.max())
    if field.kind == "labels":
        return low, high
    inner_low, inner_high = (float(q) for q in np.quantile(finite, (0.002, 0.998)))
    span = 2 * (inner_high - inner_low)
    if span > 0:
        low = inner_low if inner_low - low > span else low
        high = inner_high if high - inner_high > span else high
    if field.kind == "diverging":
        high = max(-low, high)
        low = -high
    return low, high


def colour_scale(
    field: Field, limits: tuple[float, float] | None, colours: str | None
) -> tuple[Colormap, Normalize]:
    """Colours of a field between two ends."""
    from matplotlib import colormaps
    from matplotlib.colors import LinearSegmentedColormap, Normalize

    norm = Normalize(*(limits or (0.0, 1.0)))
    if colours is not None:
        if colours not in colormaps:
            raise InputError(
                f"render: colours = {colours}: no such colour map; "
                f"{_near_map(colours, list(colormaps))}"
            )
        return colormaps[colours], norm
    if field.kind == "damage":
        low, high = float(norm.vmin or 0.0), float(norm.vmax or DAMAGE_CAP)
        return _damage_colours((1.0 - low) / (high - low)), norm
    if field.kind == "fraction":
        broken = [(0.12 + 0.88 * position, colour) for position, colour in _BROKEN]
        stops = [(0.0, _SOUND[0][1]), *broken]
        return LinearSegmentedColormap.from_list("fraction", stops, N=512), norm
    return colormaps["RdBu_r" if field.kind == "diverging" else "viridis"], norm


def _near_map(word: str, names: list[str]) -> str:
    near = did_you_mean(word, names)
    return near if near.startswith("did") else "use viridis, cividis, magma or gray"


def _damage_colours(turn: float) -> Colormap:
    """Pale blues up to the position of Z = 1, where the colour jumps to orange and reds."""
    from matplotlib.colors import LinearSegmentedColormap

    if not 0 < turn < 1:
        stops = list(_BROKEN if turn <= 0 else _SOUND)
    else:
        stops = [(turn * position, colour) for position, colour in _SOUND]
        stops += [(turn + (1 - turn) * position, colour) for position, colour in _BROKEN]
    return LinearSegmentedColormap.from_list("damage", stops, N=512)


def label_colours(labels: FloatArray) -> FloatArray:
    """Colours, shape (n, 4), of whole numbers: neighbours differ, negative ones are grey."""
    from matplotlib.colors import to_rgba_array

    colours = to_rgba_array(_LABELS)
    whole = np.where(np.isfinite(labels), labels, -1).astype(np.int64)
    chosen = colours[whole % len(colours)]
    chosen[whole < 0] = (0.72, 0.72, 0.72, 1.0)
    return np.asarray(chosen, dtype=np.float64)
