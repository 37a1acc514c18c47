#!/bin/sh
# Installs peridem (see install.sh) and runs its demo, a grain that breaks, into peridem_demo/.
set -eu
cd "$(dirname "$0")/.."
scripts/install.sh
exec .venv/bin/peridem demo --output peridem_demo
