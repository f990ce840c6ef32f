#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
#
# Makes the pictures of the manual, docs/images/*.png, in a real Blender window:  docs/screenshots/run.sh
#
# Needs what tests/run.sh installs, and a built library (build/plain, or $EXEMPLAR_LIBRARY).
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
mkdir -p "$root/docs/images"
export PYTHONDONTWRITEBYTECODE=1
log=$(mktemp)
trap 'rm -f "$log"' EXIT

if ! xvfb-run -a -s '-screen 0 1240x1180x24' blender --factory-startup --enable-event-simulate --no-window-focus \
  --window-geometry 0 0 1240 1180 --python "$root/docs/screenshots/take.py" >"$log" 2>&1 ||
  ! grep -q '^all taken$' "$log"; then
  tail -n 30 "$log" >&2
  exit 1
fi
ls -l "$root"/docs/images/*.png | awk '{print $9, $5}'
