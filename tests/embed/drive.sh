#!/bin/bash
# Drives a windowed host as a user would, under Xvfb, and checks its images.
#     drive.sh HOST JUDGE VOLUME OUT_DIR NAME
# HOST --volume VOLUME --test OUT_DIR writes OUT_DIR/NAME-N.ppm at each press of P once the image has all its samples,
# and exits at Escape. Images: 1 after the start, 2 after a drag, 3 after a wheel turn, 4 in a larger window.
# The rules for each image come from standard input: lines "N RULE...", in the format of cumulet-judge.
set -euo pipefail
if [ -z "${DRIVE_INSIDE:-}" ]; then
  export DRIVE_INSIDE=yes
  exec xvfb-run -a -s "-screen 0 1024x768x24" "$0" "$@"
fi
host=$1 judge=$2 volume=$3 out=$4 name=$5
fail() {
  echo "drive.sh: $*" >&2
  exit 1
}
mkdir -p "$out"
rm -f "$out/$name"-*
export LIBGL_ALWAYS_SOFTWARE=1
"$host" --volume "$volume" --test "$out" &
pid=$!
trap 'kill $pid 2>/dev/null || true' EXIT

window=
for ((i = 0; i < 300; ++i)); do
  window=$(xdotool search --onlyvisible --name "^Cumulet" 2>/dev/null | head -n 1) && [ -n "$window" ] && break
  kill -0 $pid 2>/dev/null || fail "$name ended before it had a window"
  sleep 0.1
done
[ -n "$window" ] || fail "$name has no window"
xdotool windowmove "$window" 0 0 windowfocus --sync "$window"

pictures=0
picture() {
  pictures=$((pictures + 1))
  local file=$out/$name-$pictures.ppm until=$((SECONDS + 300)) # allows for other tests that run on few cores
  xdotool key p
  while [ "$SECONDS" -lt "$until" ]; do
    # The file is complete when its size no longer changes.
    if [ -s "$file" ]; then
      local size
      size=$(stat -c %s "$file")
      sleep 0.2
      [ "$size" != "$(stat -c %s "$file")" ] || return 0
    fi
    kill -0 $pid 2>/dev/null || fail "$name ended before picture $pictures"
    sleep 0.1
  done
  fail "$name wrote no picture $pictures"
}

# The pointer goes to a quarter of the window's width, which is inside the first view of every host.
eval "$(xdotool getwindowgeometry --shell "$window")"
x=$((WIDTH / 4)) y=$((HEIGHT / 2))
xdotool mousemove $x $y
picture
xdotool mousedown 1
for step in 1 2 3 4 5 6; do
  xdotool mousemove $((x + 8 * step)) $((y + 3 * step))
  sleep 0.05
done
xdotool mouseup 1
sleep 0.1
picture
xdotool click 4 click 4 click 4
sleep 0.1
picture
xdotool windowsize --sync "$window" $((WIDTH * 5 / 4)) $((HEIGHT * 5 / 4))
sleep 0.3
picture
xdotool key Escape
for ((i = 0; i < 100; ++i)); do
  kill -0 $pid 2>/dev/null || break
  sleep 0.1
done
kill -0 $pid 2>/dev/null && fail "$name did not end at Escape"
trap - EXIT
wait $pid || fail "$name ended with status $?"

status=0
while read -r number rules; do
  # shellcheck disable=SC2086 # rules are words
  (cd "$out" && "$judge" "$name-$number.ppm" $rules) || status=1
done
exit $status
