#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
#
# Builds the library, then two characters by script: a creature and a face. Each gets handles, is
# bound, performs for 60 frames, is baked, checked and drawn. Also the square of the paper's
# figures 1 and 2, a walk edited as a sequence, and a C program. Runs on Debian 12, from any working directory.
#
#   examples/run.sh [creature] [face] [deformers] [sequence] [square] [c]     all of them without arguments
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$root/build/examples
examples=$root/examples
wanted=${*:-square creature face deformers sequence c}

# ----------------------------------------------------------------------------------------- packages

declare -A why=(
  [cmake]="to configure the build"
  [ninja-build]="to run it"
  [gcc]="to compile the library"
  [g++]="to compile its one C++ file, the door to OpenMesh"
  [libopenmesh-dev]="reading and checking meshes"
  [libsuitesparse-dev]="sparse factorisations (CHOLMOD)"
  [libopenblas-dev]="dense linear algebra"
  [liblapacke-dev]="the same, its C interface"
  [libarpack2-dev]="eigenfunctions (ARPACK)"
  [blender]="the characters live in it"
  [libegl1]="pictures without a screen"
  [libgl1-mesa-dri]="OpenGL without a graphics card"
  [python3-numpy]="used by the add-on and by the scripts here"
)

missing=()
for package in "${!why[@]}"; do
  if ! dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed'; then
    missing+=("$package")
  fi
done
if ((${#missing[@]})); then
  echo "Installing with apt:"
  for package in "${missing[@]}"; do
    printf '   %-20s %s\n' "$package" "${why[$package]}"
  done
  as_root=()
  if ((EUID != 0)); then
    if ! command -v sudo >/dev/null; then
      echo "This needs root or sudo. Or install them yourself, and run this again." >&2
      exit 1
    fi
    as_root=(sudo)
  fi
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
fi

# ------------------------------------------------------------------------------------------ library

echo "Building the library"
mkdir -p "$build"
log=$build/build.log
if ! { cmake -S "$root" -B "$build/library" -G Ninja -DEXM_TESTS=OFF &&
  ninja -C "$build/library" exemplar pose; } >"$log" 2>&1; then
  tail -n 40 "$log" >&2
  exit 1
fi
export EXEMPLAR_LIBRARY=$build/library/libexemplar.so

# ------------------------------------------------------------------------------------------ Blender

# The add-on is enabled from where it lies: Blender looks for add-ons in <scripts>/addons.
mkdir -p "$build/scripts/addons"
ln -sfn "$root/blender_addon" "$build/scripts/addons/exemplar"

# in_blender LOG ARGUMENTS: our own lines begin with three spaces; the rest goes to the log.
in_blender() {
  local log=$1
  shift
  if ! blender -b --factory-startup "$@" >"$log" 2>&1; then
    grep '^   ' "$log" || true
    echo "Blender failed; the end of $log:" >&2
    tail -n 30 "$log" >&2
    return 1
  fi
  grep '^   ' "$log" || true
}

# all_that_matters: a digest of the library, the add-on and the scripts.
all_that_matters() {
  (cd "$root" && sha256sum "$EXEMPLAR_LIBRARY" examples/*.py examples/characters/*.py &&
    find blender_addon -name '*.py' -print0 | sort -z | xargs -0 sha256sum) | sha256sum
}

# once NAME PICTURE WORDS COMMAND...: skipped where PICTURE is there and nothing has changed.
once() {
  local name=$1 picture=$build/$2
  echo "$1: $3"
  shift 3
  local stamp=$build/$name.stamp
  if [[ -e $picture && -e $stamp && $(head -n 1 "$stamp") == "$(all_that_matters)" ]]; then
    tail -n +2 "$stamp"
    echo "   nothing has changed since then; delete $stamp to do it again"
    return
  fi
  rm -f "$stamp"
  "$@" | tee "$build/$name.txt"
  { all_that_matters && cat "$build/$name.txt"; } >"$stamp"
  rm "$build/$name.txt"
}

character() {
  once "$1" "$1_frames.png" "$2" perform "$1"
}

three_deformers() {
  BLENDER_USER_SCRIPTS=$build/scripts in_blender "$build/deformers.log" \
    --addons exemplar --python "$examples/deformers.py" -- "$build"
}

edit_sequence() {
  BLENDER_USER_SCRIPTS=$build/scripts in_blender "$build/sequence.log" \
    --addons exemplar --python "$examples/sequence.py" -- "$build"
}

perform() {
  BLENDER_USER_SCRIPTS=$build/scripts in_blender "$build/$1.log" \
    --addons exemplar --python "$examples/perform.py" -- "$1" "$build"
  in_blender "$build/$1_playback.log" \
    "$build/$1.blend" --python "$examples/playback.py" -- "$1" "$build"
}

for what in $wanted; do
  case $what in
    square)
      echo "square: figures 1 and 2 of the paper"
      /usr/bin/python3 "$examples/square.py" "$build" | sed 's/^/   /'
      ;;
    creature) character creature "a limbed animal, parts turn" ;;
    face) character face "Suzanne, without rotations" ;;
    deformers)
      once deformers creature_deformers.png "the creature soft, painted, learned, and by Blended" \
        three_deformers
      ;;
    sequence)
      once sequence sequence_transfer.png "a walk captured, edited, retimed, transferred" \
        edit_sequence
      ;;
    c)
      echo "c: a pose between two exemplars, by a C program of a page"
      "$build/library/examples/c/pose" "$build/creature_rest.obj" "$build/creature_howl.obj" \
        0 -0.4 2.03 2>&1 >"$build/creature_pose.obj" | sed 's/^/   /'
      ;;
    *)
      echo "There is no example '$what'" >&2
      exit 2
      ;;
  esac
done

# ------------------------------------------------------------------------------------------ results

echo
echo "Look at, in $build:"
show() {
  if [[ -e $build/$1 ]]; then
    printf '   %-22s %s\n' "$1" "$2"
  fi
}
show square.png "rows a to d of the paper's figure 2 (and square.svg)"
for name in creature face; do
  show $name.png "row 1: the exemplars and the handles; below: frames, dots where the empties are"
  show ${name}_frames.png "all frames"
  show $name.blend "open it and press play; with the add-on, drag the empties"
  show $name.pc2 "the baked positions it plays"
done
show creature_deformers.png "the same performance by Rigidity, soft, painted and learned, and by Blended"
show creature_deformers.blend "the creature as Blended has it; choose another deformer, and press Rebind"
show sequence_plane.png "the pose plane of a walk: shapes, the curve, its frames"
show sequence.png "the walk as captured, and with steps that its curve makes higher"
show sequence_transfer.png "the same on another character"
show sequence.blend "open it and press play; with the add-on, edit the curve"
show creature_pose.obj "what the C program made"
