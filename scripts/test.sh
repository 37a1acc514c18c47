#!/bin/sh
# Installs peridem with the tools of its tests (see install.sh) and runs every check and test.
set -eu
cd "$(dirname "$0")/.."
scripts/install.sh test
PATH="$PWD/.venv/bin:$PATH"

step() { printf '\n== %s\n' "$*"; }
run() { step "$@" && "$@"; }

run ruff check
run ruff format --check
step "clang-format --dry-run -Werror"
find cpp \( -name '*.h' -o -name '*.cpp' \) -exec clang-format --dry-run -Werror {} +
run mypy

# The C++ core on its own, without Python. CMake from PyPI: the presets need 3.25 or newer.
pip install --quiet --disable-pip-version-check "cmake>=3.25" ninja
for preset in release asan-ubsan; do
  run cmake --preset "$preset"
  run cmake --build --preset "$preset"
  run ctest --preset "$preset" --no-tests=error
done

run pytest
