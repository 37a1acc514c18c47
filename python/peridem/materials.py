"""Materials of a model: the law of the bonds inside a body and its constants.

References
----------
Jha, Desai, Bhattacharya, Lipton, JMPS 151 (2021) 104376; Silling et al., J. Elasticity 88 (2007).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from .deck import ElasticConstants
from .deck import Material as Block
from .errors import InputError
from .modelling.arguments import checked, choice, number, plain, show_value, validated

__all__ = ["Material", "PDElasticBond", "PDState", "PMBBond", "RNPBond"]

_INFLUENCES = ("constant", "linear", "gaussian")
_KEYS = {
    "density": "Density",
    "horizon": "Horizon",
    "horizon_mesh_ratio": "Horizon_Mesh_Ratio",
    "young_modulus": "E",
    "bulk_modulus": "K",
    "shear_modulus": "G",
    "poisson_ratio": "Poisson_Ratio",
    "fracture_energy": "Gc",
    "fracture_toughness": "KIc",
    "bond_breaking": "Bond_Breaking",
    "plane_strain": "Is_Plane_Strain",
}
ARGUMENTS = {key: argument for argument, key in _KEYS.items()} | {
    "Influence_Function": "influence",
    "Influence_Function.Parameters": "influence",
    "Influence_Function.Parameters[0]": "influence[1]",
    "Influence_Function.Parameters[1]": "influence[2]",
    "Parameters": "influence",
    "Bond_Potential.Parameters": "law_parameters",
    "Bond_Potential": "law_parameters",
    "Compute_From_Classical: false": "law_parameters",
    "Bond_Potential.Check_Sc_Factor": "critical_stretch_factor",
    "Bond_Potential.Irreversible_Bond_Fracture": "irreversible",
}


class Material:
    """A law of bonds with its constants; see `PDState`, `PMBBond`, `RNPBond`, `PDElasticBond`.

    Materials are immutable, equal when all their values are, and can be keys of a dict.

    Attributes
    ----------
    block : peridem.deck.Material
        The block ``Material.Zone_k`` of a deck that says the same.
    name : str or None
        What messages and summaries call it.
    """

    law: ClassVar[str]
    block: Block
    name: str | None

    def _define(
        self,
        values: dict[str, Any],
        influence: Any,
        law_parameters: Any,
        name: Any,
        potential: dict[str, Any] | None = None,
    ) -> None:
        who = self.law if name is None else f"{self.law} {name!r}"
        if name is not None and not isinstance(name, str):
            raise InputError(f"{self.law}: name = {name!r}: must be text; write it in quotes")
        if values["horizon"] is not None and values["horizon_mesh_ratio"] is not None:
            raise InputError(
                f"{who}: horizon_mesh_ratio = {show_value(values['horizon_mesh_ratio'])}: is given "
                "besides horizon; keep one of them"
            )
        content = {_KEYS[argument]: value for argument, value in values.items()}
        bond_potential = dict(potential or {})
        if law_parameters is not None:
            content["Compute_From_Classical"] = False
            bond_potential["Parameters"] = law_parameters
        content |= {
            "Type": self.law,
            "Influence_Function": _influence(influence, who),
            "Bond_Potential": plain(bond_potential) or None,
        }
        object.__setattr__(self, "block", validated(Block, content, who, ARGUMENTS))
        object.__setattr__(self, "name", name)

    @property
    def constants(self) -> ElasticConstants:
        """All elastic constants and the fracture energy, those not given worked out.

        Raises
        ------
        InputError
            If a bond-based law is given by `law_parameters` alone.
        """
        try:
            return self.block.constants()
        except ValueError:
            raise InputError(
                f"{self}: constants: do not follow from law_parameters; give young_modulus or "
                "bulk_modulus as well"
            ) from None

    def with_fracture_energy(self, fracture_energy: float) -> Material:
        """Make the same material with another fracture energy.

        Parameters
        ----------
        fracture_energy : float
            Critical energy release rate Gc [J/m^2]; a fracture toughness is left out.

        Returns
        -------
        Material

        Raises
        ------
        InputError
            If it is not positive, or the law has none or is given by `law_parameters`.
        """
        who = f"{self.label}: fracture_energy"
        energy = number(fracture_energy, who, above=0, unit="J/m^2")
        if self.law == "PDElasticBond" or not self.block.compute_from_classical:
            raise InputError(
                f"{who} = {fracture_energy!r}: the law does not take it; give elastic constants "
                "to a law that breaks"
            )
        made = object.__new__(type(self))
        values = {"fracture_energy": energy, "fracture_toughness": None}
        object.__setattr__(made, "block", self.block.model_copy(update=values))
        object.__setattr__(made, "name", self.name)
        return made

    @property
    def label(self) -> str:
        """The name in quotes, or the law when there is none."""
        return self.law if self.name is None else repr(self.name)

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{self.law}: {name}: materials do not change; make a new one")

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Material)
            and (self.block, self.name) == (other.block, other.name)
            and self.law == other.law
        )

    def __hash__(self) -> int:
        return hash((self.block.model_dump_json(), self.name))

    def __repr__(self) -> str:
        block = self.block
        values = {
            argument: getattr(block, name)
            for name, info in Block.model_fields.items()
            if name in block.model_fields_set
            and (argument := ARGUMENTS.get(str(info.alias))) in _KEYS
            and getattr(block, name) != info.default
        }
        if self.name is not None:
            values["name"] = self.name
        shown = ", ".join(f"{argument}={value!r}" for argument, value in values.items())
        return f"{self.law}({shown})"


def _influence(value: Any, who: str) -> dict[str, Any]:
    """Block of an influence function given by its name, or as (name, parameters...)."""
    given = value if isinstance(value, Sequence) and not isinstance(value, str) else (value,)
    if not given:
        raise InputError(f"{who}: influence = (): is empty; give {', '.join(_INFLUENCES)}")
    name = choice(given[0], _INFLUENCES, f"{who}: influence")
    parameters = plain(list(given[1:]))
    if any(isinstance(one, str) for one in parameters):
        raise InputError(
            f"{who}: influence = {show_value(value)}: parameters must be numbers; correct them"
        )
    return {"Type": _INFLUENCES.index(name), "Parameters": parameters}


class PDState(Material):
    """Ordinary state-based solid: independent bulk and shear moduli, bonds that break.

    Parameters
    ----------
    density : float
        Density [kg/m^3].
    horizon : float, optional
        Horizon [m], usually 3 to 4 mesh sizes; or
    horizon_mesh_ratio : float, optional
        horizon as a multiple of the smallest node distance of each body, which is 0.65 to 0.75 of
        the mesh size that gmsh is given.
    young_modulus, poisson_ratio, bulk_modulus, shear_modulus : float, optional
        Elastic constants [Pa]; exactly one of the pairs (young_modulus, poisson_ratio),
        (bulk_modulus, shear_modulus), (young_modulus, bulk_modulus),
        (young_modulus, shear_modulus).
    fracture_energy : float, optional
        Critical energy release rate Gc [J/m^2]; or
    fracture_toughness : float, optional
        critical stress intensity factor KIc [Pa m^0.5].
    influence : str or tuple
        Weight J of a bond of length a horizon: ``"linear"`` (a0 + a1 a), ``"constant"`` (a0) or
        ``"gaussian"`` (alpha exp(-a^2/beta)); with parameters as ``("gaussian", alpha, beta)``.
        Without them the moment of order d is 1.
    bond_breaking : {"both", "tension"}
        Whether bonds break in compression too.
    law_parameters : sequence of float, optional
        Constants [K, G, s0] of the law itself, instead of elastic and fracture constants.
    plane_strain : bool
        Plane strain instead of plane stress in the output of stresses.
    name : str, optional
        What messages call the material.

    Raises
    ------
    InputError
        If an argument breaks a rule.

    References
    ----------
    Jha et al. (2021), eqs. 9 to 11.
    """

    law = "PDState"

    @checked
    def __init__(
        self,
        *,
        density: float,
        horizon: float | None = None,
        horizon_mesh_ratio: float | None = None,
        young_modulus: float | None = None,
        poisson_ratio: float | None = None,
        bulk_modulus: float | None = None,
        shear_modulus: float | None = None,
        fracture_energy: float | None = None,
        fracture_toughness: float | None = None,
        influence: str | tuple[Any, ...] = "linear",
        bond_breaking: str = "both",
        law_parameters: Sequence[float] | None = None,
        plane_strain: bool = False,
        name: str | None = None,
    ) -> None:
        values = {
            "density": density,
            "horizon": horizon,
            "horizon_mesh_ratio": horizon_mesh_ratio,
            "young_modulus": young_modulus,
            "poisson_ratio": poisson_ratio,
            "bulk_modulus": bulk_modulus,
            "shear_modulus": shear_modulus,
            "fracture_energy": fracture_energy,
            "fracture_toughness": fracture_toughness,
            "bond_breaking": bond_breaking,
            "plane_strain": plane_strain,
        }
        self._define(values, influence, law_parameters, name)


class PMBBond(Material):
    """Prototype microelastic brittle bonds: Poisson's ratio 1/4, bonds that break.

    Parameters
    ----------
    young_modulus, bulk_modulus : float, optional
        One of them [Pa]; contact takes the bulk modulus.
    density, horizon, horizon_mesh_ratio, fracture_energy, fracture_toughness, influence, \
bond_breaking, plane_strain, name
        As in `PDState`.
    law_parameters : sequence of float, optional
        Constants [c, s0] of the law itself.

    Raises
    ------
    InputError
        If an argument breaks a rule.

    References
    ----------
    Silling, Askari, Computers and Structures 83 (2005) 1526.
    """

    law = "PMBBond"

    @checked
    def __init__(
        self,
        *,
        density: float,
        horizon: float | None = None,
        horizon_mesh_ratio: float | None = None,
        young_modulus: float | None = None,
        bulk_modulus: float | None = None,
        fracture_energy: float | None = None,
        fracture_toughness: float | None = None,
        influence: str | tuple[Any, ...] = "linear",
        bond_breaking: str = "both",
        law_parameters: Sequence[float] | None = None,
        plane_strain: bool = False,
        name: str | None = None,
    ) -> None:
        values = {
            "density": density,
            "horizon": horizon,
            "horizon_mesh_ratio": horizon_mesh_ratio,
            "young_modulus": young_modulus,
            "bulk_modulus": bulk_modulus,
            "fracture_energy": fracture_energy,
            "fracture_toughness": fracture_toughness,
            "bond_breaking": bond_breaking,
            "plane_strain": plane_strain,
        }
        self._define(values, influence, law_parameters, name)


class RNPBond(Material):
    """Regularised nonlinear bonds, softening beyond a stretch that depends on their length.

    Parameters
    ----------
    critical_stretch_factor : float
        Bonds break at this multiple of the stretch of largest force.
    irreversible : bool
        Whether bonds break for good.
    law_parameters : sequence of float, optional
        Constants [C, beta] of the law itself.
    young_modulus, bulk_modulus, density, horizon, horizon_mesh_ratio, fracture_energy, \
fracture_toughness, influence, bond_breaking, plane_strain, name
        As in `PMBBond`.

    Raises
    ------
    InputError
        If an argument breaks a rule.

    References
    ----------
    Lipton, J. Elasticity 117 (2014) 21.
    """

    law = "RNPBond"

    @checked
    def __init__(
        self,
        *,
        density: float,
        horizon: float | None = None,
        horizon_mesh_ratio: float | None = None,
        young_modulus: float | None = None,
        bulk_modulus: float | None = None,
        fracture_energy: float | None = None,
        fracture_toughness: float | None = None,
        influence: str | tuple[Any, ...] = "linear",
        bond_breaking: str = "both",
        critical_stretch_factor: float = 1.0,
        irreversible: bool = True,
        law_parameters: Sequence[float] | None = None,
        plane_strain: bool = False,
        name: str | None = None,
    ) -> None:
        values = {
            "density": density,
            "horizon": horizon,
            "horizon_mesh_ratio": horizon_mesh_ratio,
            "young_modulus": young_modulus,
            "bulk_modulus": bulk_modulus,
            "fracture_energy": fracture_energy,
            "fracture_toughness": fracture_toughness,
            "bond_breaking": bond_breaking,
            "plane_strain": plane_strain,
        }
        potential = {
            "Check_Sc_Factor": critical_stretch_factor,
            "Irreversible_Bond_Fracture": irreversible,
        }
        self._define(values, influence, law_parameters, name, potential)


class PDElasticBond(Material):
    """Linear elastic bonds that never break.

    Parameters
    ----------
    law_parameters : sequence of float, optional
        Constant [c] of the law itself.
    young_modulus, bulk_modulus, density, horizon, horizon_mesh_ratio, influence, plane_strain, \
name
        As in `PMBBond`.

    Raises
    ------
    InputError
        If an argument breaks a rule.
    """

    law = "PDElasticBond"

    @checked
    def __init__(
        self,
        *,
        density: float,
        horizon: float | None = None,
        horizon_mesh_ratio: float | None = None,
        young_modulus: float | None = None,
        bulk_modulus: float | None = None,
        influence: str | tuple[Any, ...] = "linear",
        law_parameters: Sequence[float] | None = None,
        plane_strain: bool = False,
        name: str | None = None,
    ) -> None:
        values = {
            "density": density,
            "horizon": horizon,
            "horizon_mesh_ratio": horizon_mesh_ratio,
            "young_modulus": young_modulus,
            "bulk_modulus": bulk_modulus,
            "plane_strain": plane_strain,
        }
        self._define(values, influence, law_parameters, name)
