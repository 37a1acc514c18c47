"""Shapes of bodies, regions and containers."""

from .base import Shape
from .factory import SHAPE_TYPES, make_shape, parameter_forms
from .general import Region, Solid

__all__ = ["SHAPE_TYPES", "Region", "Shape", "Solid", "make_shape", "parameter_forms"]
