"""What a step of peridynamics must cost at least: flops and bytes, against the ceilings.

Flops are those of the formulas, counted once for a pair of nodes (the force on j is that on i
turned round), so for a directed bond half of them. Additions, multiplications, divisions, square
roots, comparisons and absolute values count 1, a fused multiply-add 2, an exponential 10. Lanes
without bond, masks and integers do not count: what they cost is part of what the share of the
ceiling tells. In d dimensions, for a pair:

    y = z_j - z_i, |y|^2, 1/|y|, |y|, e = |y| - r                     d + 2d + 1 + 1 + 1
    break test |e| - limit r > 0                                      4
    PDState:  theta: r e J times V_j and times V_i, summed            2 + 2 + 2
              force: J (r (a_i theta_i + a_j theta_j) + e (b_i + b_j))  6
    PMBBond, PDElasticBond: J c e / r                                 3
    RNPBond:  e = (y - xi) . xi / r; J k s exp(-beta r s^2)           3d + 1 + 17
    t V_j and t V_i along y / |y|, summed                             2 + d + 4d

and 6d a node for v += dt f / rho, u += dt v, x += dt v.

Bytes are those that a step has to fetch at least: the tables of the bonds (what the core holds
less the arrays over nodes and the bond lists for users), once for a body that fits into the
second-level cache as a whole and twice for a larger one (theta of all nodes is needed before the
first force of a state-based law), and 25 numbers of 8 bytes a node: x, u, v, f read and written, V.
They come from the nearest memory that holds them all.
"""

from __future__ import annotations

from typing import Any

from peridem import _core

BYTES_PER_NODE = 25 * 8
EXPONENTIAL = 10

PAIR_FLOPS = {
    "PDState": lambda d: (3 * d + 3) + 4 + 6 + 6 + (2 + 5 * d),
    "PMBBond": lambda d: (3 * d + 3) + 4 + 3 + (2 + 5 * d),
    "PDElasticBond": lambda d: (3 * d + 3) + 3 + (2 + 5 * d),  # never breaks
    "RNPBond": lambda d: d + 4 + (3 * d + 1) + 7 + EXPONENTIAL + (2 + 4 * d),
}


def flops_per_bond(law: str, dimension: int, neighbours: float) -> float:
    """Flops for a directed bond in a whole step, its share of the integration with it."""
    return PAIR_FLOPS[law](dimension) / 2 + 6 * dimension / neighbours


def table_bytes(nodes: int, bonds: int, memory_bytes: int) -> float:
    """Bytes of the tables that the force loops pass."""
    costs = _core.memory_costs()
    return float(max(0, memory_bytes - nodes * costs["node"] - bonds * costs["bond"]))


def roofline(result: dict[str, Any], ceilings: dict[str, Any], caches: dict[str, int]) -> Any:
    """Flops, bytes and the least time of a peridynamics case, and the share of it; None without.

    Returns
    -------
    dict
        ``flops_per_bond``, ``bytes_per_bond``, ``least_ns_per_bond`` of one core, the ceiling
        that sets it (``bound``), ``share`` of it that the measured step reaches, ``share_of_flops``
        alone, which does not depend on how the core keeps its tables, and ``gflop_s``, ``gb_s``
        reached by a core.
    """
    if not ceilings or result["kind"] != "force" or result["threads"] > 1:
        return None
    options, nodes, bonds = result["options"], result["nodes"], result["bonds"]
    law, dimension = options.get("law", "PDState"), options.get("dimension", 2)
    flops = flops_per_bond(law, dimension, result["neighbours"])
    tables = table_bytes(nodes, bonds, result["memory_bytes"])
    passes = 2 if options["count"] == 1 and law == "PDState" else 1
    total = passes * tables + BYTES_PER_NODE * nodes
    held = tables + BYTES_PER_NODE * nodes
    level = next((name for name in ("L2", "L3") if held <= 0.5 * caches.get(name, 0)), "memory")
    peak = ceilings["fma_gflop_s"].get(result["instruction_set"])
    if peak is None:
        return None
    bandwidth = ceilings[f"{level.lower()}_gb_s"]["read"]
    by_flops, by_bytes = flops / peak, total / bonds / bandwidth
    least = max(by_flops, by_bytes)
    measured = result["ns_per_bond"]["median"]
    return {
        "flops_per_bond": flops,
        "bytes_per_bond": total / bonds,
        "least_ns_per_bond": least,
        "bound": "flops" if by_flops >= by_bytes else level,
        "share": least / measured,
        "share_of_flops": by_flops / measured,
        "gflop_s": flops / measured,
        "gb_s": total / bonds / measured,
    }
