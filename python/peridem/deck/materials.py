"""Schema of the blocks Material and Contact."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from annotated_types import Gt, Le, Len, Lt

from .fields import (
    REQUIRED,
    Block,
    Count,
    Flag,
    Integer,
    NonNegative,
    Number,
    Numbered,
    Numbers,
    Positive,
    key,
)

_PAIRS = (("E", "K"), ("E", "G"), ("E", "Poisson_Ratio"), ("K", "G"))
#: Names of Bond_Potential.Parameters with Compute_From_Classical: false.
DIRECT_CONSTANTS = {
    "PDState": ("K", "G", "s0"),
    "PMBBond": ("c", "s0"),
    "RNPBond": ("C", "beta"),
    "PDElasticBond": ("c",),
}
_BOND_POISSON_RATIO = 0.25


@dataclass(frozen=True)
class ElasticConstants:
    """Elastic and fracture constants of a material, all of them.

    Attributes
    ----------
    e, k, g, lame : float
        Young's modulus, bulk modulus, shear modulus and Lame's first parameter [Pa].
    nu : float
        Poisson's ratio.
    gc : float or None
        Critical energy release rate [J/m^2]; None when neither Gc nor KIc is given.
    """

    e: float
    k: float
    g: float
    nu: float
    lame: float
    gc: float | None

    @property
    def usable(self) -> bool:
        """Whether all moduli are finite, positive and distinct enough for a Poisson ratio."""
        moduli = (self.e, self.k, self.g)
        return all(0 < value < float("inf") for value in moduli) and -1 < self.nu < 0.5


class InfluenceFunction(Block):
    """Material.Zone_k.Influence_Function: the weight J of a bond of normalised length a."""

    type: Literal[0, 1, 2] = key(
        "Type",
        "0 (constant a0), 1 (linear a0 + a1 a) or 2 (Gaussian alpha exp(-a^2/beta))",
        default=0,
    )
    parameters: Numbers = key(
        "Parameters", "nothing, or [a0], [a0, a1] or [alpha, beta]", default=()
    )

    def rules(self) -> Iterator[tuple[str, str]]:
        """Yield what is wrong with the parameters."""
        n = len(self.parameters)
        if n not in ((0, 1), (0, 1, 2), (0, 2))[self.type]:
            wanted = ("none or [a0]", "none, [a0] or [a0, a1]", "none or [alpha, beta]")
            yield "Parameters", f"must be {wanted[self.type]} for Type {self.type}; has {n} numbers"
        elif n and self.parameters[0] <= 0:
            yield "Parameters[0]", "must be positive; the weight of a bond is"
        elif self.type == 2 and n and self.parameters[1] <= 0:
            yield "Parameters[1]", "must be positive; give the width beta of the Gaussian"


class BondPotential(Block):
    """Material.Zone_k.Bond_Potential: constants of the bond law."""

    type: Integer = key(
        "Type", "a number", default=0, ignored="the law follows from Material.Zone_k.Type"
    )
    check_sc_factor: Positive = key(
        "Check_Sc_Factor", "the factor on the critical stretch (RNPBond)", default=1.0
    )
    irreversible_bond_fracture: Flag = key(
        "Irreversible_Bond_Fracture", "whether bonds break for good (RNPBond)", default=True
    )
    parameters: Numbers = key(
        "Parameters",
        "[K, G, s0] (PDState), [c, s0] (PMBBond), [C, beta] (RNPBond) or [c] (PDElasticBond)",
        default=(),
    )


class StatePotential(Block):
    """Material.Zone_k.State_Potential: accepted, without effect."""

    type: Integer = key("Type", "a number", default=0, ignored="PDState has one law")
    contribution_from_broken_bond: Flag = key(
        "Contribution_From_Broken_Bond",
        "true or false",
        default=True,
        ignored="broken bonds carry no state-based force",
    )
    parameters: Numbers = key(
        "Parameters", "numbers", default=(), ignored="see Bond_Potential.Parameters"
    )


class Material(Block):
    """Material.Zone_k: the law of the zone's bodies and its constants."""

    retired: ClassVar[dict[str, str]] = {
        "Lambda": "no law uses it: give two of E, K, G, Poisson_Ratio",
        "Mu": "no law uses it: give G",
    }
    synonyms: ClassVar[dict[str, str]] = {"nu": "Poisson_Ratio", "Nu": "Poisson_Ratio"}

    type: Literal["PDState", "PMBBond", "RNPBond", "PDElasticBond"] = key(
        "Type", "the material law", default=REQUIRED
    )
    density: Positive = key("Density", "the density", unit="kg/m^3", default=REQUIRED)
    horizon: Positive | None = key(
        "Horizon",
        "the horizon",
        unit="m",
        remedy="give the horizon in metres, e.g. 3 to 4 mesh sizes",
    )
    horizon_mesh_ratio: Positive | None = key(
        "Horizon_Mesh_Ratio", "the horizon as a multiple of the body's mesh size, e.g. 3"
    )
    compute_from_classical: Flag = key(
        "Compute_From_Classical",
        "whether the law's constants follow from elastic ones",
        default=True,
    )
    young_modulus: Positive | None = key("E", "Young's modulus", unit="Pa")
    bulk_modulus: Positive | None = key("K", "the bulk modulus", unit="Pa")
    shear_modulus: Positive | None = key("G", "the shear modulus", unit="Pa")
    poisson_ratio: Annotated[Number, Gt(-1), Lt(0.5)] | None = key(
        "Poisson_Ratio", "Poisson's ratio, between -1 and 0.5"
    )
    fracture_energy: Positive | None = key("Gc", "the critical energy release rate", unit="J/m^2")
    fracture_toughness: Positive | None = key(
        "KIc", "the critical stress intensity factor", unit="Pa m^0.5"
    )
    influence_function: InfluenceFunction = key(
        "Influence_Function", "the weight of a bond", default=InfluenceFunction()
    )
    bond_potential: BondPotential = key(
        "Bond_Potential", "constants of the bond law", default=BondPotential()
    )
    state_potential: StatePotential | None = key(
        "State_Potential", "a block", ignored="PDState has one law"
    )
    is_plane_strain: Flag = key(
        "Is_Plane_Strain", "plane strain (true) or stress (false) in Strain_Stress", default=False
    )
    bond_breaking: Literal["both", "tension"] = key(
        "Bond_Breaking",
        "whether bonds break in compression too, or in tension only",
        default="both",
    )

    @property
    def state_based(self) -> bool:
        """Whether the law is state-based (PDState)."""
        return self.type == "PDState"

    def rules(self) -> Iterator[tuple[str, str]]:
        """Yield what is wrong with horizon, elastic and fracture constants."""
        if self.horizon is None and self.horizon_mesh_ratio is None:
            yield "Horizon", "missing; give the horizon in metres, e.g. 3 to 4 mesh sizes"
        if not self.compute_from_classical:
            yield from self._direct_rules()
        elif self.state_based:
            yield from self._pair_rules()
            yield from self._fracture_rules()
        else:
            if self.young_modulus is None and self.bulk_modulus is None:
                yield "E", f"missing; {self.type} needs Young's modulus E or the bulk modulus K"
            if self.type != "PDElasticBond":
                yield from self._fracture_rules()

    def _given(self) -> tuple[str, ...]:
        values = {
            "E": self.young_modulus,
            "K": self.bulk_modulus,
            "G": self.shear_modulus,
            "Poisson_Ratio": self.poisson_ratio,
        }
        return tuple(name for name, value in values.items() if value is not None)

    def _pair_rules(self) -> Iterator[tuple[str, str]]:
        given = self._given()
        pairs = ", ".join(f"({a}, {b})" for a, b in _PAIRS)
        if given not in _PAIRS:
            have = f"has {' and '.join(given)}" if given else "has none of them"
            yield "", f"PDState needs exactly one pair of elastic constants, {have}; give {pairs}"
        elif given == ("E", "K") and self.constants().nu <= -1:
            yield "E", "must be below 9 K, or G is not positive; check E and K"
        elif given == ("E", "G") and self.constants().nu >= 0.5:
            yield "E", "must be below 3 G, or K is not positive; check E and G"
        elif not self.constants().usable:
            names = " and ".join(given)
            yield given[-1], f"does not fit {given[0]}: no finite moduli follow; check {names}"

    def _fracture_rules(self) -> Iterator[tuple[str, str]]:
        if self.fracture_energy is None and self.fracture_toughness is None:
            yield "Gc", "missing; give Gc in J/m^2 (or KIc in Pa m^0.5)"
        elif self.fracture_energy is not None and self.fracture_toughness is not None:
            yield "KIc", "is given besides Gc; keep one of them"

    def _direct_rules(self) -> Iterator[tuple[str, str]]:
        names = DIRECT_CONSTANTS[self.type]
        path = "Bond_Potential.Parameters"
        values = self.bond_potential.parameters
        wanted = f"[{', '.join(names)}] for {self.type} with Compute_From_Classical: false"
        if not values:
            yield path, f"missing; give {wanted}"
        elif len(values) != len(names):
            yield path, f"must be {wanted}; has {len(values)} numbers"
        else:
            for position, name in enumerate(names):
                if values[position] <= 0:
                    yield f"{path}[{position}]", f"must be positive; give the constant {name}"
            if self.state_based and min(values) > 0 and not self.constants().usable:
                yield path, "K and G do not fit: no finite moduli follow; check both"

    def constants(self) -> ElasticConstants:
        """All elastic constants from those given.

        Returns
        -------
        ElasticConstants
            For bond-based laws nu = 1/4 and E, else K, decides; a K that is given is kept, for
            contact. With Compute_From_Classical false: from K and G of Bond_Potential (PDState).

        Raises
        ------
        ValueError
            When they do not follow: a bond-based law without classical constants, E or K.
        """
        if not self.state_based:
            return self._bond_constants()
        e, k, g, nu = self.young_modulus, self.bulk_modulus, self.shear_modulus, self.poisson_ratio
        if not self.compute_from_classical:
            k, g = self.bond_potential.parameters[:2]
            return self._from_e_nu(9 * k * g / (3 * k + g), (3 * k - 2 * g) / (6 * k + 2 * g), k, g)
        if k is not None and g is not None:
            e = 9 * k * g / (3 * k + g)
            nu = (3 * k - 2 * g) / (6 * k + 2 * g)
        elif e is not None and k is not None:
            nu = (3 * k - e) / (6 * k)
        elif e is not None and g is not None:
            nu = e / (2 * g) - 1
        if e is None or nu is None:
            raise ValueError("two elastic constants are needed")
        return self._from_e_nu(e, nu, k, g)

    def _bond_constants(self) -> ElasticConstants:
        nu = _BOND_POISSON_RATIO
        e, k = self.young_modulus, self.bulk_modulus
        if e is None and k is not None:
            e = 3 * k * (1 - 2 * nu)
        if e is None:
            raise ValueError("E or K is needed")
        return self._from_e_nu(e, nu, k, None)

    def _from_e_nu(self, e: float, nu: float, k: float | None, g: float | None) -> ElasticConstants:
        # Limits such as E = 9 K give zero denominators; they are refused by the rules.
        denominator = 3 * (1 - 2 * nu)
        shear = 2 * (1 + nu)
        gc = self.fracture_energy
        if gc is None and self.fracture_toughness is not None:
            gc = self.fracture_toughness * self.fracture_toughness / e
        infinity = float("inf")
        return ElasticConstants(
            e=e,
            k=k if k is not None else (e / denominator if denominator else infinity),
            g=g if g is not None else (e / shear if shear else infinity),
            nu=nu,
            lame=e * nu * 6 / (shear * denominator) if shear * denominator else infinity,
            gc=gc,
        )


class MaterialCopy(Block):
    """Material.Zone_k that copies another zone."""

    stray: ClassVar[str] = (
        "has no effect beside Copy_Material_Data, which takes the whole block; remove one of them"
    )

    copy_material_data: Count = key(
        "Copy_Material_Data", "the number of the zone to copy, from 1", default=REQUIRED
    )


class MaterialZones(Block):
    """Material: the material of each zone."""

    numbered: ClassVar[Numbered | None] = Numbered(
        "Zone_k", Material, MaterialCopy, "Copy_Material_Data"
    )


class Contact(Block):
    """Contact.Zone_ij: the contact law between bodies of zones i and j."""

    contact_radius_factor: Positive | None = key(
        "Contact_Radius_Factor",
        "the contact radius as a multiple of the smallest mesh size; 0.95 when no radius is given",
    )
    contact_radius: Positive | None = key("Contact_Radius", "the contact radius", unit="m")
    kn: NonNegative | None = key(
        "Kn",
        "the normal stiffness; 18 kappa/(pi eps^5) when left out",
        unit="N/m^7",
        remedy="give the normal stiffness in N/m^7, or leave it out for 18 kappa/(pi eps^5)",
    )
    kn_factor: NonNegative = key("Kn_Factor", "the factor on Kn", default=1.0)
    damping_on: Flag = key("Damping_On", "whether there is normal damping", default=True)
    epsilon: Annotated[Number, Gt(0), Le(1)] | None = key(
        "Epsilon", "the coefficient of restitution, above 0 and at most 1"
    )
    beta_n_factor: NonNegative = key(
        "Beta_n_Factor", "the factor on the damping coefficient", default=1.0
    )
    friction_on: Flag = key("Friction_On", "whether there is friction", default=True)
    friction_coeff: NonNegative | None = key("Friction_Coeff", "the friction coefficient")
    center_damping_criterion: Literal["centers", "nodes"] = key(
        "Center_Damping_Criterion",
        "whether damping acts when centres or when nodes are close",
        default="centers",
    )
    node_damping: Flag = key("Node_Damping", "whether nodes are damped too", default=False)
    friction_model: Literal["slip", "history"] = key(
        "Friction_Model",
        "the friction law: along the momentary slip, or a tangential spring with Coulomb's cap",
        default="slip",
    )
    tangential_stiffness_ratio: Positive | None = key(
        "Tangential_Stiffness_Ratio",
        "the tangential stiffness as a fraction of Kn (Friction_Model: history); 2/7 when left out",
    )
    self_contact: Flag = key(
        "Self_Contact",
        "whether nodes of one body that were never bonded to each other touch (Zone_ii only)",
        default=False,
    )
    v_max: Positive | None = key("V_Max", "a velocity", unit="m/s", ignored="give Kn")
    delta_max: Positive | None = key("Delta_Max", "a length", unit="m", ignored="give Kn")

    def rules(self) -> Iterator[tuple[str, str]]:
        """Yield what damping, friction and stiffness lack."""
        if self.damping_on and self.beta_n_factor > 0 and self.epsilon is None:
            yield "Epsilon", "missing; damping needs it: give it, or Damping_On: false"
        if self.friction_on and self.friction_coeff is None:
            yield "Friction_Coeff", "missing; friction needs it: give it, or Friction_On: false"
        if self.contact_radius is not None and self.contact_radius_factor is not None:
            yield "Contact_Radius", "is given besides Contact_Radius_Factor; keep one of them"
        if self.kn is None:
            for name, value in (("V_Max", self.v_max), ("Delta_Max", self.delta_max)):
                if value is not None:
                    yield (
                        name,
                        "no stiffness follows from it (without Kn the original has no contact at "
                        f"all); give Kn in N/m^7, or remove {name} for Kn = 18 kappa/(pi eps^5)",
                    )

    def remarks(self) -> Iterator[tuple[str, str]]:
        """Yield V_Max and Delta_Max beside Kn, and settings of a friction that is not used."""
        for name, value in (("V_Max", self.v_max), ("Delta_Max", self.delta_max)):
            if value is not None:
                yield name, "has no effect beside Kn"
        if self.tangential_stiffness_ratio is not None and self.friction_model != "history":
            yield "Tangential_Stiffness_Ratio", "has no effect without Friction_Model: history"
        elif self.friction_model == "history" and not self.friction_on:
            yield "Friction_Model", "has no effect with Friction_On: false"


class ContactCopy(Block):
    """Contact.Zone_ij that copies another pair."""

    stray: ClassVar[str] = (
        "has no effect beside Copy_Contact_Data, which takes the whole block; remove one of them"
    )

    copy_contact_data: Annotated[tuple[Count, ...], Len(2, 2)] = key(
        "Copy_Contact_Data", "the pair of zones to copy, e.g. [1, 2]", default=REQUIRED
    )


class ContactZones(Block):
    """Contact: the contact law of each pair of zones i <= j."""

    numbered: ClassVar[Numbered | None] = Numbered(
        "Zone_ij", Contact, ContactCopy, "Copy_Contact_Data"
    )

    default_pair: Annotated[tuple[Count, ...], Len(2, 2)] | None = key(
        "Default_Pair", "the pair whose contact law all pairs have that are not given, e.g. [1, 1]"
    )
