"""The original's comparison, with a relative tolerance: it decides where thresholds lie."""

import numpy as np

TOLERANCE = 1e-5


def greater(a, b):
    """Whether a > b by more than 1e-5 of the larger."""
    return (a - b) > TOLERANCE * np.maximum(np.abs(a), np.abs(b))


def less(a, b):
    """Whether a < b by more than 1e-5 of the larger."""
    return greater(b, a)
