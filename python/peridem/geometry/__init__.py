"""Shapes of bodies, regions and containers."""

from .base import Shape
from .factory import SHAPE_TYPES, make_shape, parameter_forms

__all__ = ["SHAPE_TYPES", "Shape", "make_shape", "parameter_forms"]
