#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Install a build and use it from outside, the two ways that programs do:  tests/install/run.sh BUILD_FOLDER
set -u

here=$(cd "$(dirname "$0")" && pwd)
build=$(cd "$1" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
prefix=$work/prefix

try() { # name command...
  local name=$1
  shift
  case $EXM_TEST_PREFIX$name in *"$EXM_TEST_PATTERN"*) ;; *) return ;; esac
  if "$@" >"$work/log" 2>&1; then echo "ok $EXM_TEST_PREFIX$name"; else sed 's/^/  /' "$work/log"; echo "FAIL $EXM_TEST_PREFIX$name"; fi
}

find_package() {
  cmake -S "$here" -B "$work/cmake" -DCMAKE_PREFIX_PATH="$prefix" && cmake --build "$work/cmake" && "$work/cmake/program"
}

pkg_config() {
  # Moved: an installed tree must not know where it was built or first installed.
  mv "$prefix" "$work/moved"
  local package
  package=$(find "$work/moved" -name pkgconfig)
  # shellcheck disable=SC2046
  gcc -Wall -Wextra -Werror -o "$work/program" "$here/program.c" \
    $(PKG_CONFIG_PATH=$package pkg-config --cflags --libs exemplar) -lm -Wl,-rpath,"$(dirname "$package")" && "$work/program"
}

header() {
  printf '#include "exemplar.h"\nint main(void) { return 0; }\n' >"$work/header.c"
  cp "$work/header.c" "$work/header.cpp"
  local include=$here/../../libcore/include
  gcc -std=c99 -pedantic-errors -Wall -Wextra -Werror -I "$include" -fsyntax-only "$work/header.c" &&
    g++ -std=c++11 -pedantic-errors -Wall -Wextra -Werror -I "$include" -fsyntax-only "$work/header.cpp" &&
    clang -std=c11 -Weverything -Wno-padded -Wno-unsafe-buffer-usage -Wno-unknown-warning-option -Wno-documentation \
      -Wno-declaration-after-statement -Werror -I "$include" -fsyntax-only "$work/header.c"
}

contents() {
  find "$prefix" -name exemplar.h | grep -q /include/ && find "$prefix" -name 'libexemplar.so.*' | grep -q . &&
    ! grep -rlE "$build|$here" "$prefix"
}

cmake --install "$build" --prefix "$prefix" >"$work/install.log" 2>&1 || { cat "$work/install.log"; exit 1; }
try header_in_c99_cpp11_and_strict_c11 header
try tree_knows_nothing_of_the_build contents
try find_package find_package
try pkg_config pkg_config
echo end
