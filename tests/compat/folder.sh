# SPDX-License-Identifier: GPL-3.0-or-later
#
# A Debian with the Blender of one of its releases, in a folder: made once, kept, entered by enter.sh. Sourced by
# run.sh.
#
# The folders are a gigabyte and a half each, and the same for every clone, so they are kept outside of it:
# $EXEMPLAR_COMPAT, by default ~/.cache/exemplar/compat.

compat_cache=${EXEMPLAR_COMPAT:-${XDG_CACHE_HOME:-$HOME/.cache}/exemplar/compat}
mirror=${DEBIAN_MIRROR:-http://deb.debian.org/debian}

# package: what for
folder_packages='
blender: the add-on
python3-numpy: the add-on; some releases only suggest it
libegl1: pictures without a screen
libgl1: a window
libgl1-mesa-dri: OpenGL without a graphics card
xvfb: a screen for the tests that need a window
xauth: xvfb-run needs it
binutils: readelf, for the test of the zip
python3-cattr: the add-ons of Blender 5.2, which only suggests it
python3-requests: the same
gcc: libraries that are not ours, to be refused
libc6-dev: the same
'

suite_of() { # version
  case $1 in
    3.4) echo bookworm ;;
    4.3) echo trixie ;;
    5.2) echo sid ;;
    *) return 1 ;;
  esac
}

# A folder is whole once it holds the list of what was installed into it; it is built under another name until then.
make_folder() { # suite
  local folder=$compat_cache/$1 log=$compat_cache/$1.log new=$compat_cache/$1.new
  cmp -s "$folder/made" <<<"$folder_packages" && return 0
  mkdir -p "$compat_cache"
  if [ -e "$folder/made" ]; then
    fill_folder "$folder" >>"$log" 2>&1
    return
  fi
  rm -rf --one-file-system "$new"
  echo "making $folder (a few minutes; log: $log)"
  debootstrap --variant=minbase "$1" "$new" "$mirror" >"$log" 2>&1 || return 1
  cp /etc/resolv.conf "$new/etc/resolv.conf"
  # Blender reads it, and complains without.
  ln -sf ../proc/self/mounts "$new/etc/mtab"
  # A mirror that stands still, or a Release file that has run out, is good enough to test with.
  echo 'Acquire::Check-Valid-Until "false";' >"$new/etc/apt/apt.conf.d/99compat"
  fill_folder "$new" >>"$log" 2>&1 && mv "$new" "$folder"
}

fill_folder() { # folder
  local names
  names=$(sed -n 's/^\([^:]*\):.*/\1/p' <<<"$folder_packages")
  # shellcheck disable=SC2086
  tests/compat/enter.sh "$1" env DEBIAN_FRONTEND=noninteractive sh -c '
    apt-get update -q && apt-get install -y -q --no-install-recommends "$@" && apt-get clean' sh $names &&
    printf '%s\n' "$folder_packages" >"$1/made"
}
