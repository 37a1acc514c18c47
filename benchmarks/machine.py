"""The machine: what it is, how busy it is, and what it can do at most."""

from __future__ import annotations

import json
import os
import platform
import re
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import peridem
from peridem import _core

HERE = Path(__file__).resolve().parent
FLAGS = ("-std=c++20", "-O3", "-ffp-contract=off", "-pthread")
"""Those of the core (CMakeLists.txt); `-march=native` comes on top where the compiler knows it."""

L2_BYTES, L3_BYTES = 1 << 19, 1 << 23
"""Caches where the system does not say."""


def _first_line(*command: str) -> str:
    if shutil.which(command[0]) is None:
        return ""
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=HERE)
    return done.stdout.splitlines()[0] if done.stdout else ""


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return platform.processor() or platform.machine()
    found = re.search(r"model name\s*:\s*(.+)", text)
    return found.group(1) if found else platform.machine()


def caches() -> dict[str, int]:
    """Bytes of the caches of the first core, by name."""
    sizes = {}
    for folder in sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        try:
            kind = (folder / "type").read_text().strip()
            level = (folder / "level").read_text().strip()
            text = (folder / "size").read_text().strip()
        except OSError:
            continue
        if kind != "Instruction" and text.endswith("K"):
            sizes[f"L{level}"] = 1024 * int(text[:-1])
    return sizes


def core_compiler() -> str:
    """The compiler that built the core, as it signed the library."""
    data = Path(_core.__file__).read_bytes()
    found = re.search(rb"(GCC: \([^\x00]*|clang version [^\x00]*)\x00", data)
    return found.group(1).decode(errors="replace") if found else ""


def commit() -> str:
    """The git commit of the source, with a + when files have changed since."""
    name = _first_line("git", "rev-parse", "HEAD")
    changed = _first_line("git", "status", "--porcelain", "--untracked-files=no")
    return name + ("+" if name and changed else "")


def machine() -> dict[str, Any]:
    """What the figures depend on."""
    return {
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)),
        "caches": caches(),
        "memory_bytes": os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"),
        "system": platform.platform(),
        "core_compiler": core_compiler(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "peridem": peridem.__version__,
        "commit": commit(),
        "variables": {k: v for k, v in os.environ.items() if k.startswith(("OMP_", "PERIDEM_"))},
    }


def load() -> list[float]:
    """Processes that want to run, averaged over 1, 5 and 15 minutes."""
    return [round(value, 2) for value in os.getloadavg()]


def _compile(folder: Path) -> tuple[Path, dict[str, str]] | None:
    compiler = os.environ.get("CXX") or next(
        (name for name in ("c++", "g++", "clang++") if shutil.which(name)), None
    )
    if compiler is None:
        return None
    program = folder / "ceilings"
    for native in (("-march=native",), ("-mcpu=native",), ()):
        command = [compiler, *FLAGS, *native, str(HERE / "ceilings.cpp"), "-o", str(program)]
        if subprocess.run(command, capture_output=True, check=False).returncode == 0:
            return program, {
                "compiler": _first_line(compiler, "--version"),
                "flags": " ".join((*FLAGS, *native)),
            }
    return None


def ceilings(seconds: float) -> dict[str, Any]:
    """Measure what the machine can do at most.

    Returns
    -------
    dict
        ``fma_gflop_s`` of one core by instruction set; ``l2_gb_s``, ``l3_gb_s``, ``memory_gb_s`` of
        one core, ``memory_all_gb_s`` of all cores, each with ``read`` and ``triad`` [1e9 bytes a
        second]. Empty without a C++ compiler.
    """
    with tempfile.TemporaryDirectory() as folder:
        built = _compile(Path(folder))
        if built is None:
            return {}
        program, how = built
        command = [
            str(program),
            str(len(os.sched_getaffinity(0))),
            str(caches().get("L2", L2_BYTES)),
            str(caches().get("L3", L3_BYTES)),
            str(seconds),
        ]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    return {**json.loads(done.stdout), **how}
