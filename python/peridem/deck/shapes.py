"""The keys that describe a shape, common to bodies, regions and the container."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Literal

from peridem.geometry import SHAPE_TYPES

from .fields import REQUIRED, Block, Numbers, key

if TYPE_CHECKING:
    ShapeType = str
else:
    ShapeType = Literal[SHAPE_TYPES]


class ShapeKeys(Block):
    """Type, Parameters and, for `complex`, the parts of a shape."""

    type: ShapeType | None = key("Type", "the name of the shape")
    parameters: Numbers | None = key("Parameters", "the list of the shape's lengths", unit="m")
    vec_type: tuple[ShapeType, ...] | None = key(
        "Vec_Type", "the list of the shapes that make up a complex one"
    )
    vec_flag: tuple[Literal["plus", "minus"], ...] | None = key(
        "Vec_Flag", "plus or minus for each shape of Vec_Type"
    )

    def rules(self) -> Iterator[tuple[str, str]]:
        """Yield what is missing for the shape's type."""
        if self.type is not None and not self.parameters:
            yield "Parameters", f"missing; give the lengths of the {self.type} in m"
        parts = {"Vec_Type": self.vec_type, "Vec_Flag": self.vec_flag}
        if self.type != "complex":
            for name, part in parts.items():
                if part is not None:
                    yield name, f"belongs to Type: complex, not to {self.type}; remove it"
            return
        for name, part in parts.items():
            if not part:
                yield name, "missing; a complex shape needs Vec_Type and Vec_Flag"
        if self.vec_type and self.vec_flag and len(self.vec_type) != len(self.vec_flag):
            yield "Vec_Flag", f"must have one entry for each of the {len(self.vec_type)} Vec_Type"


class Geometry(ShapeKeys):
    """A shape where one is obligatory."""

    type: ShapeType = key("Type", "the name of the shape", default=REQUIRED)
