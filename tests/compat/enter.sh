#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
#
# Run a command in a folder with another Debian:  tests/compat/enter.sh FOLDER COMMAND...
#
# The source tree and the real meshes are there under their own names, and the variables EXM_* and EXEMPLAR_* are passed
# on; EXEMPLAR_OFFLINE=1 leaves it without a network. It runs in mount and process namespaces of its own: nothing stays
# mounted and nothing keeps running, however it ends.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
folder=$1
shift
offline=()
# Abstract sockets of X servers belong to the network: with one of its own no other test's display is in the way.
[ -z "${EXEMPLAR_OFFLINE:-}" ] || offline=(--net)
mapfile -t passed_on < <(env | grep -E '^(EXM|EXEMPLAR)_' || true)

exec unshare "${offline[@]}" --mount --pid --fork --kill-child sh -c '
  set -e
  folder=$1 root=$2 data=$3
  shift 3
  mount --rbind /dev "$folder/dev"
  mount -t proc proc "$folder/proc"
  mount -t tmpfs tmpfs "$folder/tmp"
  mkdir -p "$folder$root"
  mount --bind "$root" "$folder$root"
  if [ -d "$data" ]; then
    mkdir -p "$folder$data"
    mount --bind -o ro "$data" "$folder$data"
  fi
  exec chroot "$folder" "$@"
' sh "$folder" "$root" "${EXEMPLAR_DATA:-/nowhere}" \
  env -i HOME=/root LANG=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin "${passed_on[@]}" \
  sh -c 'cd "$1" && shift && exec "$@"' sh "$root" "$@"
