#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
#
# Everything that can be checked, from a fresh Debian 12:  tests/run.sh [-k PATTERN]
#
#   -k PATTERN   only tests whose name contains PATTERN, for example c/mesh. or blender/
#
# Installs what is missing, builds into build/plain and build/sanitized, runs, and ends with "N passed, N failed".
# tests/README.md says how tests are found and what they print.
set -u -o pipefail

pattern=
while getopts k:h option; do
  case $option in
    k) pattern=$OPTARG ;;
    *) sed -n '3,9s/^# \{0,1\}//p' "$0"; exit 2 ;;
  esac
done

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root" || exit 1
logs=build/logs
plain=build/plain
sanitized=build/sanitized
time_limit=600 # seconds a program
mkdir -p "$logs"

export EXM_TEST_PATTERN=$pattern
export EXEMPLAR_LIBRARY=$root/$plain/libexemplar.so
export EXEMPLAR_DATA=${EXEMPLAR_DATA:-$root/../shared/data}
export PYTHONDONTWRITEBYTECODE=1
# The blas of the tests' meshes is small: a second thread would only get in the way of the sanitizers.
export OPENBLAS_NUM_THREADS=1

# ------------------------------------------------------------------------------------------------------ packages

# package: what for
packages='
gcc: the C compiler
g++: the C++ compiler, for the OpenMesh shim
cmake: the build
ninja-build: the build
pkg-config: the test of the installed package
binutils: nm and readelf, the test of the exports
libopenmesh-dev: mesh connectivity and files
libsuitesparse-dev: CHOLMOD, sparse factorisations
libopenblas-dev: BLAS, dense algebra
liblapacke-dev: LAPACK, dense algebra
libarpack2-dev: ARPACK, eigenfunctions
clang-format: the format of C
clang-tidy: the linter of C
clang: the headers that clang-tidy needs
libomp-dev: omp.h for clang-tidy
valgrind: uses of what was never written
black: the format of Python
flake8: the linter of Python
python3: tests without Blender
python3-numpy: tests without Blender
python3-cvxopt: a second opinion on cone programs
python3-scipy: the linear algebra of that opinion
patchelf: the package for Blender
blender: the add-on
xvfb: a screen for the tests that need a window
xauth: xvfb-run needs it
libgl1-mesa-dri: OpenGL without a graphics card
'

install_packages() {
  local missing=() line name
  while IFS= read -r line; do
    name=${line%%:*}
    if [ -n "$name" ] && ! dpkg-query -W -f '${Status}' "$name" 2>/dev/null | grep -q 'ok installed'; then
      echo "installing $name: ${line#*: }"
      missing+=("$name")
    fi
  done <<<"$packages"
  if [ ${#missing[@]} -gt 0 ]; then
    local sudo=()
    [ "$(id -u)" -eq 0 ] || sudo=(sudo)
    "${sudo[@]}" apt-get update -q >"$logs/apt.log" 2>&1 &&
      DEBIAN_FRONTEND=noninteractive "${sudo[@]}" apt-get install -y -q --no-install-recommends "${missing[@]}" \
        >>"$logs/apt.log" 2>&1 || { tail -n 20 "$logs/apt.log"; echo "apt-get failed"; exit 1; }
  fi
}

source tests/results.sh

# --------------------------------------------------------------------------------------------------------- suites

build() { # folder options...
  local folder=$1 log=$logs/build_${1##*/}.log
  shift
  if ! { cmake -S . -B "$folder" -G Ninja -DEXM_TESTS=ON "$@" && ninja -C "$folder"; } >"$log" 2>&1; then
    grep -vE '^\[|^-- ' "$log" | tail -n 60
    report FAIL "build/${folder##*/}"
    return 1
  fi
  matches "build/${folder##*/}" && report ok "build/${folder##*/}"
  return 0
}

c_tests() { # prefix folder
  wanted "$1" || return 0
  local source name
  for source in tests/c/test_*.c; do
    name=$(basename "$source" .c)
    program "$1" "${name#test_}" "$2/tests/$name"
  done
}

# The programs that walk the most code in the least time; valgrind sees what was never written, and the sanitizers do not.
valgrind_tests() {
  wanted valgrind/ || return 0
  local name
  for name in $(sed -n 's/^test_//p' tests/valgrind.txt); do
    program valgrind/ "$name" env OMP_NUM_THREADS=1 valgrind --quiet --error-exitcode=99 --leak-check=full \
      --errors-for-leak-kinds=definite --suppressions=tests/valgrind.supp "$plain/tests/test_$name"
  done
}

python_tests() {
  wanted python/ || return 0
  local source name
  for source in tests/python/test_*.py; do
    [ -e "$source" ] || continue
    name=$(basename "$source" .py)
    program python/ "${name#test_}" /usr/bin/python3 "$source"
  done
}

# The zip, installed where nothing of the build is in reach.
packaging_tests() {
  wanted packaging/ || return 0
  local source name
  for source in tests/packaging/test_*.py; do
    [ -e "$source" ] || continue
    name=$(basename "$source" .py)
    program packaging/ "${name#test_}" env -u EXEMPLAR_LIBRARY EXEMPLAR_BUILD="$plain" /usr/bin/python3 "$source"
  done
}

blender_tests() {
  wanted blender/ || return 0
  local source name
  for source in tests/blender/test_*.py; do
    [ -e "$source" ] || continue
    name=$(basename "$source" .py)
    # The exit code counts only in front of the script.
    program blender/ "${name#test_}" blender -b --factory-startup --python-exit-code 3 --python "$source"
  done
}

# clang-tidy is slow, so it looks at what changed since it last had nothing to say.
tidy() {
  local stamp=build/tidy.stamp sources
  if [ -e "$stamp" ] && [ -z "$(find .clang-tidy libcore -name '*.h' -newer "$stamp" -o -name .clang-tidy -newer "$stamp")" ]; then
    sources=$(find libcore/src -name '*.c' -newer "$stamp")
  else
    sources=$(find libcore/src -name '*.c')
  fi
  touch "$stamp.new"
  [ -z "$sources" ] || xargs -P "$(nproc)" -n 4 clang-tidy -p "$plain" --quiet --warnings-as-errors='*' <<<"$sources" || return 1
  mv "$stamp.new" "$stamp"
}

c_format() { find libcore tests -name '*.[ch]' -o -name '*.cpp' | xargs clang-format --dry-run -Werror; }

python_files() { find . -name '*.py' -not -path './build/*'; }
python_format() { python_files | xargs black --quiet --check --diff; }
python_lint() { python_files | xargs flake8; }

static_checks() {
  wanted checks/ || return 0
  export -f tidy c_format python_files python_format python_lint
  export plain
  local each
  for each in c_format tidy python_format python_lint; do
    check "checks/$each" bash -c "$each"
  done
}

# ------------------------------------------------------------------------------------------------------------ main

install_packages
static_ready=0
if build "$plain"; then
  static_ready=1
  c_tests c/ "$plain"
  python_tests
  wanted install/ && program install/ package tests/install/run.sh "$plain"
  packaging_tests
  blender_tests
  valgrind_tests
fi
if wanted sanitized/; then
  build "$sanitized" -DEXM_SANITIZE=ON -DCMAKE_BUILD_TYPE=Debug &&
    ASAN_OPTIONS=allocator_may_return_null=1 c_tests sanitized/ "$sanitized"
fi
finish
[ $static_ready -eq 1 ] && static_checks

conclude
