#!/bin/sh
# Installs peridem from this checkout into .venv, and first the system packages it is built from.
#
#   scripts/install.sh         to use it
#   scripts/install.sh test    to work on it: the tools of the tests too
#
# May be run again at any time. Debian 12, Ubuntu 22.04 or newer; elsewhere the packages below
# must be there already, under whatever name.
set -eu
cd "$(dirname "$0")/.."
extra=${1:-}

packages="g++ libeigen3-dev libmetis-dev libnanoflann-dev python3-dev python3-venv"
# what gmsh, which meshes shapes, loads even without a screen
packages="$packages libgl1 libglu1-mesa libxcursor1 libxft2 libxinerama1"
# what PyVista draws with, without a screen
packages="$packages libegl1 libx11-6"
[ "$extra" = test ] && packages="$packages doctest-dev"

missing=""
for package in $packages; do
  status=$(dpkg-query --show --showformat='${db:Status-Status}' "$package" 2>/dev/null || true)
  [ "$status" = installed ] || missing="$missing $package"
done

as_root() {
  if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo "$@"; fi
}

if [ -n "$missing" ] && command -v apt-get >/dev/null; then
  echo "== system packages:$missing"
  as_root apt-get update -q
  # shellcheck disable=SC2086  # a list of words
  as_root env DEBIAN_FRONTEND=noninteractive \
    apt-get install -q -y --no-install-recommends $missing
fi

echo "== Python packages and peridem itself, into .venv"
[ -x .venv/bin/pip ] || python3 -m venv --clear .venv
.venv/bin/pip install --disable-pip-version-check ".[mesh${extra:+,$extra}]"
