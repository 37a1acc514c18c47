"""How a picture is to look: its options, checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..modelling.arguments import choice, number, plain, show_value

__all__ = ["Look", "make_look"]

WALLS = ("filled", "outline", "hidden", "coloured")
STYLES = ("cells", "nodes")
ENGINES = ("auto", "pyvista", "matplotlib")
PIXELS_PER_INCH = 160
_LARGEST = 16_384  # pixels; matplotlib draws up to 65 536, memory does not like it


@dataclass(frozen=True)
class Look:
    """Options of a picture; see `peridem.plot.render`."""

    limits: tuple[float, float] | None = None
    colours: str | None = None
    size: tuple[int, int] | None = None
    zoom: float | tuple[float, float, float, float] = 1.0
    background: str = "white"
    walls: str = "filled"
    scale: float = 1.0
    title: str | None = None
    style: str | None = None
    engine: str = "auto"
    view: tuple[float, float] = (-60.0, 25.0)
    axes: bool = True

    @property
    def ink(self) -> str:
        """Colour of text and lines that is seen on the background."""
        from matplotlib.colors import to_rgb

        red, green, blue = to_rgb(self.background)
        return "0.25" if 0.2126 * red + 0.7152 * green + 0.0722 * blue > 0.45 else "0.88"

    @property
    def wall_colour(self) -> str:
        """Grey of the walls, apart from the background."""
        return "0.74" if self.ink == "0.25" else "0.42"


def make_look(
    *,
    limits: Sequence[float] | None = None,
    colours: str | None = None,
    size: Sequence[int] | None = None,
    zoom: float | Sequence[float] = 1.0,
    background: str = "white",
    walls: str = "filled",
    scale: float = 1.0,
    title: str | None = None,
    style: str | None = None,
    engine: str = "auto",
    view: Sequence[float] = (-60.0, 25.0),
    axes: bool = True,
) -> Look:
    """Check the options of a picture.

    Raises
    ------
    InputError
        If one breaks its rule.
    """
    who = "render"
    return Look(
        limits=_limits(limits),
        colours=_colours(colours),
        size=_size(size),
        zoom=_zoom(zoom),
        background=_background(background),
        walls=choice(walls, WALLS, f"{who}: walls"),
        scale=number(scale, f"{who}: scale", least=0),
        title=_title(title),
        style=None if style is None else choice(style, STYLES, f"{who}: style"),
        engine=choice(engine, ENGINES, f"{who}: engine"),
        view=_pair(view, f"{who}: view", "azimuth and elevation in degrees"),
        axes=bool(axes),
    )


def _pair(value: Any, where: str, what: str) -> tuple[float, float]:
    given = plain(value)
    if not isinstance(given, list | tuple) or len(given) != 2:
        raise InputError(f"{where} = {show_value(value)}: must be two numbers; give {what}")
    return number(given[0], where), number(given[1], where)


def _limits(value: Any) -> tuple[float, float] | None:
    if value is None:
        return None
    where = "render: limits"
    low, high = _pair(value, where, "the lower and the upper end of the colours")
    if not low < high:
        raise InputError(
            f"{where} = ({low:g}, {high:g}): the lower end must be below the upper one; "
            f"{'swap them' if low > high else 'move one of them'}"
        )
    return low, high


def _colours(value: Any) -> str | None:
    if value is not None and not isinstance(value, str):
        raise InputError(
            f"render: colours = {show_value(value)}: must be the name of a colour map of "
            "matplotlib; write for instance 'viridis'"
        )
    return value


def _size(value: Any) -> tuple[int, int] | None:
    if value is None:
        return None
    where = "render: size"
    width, height = _pair(value, where, "width and height in pixels")
    for given in (width, height):
        if not (100 <= given <= _LARGEST and given == int(given)):
            raise InputError(
                f"{where} = ({width:g}, {height:g}): must be whole numbers of pixels from 100 to "
                f"{_LARGEST}; give for instance (1200, 900)"
            )
    return int(width), int(height)


def _zoom(value: Any) -> float | tuple[float, float, float, float]:
    where = "render: zoom"
    given = plain(value)
    if not isinstance(given, list | tuple):
        return number(given, where, above=0)
    if len(given) != 4:
        raise InputError(
            f"{where} = {show_value(value)}: must be a factor or a box; give 2.0 or "
            "(x0, y0, x1, y1) in m"
        )
    x0, y0, x1, y1 = (number(one, where, unit="m") for one in given)
    if not (x0 < x1 and y0 < y1):
        raise InputError(
            f"{where} = {show_value(value)}: x0 must be below x1 and y0 below y1; swap them"
        )
    return x0, y0, x1, y1


def _background(value: Any) -> str:
    from matplotlib.colors import is_color_like

    if not isinstance(value, str) or not is_color_like(value):
        raise InputError(
            f"render: background = {show_value(value)}: is no colour; give a name such as 'white' "
            "or a code such as '#101820'"
        )
    return value


def _title(value: Any) -> str | None:
    if value is not None and not isinstance(value, str):
        raise InputError(f"render: title = {show_value(value)}: must be text; write it in quotes")
    return value


def nice(length: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that is not above a length."""
    if not length > 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(length))
    return float(max(step * power for step in (1, 2, 5) if step * power <= length * (1 + 1e-12)))
