"""How much of its height does a rebound keep, by material, size and damping?

Problem: two-particle tests 6 to 10 of Jha et al. (2021), Table 3: a disc falls 1 mm onto a fixed
one of the same or another radius and material, without damping and with a damping ratio of 0.95.
The stiffer the material, the more is lost: damping grows with the root of the stiffness (eq. 27).
Materials of Table 1, contact by eqs. 17, 18 and 36, restitution by eq. 37.

    python examples/two_materials.py [--short] [--output DIR]

writes study.csv (restitution of each test) and two_materials.png (beside that of the paper).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import peridem as pd
from matplotlib.figure import Figure

M1 = pd.PDState(
    density=1200, bulk_modulus=2.16e7, shear_modulus=1.296e7, fracture_energy=50, horizon=6e-4
)
M2 = pd.PDState(
    density=1200, bulk_modulus=2e9, shear_modulus=1.2e9, fracture_energy=500, horizon=6e-4
)
TESTS = {  # materials and radii [m] of the lower and the upper disc, restitution in the paper
    6: ((M1, M1), (3e-3, 1e-3), 0.935),
    7: ((M2, M2), (1e-3, 1e-3), 0.744),
    8: ((M2, M2), (3e-3, 1e-3), 0.716),
    9: ((M2, M1), (1e-3, 1e-3), 0.925),
    10: ((M2, M1), (3e-3, 1e-3), 0.914),
}
HEIGHT = 1e-3  # of the fall [m]


def rebound(test: int, damping_ratio: float) -> dict[str, float]:
    """Restitution of a test, for the study; damping between centres, as in the program."""
    materials, radii, _ = TESTS[test]
    found = pd.calibrate.measure_restitution(
        materials,
        radius=radii,
        mesh_size=0.2e-3,
        height=HEIGHT,
        damping_ratio=damping_ratio,
        damping_factor=100,
        damping_criterion="centers",
    )
    return {"restitution": found.value}


def main() -> None:
    """Run all tests, compare with the paper, plot."""
    parser = argparse.ArgumentParser(description="Rebound of grains of different materials")
    parser.add_argument("--short", action="store_true", help="two tests")
    parser.add_argument("--output", type=Path, default=Path("two_materials"))
    args = parser.parse_args()
    tests = [6, 7] if args.short else list(TESTS)
    grid = {"test": tests, "damping_ratio": [1.0, 0.95]}
    table = pd.study(rebound, grid=grid, folder=args.output, workers=0)

    found = table.pivot_table(values="restitution", index="test", columns="damping_ratio")
    found["paper"] = [TESTS[test][2] for test in tests]
    for test, row in found.iterrows():
        print(f"test {test}: {row[1.0]:.3f} undamped, {row[0.95]:.3f} damped; ", end="")
        print(f"paper: 1 and {row['paper']:.3f}")
    names = {(M1, M1): "soft on soft", (M2, M2): "stiff on stiff", (M2, M1): "soft on stiff"}
    labels = [f"{names[TESTS[k][0]]}\n{1e3 * TESTS[k][1][0]:g} mm below" for k in tests]
    axes = Figure(figsize=(8, 4)).subplots()
    axes.plot(labels, found[1.0], "o", label="no damping")
    axes.plot(labels, found[0.95], "s", label="damping ratio 0.95")
    axes.plot(labels, found["paper"], "k_", markersize=22, label="paper, damping ratio 0.95")
    axes.set(ylabel="coefficient of restitution", ylim=(0.6, 1.05))
    axes.margins(x=0.1)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.12))
    axes.figure.savefig(args.output / "two_materials.png", dpi=150, bbox_inches="tight")


if __name__ == "__main__":
    main()
