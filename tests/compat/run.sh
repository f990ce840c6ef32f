#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
#
# The add-on in another Blender:  tests/compat/run.sh VERSION [-k PATTERN]
#
#   VERSION      3.4, 4.3 or 5.2: those of Debian 12, 13 and unstable
#   -k PATTERN   only tests whose name contains PATTERN, for example blender/addon_live.
#
# Runs every test of tests/blender and the test of the zip, in a folder with that Debian (folder.sh), with one and the same
# library: the one in the zip. Ends with "N passed, N failed". Without root or network it says that it skips.
set -u -o pipefail

usage() { sed -n '4,10s/^# \{0,1\}//p' "$0"; exit 2; }

version=${1:-}
[ $# -gt 0 ] && shift
pattern=
while getopts k:h option; do
  case $option in
    k) pattern=$OPTARG ;;
    *) usage ;;
  esac
done

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root" || exit 1
logs=build/logs/compat-$version
plain=build/plain
# A real window is drawn by the processor here, and more slowly by newer Blenders.
time_limit=900
mkdir -p "$logs"
data=$root/../shared/data
[ -d "$data" ] && data=$(cd "$data" && pwd)
export EXEMPLAR_DATA=${EXEMPLAR_DATA:-$data}

source tests/results.sh
source tests/compat/folder.sh
suite=$(suite_of "$version") || usage
folder=$compat_cache/$suite

skip_all() { # why
  report skip "compat/$version: $1"
  conclude
  exit 0
}

prepare() {
  [ "$(id -u)" -eq 0 ] || skip_all "folders with another Debian are made and entered by root"
  if ! command -v debootstrap >/dev/null; then
    echo "installing debootstrap: folders with another Debian"
    { apt-get update -q && DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends debootstrap; } \
      >"$logs/apt.log" 2>&1 || skip_all "debootstrap cannot be installed ($logs/apt.log)"
  fi
  make_folder "$suite" || { tail -n 5 "$compat_cache/$suite.log"; skip_all "the folder cannot be made: no network?"; }
  tests/compat/enter.sh "$folder" true || skip_all "the folder cannot be entered: mounts are not allowed here"
}

# The library is built here and nowhere else: what is tested is that this file serves all.
build_zip() {
  cmake -S . -B "$plain" -G Ninja -DEXM_TESTS=ON && ninja -C "$plain" exemplar addon_zip
}

prepare
if ! build_zip >"$logs/build.log" 2>&1; then
  tail -n 40 "$logs/build.log"
  report FAIL "compat/$version/build"
  conclude
  exit 1
fi
zip=$(ls -t "$root/$plain"/exemplar-*.zip | head -n 1)
library=$root/$plain/addon/exemplar/native/lib/libexemplar.so

export EXEMPLAR_ZIP=$zip EXEMPLAR_LIBRARY=$library EXEMPLAR_SCREENSHOTS=$root/build/screenshots/$version
export EXM_TEST_PATTERN=$pattern EXEMPLAR_OFFLINE=1
inside=(tests/compat/enter.sh "$folder" env PYTHONDONTWRITEBYTECODE=1 OPENBLAS_NUM_THREADS=1)

found=$("${inside[@]}" blender -b --version | sed -n 's/^Blender \([0-9]*\.[0-9]*\).*/\1/p' | head -n 1)
[ "$found" = "$version" ] || skip_all "Debian's $suite has Blender ${found:-of no known version} now"

for source in tests/blender/test_*.py; do
  name=$(basename "$source" .py)
  program "$version/blender/" "${name#test_}" "${inside[@]}" \
    blender -b --factory-startup --python-exit-code 3 --python "$source"
done
program "$version/packaging/" addon_zip "${inside[@]}" \
  env -u EXEMPLAR_LIBRARY /usr/bin/python3 tests/packaging/test_addon_zip.py
conclude
