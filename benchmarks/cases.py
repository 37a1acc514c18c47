"""What is measured: the cases of the suite, by group."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

NEIGHBOURS = {2: 45.0, 3: 78.0}
"""Mean number of neighbours of a node: those of the paper's meshes, and of LAMMPS's 3D ones."""

GRAIN_NODES = {2: 205, 3: 350}
"""Nodes of a grain: 403 grains of Figure 24 have 82,430 nodes."""

FIGURE_24 = (25, 51, 96, 200, 403)
"""Numbers of grains in Figure 24 of Jha et al. 2021."""

GROUPS = {
    "peridynamics": "Peridynamics alone: grains out of reach of each other, or one body",
    "laws": "Other materials, and broken bonds",
    "contact": "Contact alone: 400 grains that touch, moved by hand",
    "steps": "Whole steps",
    "figure24": "Whole steps, growth with the number of grains (205 nodes each)",
    "threads": "Whole steps on several threads",
    "simd": "Instruction sets",
    "setup": "From the files of a deck to the first forces",
    "decks": "Whole steps of the decks asked for",
}


@dataclass(frozen=True)
class Case:
    """A case: a scene (see scenes.py) or a deck, and what to measure of it.

    `kind` is "step" (whole steps), "force" (whole steps, and the peridynamic forces alone),
    "contact" (contact forces while the grains move `rate` node distances a step) or "setup".
    `rounds` bounds the number of processes that measure it: large models are built once.
    """

    name: str
    group: str
    kind: str
    scene: str = "grains"
    options: dict[str, Any] = field(default_factory=dict)
    threads: int = 1
    simd: str = ""
    rate: float = 0.0
    deck: str = ""
    skip: int = 0
    rounds: int = 99

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


def thread_counts(cores: int) -> list[int]:
    """1, 2, 4, ... and all cores."""
    counts = {1, cores}
    k = 2
    while k < cores:
        counts.add(k)
        k *= 2
    return sorted(counts)


def _model(nodes: int, dimension: int, layout: str, **more: Any) -> dict[str, Any]:
    """Options of `scenes.grains` for so many nodes, in grains out of reach or as one body."""
    each = GRAIN_NODES[dimension] if layout == "grains" else nodes
    return {
        "count": max(1, round(nodes / each)),
        "nodes": each,
        "neighbours": NEIGHBOURS[dimension],
        "dimension": dimension,
        "gap": 10.0,
        **more,
    }


def _peridynamics() -> Iterator[Case]:
    for dimension in (2, 3):
        for layout in ("grains", "body"):
            for power in (4, 5, 6):
                yield Case(
                    f"pd{dimension}d_{layout}_1e{power}",
                    "peridynamics",
                    "force",
                    options=_model(10**power, dimension, layout),
                    rounds=1 if power == 6 else 99,
                )


def _laws() -> Iterator[Case]:
    for dimension in (2, 3):
        for layout in ("grains", "body"):
            for percent in (10, 50):
                yield Case(
                    f"pd{dimension}d_{layout}_1e5_broken{percent}",
                    "laws",
                    "force",
                    options=_model(10**5, dimension, layout, broken=percent / 100),
                )
        for law in ("PMBBond", "RNPBond", "PDElasticBond"):
            name = f"{law.lower()}{dimension}d_grains_1e5"
            options = _model(10**5, dimension, "grains", law=law)
            yield Case(name, "laws", "force", options=options)
    yield Case(
        "pmbbond2d_grains_1e5_broken50",
        "laws",
        "force",
        options=_model(10**5, 2, "grains", law="PMBBond", broken=0.5),
    )
    yield Case(
        "pd2d_body_1e5_shuffled",
        "laws",
        "force",
        options=_model(10**5, 2, "body", order="random"),
    )


def _touching(count: int, dimension: int = 2, **more: Any) -> dict[str, Any]:
    return {
        "count": count,
        "nodes": GRAIN_NODES[dimension],
        "neighbours": NEIGHBOURS[dimension],
        "dimension": dimension,
        **more,
    }


def _contact(cores: int) -> Iterator[Case]:
    # The paper's grains move about 2e-4 node distances in a step.
    for label, rate in (("slow", 2e-4), ("fast", 2e-3)):
        for threads in sorted({1, cores}):
            name = f"contact2d_{label}" + (f"_t{threads}" if threads > 1 else "")
            options = _touching(400)
            yield Case(name, "contact", "contact", options=options, rate=rate, threads=threads)
        options = _touching(216, 3)
        yield Case(f"contact3d_{label}", "contact", "contact", options=options, rate=rate)


TWO_CIRCLES = {"count": 2, "nodes": 123, "neighbours": 27.9}
COMPRESSION_SMALL = {"columns": 5, "rows": 3, "count": 15}
COMPRESSION_LARGE = {"columns": 22, "rows": 16, "count": 350}


def _steps(cores: int) -> Iterator[Case]:
    yield Case("two_circles", "steps", "step", options=TWO_CIRCLES)
    yield Case("compression_small", "steps", "step", "compression", COMPRESSION_SMALL)
    for threads in sorted({1, cores}):
        name = "compression_large" + (f"_t{threads}" if threads > 1 else "")
        yield Case(name, "steps", "step", "compression", COMPRESSION_LARGE, threads=threads)
    yield Case("spheres_216", "steps", "step", options=_touching(216, 3))


def _figure24() -> Iterator[Case]:
    for count in (*FIGURE_24, 4000):
        rounds = 1 if count == 4000 else 99
        yield Case(f"grains_{count}", "figure24", "step", options=_touching(count), rounds=rounds)


def _threads(cores: int) -> Iterator[Case]:
    for threads in thread_counts(cores)[1:]:
        grains = _touching(403)
        yield Case(f"grains_403_t{threads}", "threads", "step", options=grains, threads=threads)
        yield Case(
            f"pd2d_body_1e6_t{threads}",
            "threads",
            "force",
            options=_model(10**6, 2, "body"),
            threads=threads,
            rounds=1,
        )


def _simd() -> Iterator[Case]:
    for dimension in (2, 3):
        for simd in ("avx512", "avx2", "baseline"):
            options = _model(10**5, dimension, "grains")
            yield Case(
                f"pd{dimension}d_grains_1e5_{simd}", "simd", "force", options=options, simd=simd
            )


def _setup() -> Iterator[Case]:
    yield Case("setup_compression_large", "setup", "setup", "compression", COMPRESSION_LARGE)
    yield Case("setup_grains_403", "setup", "setup", options=_touching(403))
    yield Case("setup_spheres_216", "setup", "setup", options=_touching(216, 3))
    body = _model(10**5, 2, "body")
    yield Case("setup_body_1e5", "setup", "setup", options=body, rounds=1)


def all_cases(cores: int | None = None) -> list[Case]:
    """Every case of the suite for a machine with so many cores."""
    if cores is None:
        cores = len(os.sched_getaffinity(0))
    return [
        *_peridynamics(),
        *_laws(),
        *_contact(cores),
        *_steps(cores),
        *_figure24(),
        *_threads(cores),
        *_simd(),
        *_setup(),
    ]


QUICK = ("pd2d_grains_1e4", "pd3d_grains_1e4", "two_circles", "compression_small", "contact2d_slow")
"""What --quick runs when nothing is named."""


def deck_case(path: Path, threads: int, skip: int) -> Case:
    """The case of a deck."""
    name = f"{path.resolve().parent.name}/{path.stem}" + (f"_t{threads}" if threads > 1 else "")
    return Case(
        name, "decks", "step", deck=str(path.resolve()), scene="deck", threads=threads, skip=skip
    )
