"""`Bonds`: the bond lists of a model as arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


class Bonds:
    """Bonds of all nodes in compressed rows, both directions of a bond listed.

    The bonds of node i are those from ``offsets[i]`` to ``offsets[i + 1] - 1``. Empty before
    `DEMModel.init`.

    Parameters
    ----------
    core : _core.DEMModel
        The core model.
    """

    def __init__(self, core: Any) -> None:
        self._core = core
        self._table = core.bonds

    def __len__(self) -> int:
        """Count the directed bonds."""
        return len(self.indices)

    @property
    def offsets(self) -> NDArray[np.int64]:
        """Start of each node's bonds, shape (n_nodes + 1,), a read-only view."""
        return self._table.offsets  # type: ignore[no-any-return]

    @property
    def indices(self) -> NDArray[np.int32]:
        """Node at the other end of each bond, shape (n_bonds,), a read-only view."""
        return self._table.indices  # type: ignore[no-any-return]

    @property
    def intact(self) -> NDArray[np.uint8]:
        """1 for each bond that holds, 0 for a broken one, shape (n_bonds,), a read-only view.

        `set_intact` changes it.
        """
        return self._table.intact  # type: ignore[no-any-return]

    @property
    def length(self) -> NDArray[np.float64]:
        """Length r = abs(X_j - X_i) [m] of each bond, shape (n_bonds,); computed when asked."""
        return np.ascontiguousarray(self._core.bond_constants()[:, 0])

    @property
    def weight(self) -> NDArray[np.float64]:
        """Weight J(r/eps) V_j of each bond, shape (n_bonds,); computed when asked.

        V_j [m^3], per unit thickness in 2D, with the partial-volume correction.
        """
        return np.ascontiguousarray(self._core.bond_constants()[:, 1])

    def set_intact(self, intact: NDArray[np.uint8]) -> None:
        """Set the flag of every bond, for example to cut a notch.

        Parameters
        ----------
        intact : ndarray of uint8, shape (n_bonds,)
            1 or 0 for each bond; the two directions of a bond must agree.

        Raises
        ------
        InputError
            If the number of flags is wrong or two directions differ.
        """
        self._core.set_intact(np.ascontiguousarray(intact, dtype=np.uint8))
