#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
#
# How fast, beside others:  tests/bench/run.sh [--quick] [-k PATTERN] --json FILE
#
#   --quick      fewer repeats and shorter sweeps: about a minute
#   -k PATTERN   only rows whose name contains PATTERN, for example amrap/lion or cone
#   --json FILE  where the rows go
#
# From any folder, on a fresh Debian 12: installs what is missing, builds into build/bench, measures, prints a table.
# docs/benchmarks.md says what the rows mean.
set -u -o pipefail

usage() { sed -n '4,11s/^# \{0,1\}//p' "$0"; }

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
build=$root/build/bench
json=
arguments=()
while [ $# -gt 0 ]; do
  case $1 in
    --json) json=${2:?--json needs a file}; shift ;;
    -k) arguments+=(-k "${2:?-k needs a pattern}"); shift ;;
    --quick) arguments+=(--quick) ;;
    -h | --help) usage; exit 0 ;;
    *) echo "unknown: $1" >&2; usage >&2; exit 2 ;;
  esac
  shift
done
[ -n "$json" ] || { usage >&2; exit 2; }
json=$(realpath -m -- "$json")
mkdir -p "$build" "$(dirname "$json")"
cd "$root" || exit 1

# ------------------------------------------------------------------------------------------------------ packages

# package: what for
needed='
gcc: the C compiler
g++: the C++ compiler
cmake: the build
ninja-build: the build
libopenmesh-dev: mesh connectivity and files
libsuitesparse-dev: CHOLMOD, sparse factorisations
libopenblas-dev: BLAS, dense algebra
liblapacke-dev: LAPACK, dense algebra
libarpack2-dev: ARPACK, eigenfunctions
python3: what measures
python3-numpy: what measures, and a peer
'
# Without one of these, its rows are skipped.
peers='
python3-scipy: a peer for products and factorisations
python3-sklearn: a peer for multidimensional scaling
python3-cvxopt: a peer for cone and quadratic programs
libcgal-dev: a peer for deformation
libeigen3-dev: a peer for rotations, and what CGAL solves with
blender: a peer for deformation
'

install_missing() { # list
  local missing=() line name
  while IFS= read -r line; do
    name=${line%%:*}
    if [ -n "$name" ] && ! dpkg-query -W -f '${Status}' "$name" 2>/dev/null | grep -q 'ok installed'; then
      echo "installing $name: ${line#*: }"
      missing+=("$name")
    fi
  done <<<"$1"
  [ ${#missing[@]} -gt 0 ] || return 0
  local sudo=()
  [ "$(id -u)" -eq 0 ] || sudo=(sudo)
  "${sudo[@]}" apt-get update -q >"$build/apt.log" 2>&1 &&
    "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}" \
      >>"$build/apt.log" 2>&1 || { tail -n 20 "$build/apt.log"; echo "apt-get failed"; return 1; }
}

install_missing "$needed" || exit 1
install_missing "$peers" || echo "going on with the peers that are there"

# --------------------------------------------------------------------------------------------------------- build

build_in() { # folder log command...
  local log=$build/$1.log
  shift
  "$@" >"$log" 2>&1 || { grep -vE '^\[|^-- ' "$log" | tail -n 40; echo "the build failed: $log"; return 1; }
}

export root build
library() {
  cmake -S "$root" -B "$build/library" -G Ninja -DEXM_TESTS=ON -DCMAKE_BUILD_TYPE=Release &&
    ninja -C "$build/library" exemplar bench
}
peers_in_cpp() {
  cmake -S "$root/tests/bench/cgal" -B "$build/peers" -G Ninja -DCMAKE_BUILD_TYPE=Release &&
    ninja -C "$build/peers"
}
echo "building into build/bench"
build_in library library || exit 1
build_in peers peers_in_cpp || echo "going on without CGAL and Eigen"

# ------------------------------------------------------------------------------------------------------- measure

export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
export EXEMPLAR_LIBRARY=$build/library/libexemplar.so
export EXEMPLAR_DATA=${EXEMPLAR_DATA:-$root/../shared/data}
export PYTHONDONTWRITEBYTECODE=1
# Rows are processor time, which for one thread is what an idle machine's clock would show.
exec /usr/bin/python3 "$root/tests/bench/bench.py" --build "$build" --json "$json" ${arguments[@]+"${arguments[@]}"}
