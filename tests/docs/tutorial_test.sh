#!/bin/bash
# The tutorial's host shows the sample cloud in a window of Xvfb and saves a picture of it.
# Usage: tutorial_test.sh HOST CUMULET_SCENE. HOST is built with a small window and few samples.
set -euo pipefail
name=$(basename "$0")
command -v xvfb-run >/dev/null || { echo "SKIPPED: $name needs xvfb-run (scripts/packages.txt)"; exit 77; }
if [ -z "${TUTORIAL_INSIDE:-}" ]; then
  export TUTORIAL_INSIDE=yes
  exec xvfb-run -a -s "-screen 0 640x480x24" "$0" "$@"
fi
host=$(realpath "$1") scene=$(realpath "$2")
work=$(mktemp -d)
pid=
finish() {
  [ -z "$pid" ] || kill "$pid" 2>/dev/null || true
  rm -rf "$work"
}
trap finish EXIT
fail() { echo "$name: $*" >&2; exit 1; }
cd "$work"
"$scene" sample --only cumulus --voxels 20000 >/dev/null

export LIBGL_ALWAYS_SOFTWARE=1
"$host" sample/cumulus.vdb &
pid=$!
until=$((SECONDS + 300)) # on a busy machine; seconds otherwise
complete() { # whether the picture has all pixels that its header names
  [ -s cloud.ppm ] && python3 -B - cloud.ppm <<'PY'
import re
import sys

with open(sys.argv[1], "rb") as file:
    data = file.read()
header = re.match(rb"P6\n(\d+) (\d+)\n255\n", data)
sys.exit(not header or len(data) - header.end() != 3 * int(header[1]) * int(header[2]))
PY
}
until complete; do
  kill -0 "$pid" 2>/dev/null || fail "the host ended before it saved a picture"
  [ "$SECONDS" -lt "$until" ] || fail "the host saved no picture"
  sleep 0.2
done
python3 -B - cloud.ppm <<'PY' || fail "the picture shows nothing"
import sys

with open(sys.argv[1], "rb") as file:
    pixels = file.read().split(b"\n255\n", 1)[1]
print(f"values from {min(pixels)} to {max(pixels)}")
sys.exit(max(pixels) - min(pixels) < 50)
PY
