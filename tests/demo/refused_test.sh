#!/bin/bash
# Tests errors that cumulet-render can detect only after loading a model. It must print one line that names file and
# cause, and write no image.
# Usage: refused_test.sh RENDER MODEL
set -euo pipefail
render=$1 model=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "refused_test: $*" >&2; exit 1; }

refused() {
  local status=0
  "$render" "${@:2}" --size 32x24 --spp 1 -o "$work/picture.png" >"$work/out" 2>"$work/error" || status=$?
  [ "$status" = 1 ] || fail "exit status $status: $(cat "$work/error")"
  [ ! -s "$work/out" ] || fail "said $(cat "$work/out")"
  [ "$(wc -l <"$work/error")" = 1 ] || fail "not one line: $(cat "$work/error")"
  grep -qF "$model: $1" "$work/error" || fail "said $(cat "$work/error")"
  [ ! -e "$work/picture.png" ] || fail "there is a picture"
}

refused "no animation 99; the file has 1" --gltf "$model" --gltf-animation 99
refused 'no material variant "night"; the file has none' --gltf "$model" --gltf-variant night
# The second model: the library refuses its transform.
echo "{\"cumulet_scene\": 3, \"models\": [{\"file\": \"$model\"}, {\"file\": \"$model\",
      \"to_world\": [1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}]}" >"$work/flat.json"
refused "cumulet_model_desc.to_world is singular" --scene "$work/flat.json"
