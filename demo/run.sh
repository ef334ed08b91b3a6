#!/bin/bash
# Installs missing Debian packages, builds, writes the sample scenes and renders them to cumulet.png and explosion.png
# without a display. Completed steps are skipped. Arguments are passed to cumulet-render.
# shellcheck source=scripts/common.sh
. "$(dirname "${BASH_SOURCE[0]}")/../scripts/common.sh"

case ${1:-} in
  -h | --help)
    echo "usage: demo/run.sh [cumulet-render flags, such as --spp 256 or --size 1920x1080]"
    exit 0
    ;;
esac

install_packages build
build programs || die "the build failed"
bin=build/programs/bin

# The scene is deterministic, so it is only rewritten if its generator has changed.
scene=build/sample
if [ ! -f "$scene/.done" ] || [ "$bin/cumulet-scene" -nt "$scene/.done" ]; then
  say "writing the sample scenes to $scene"
  "$bin/cumulet-scene" "$scene" || die "cumulet-scene failed"
  touch "$scene/.done"
fi

# About a minute each on two cores without a GPU.
[ $# -gt 0 ] || set -- --spp 16
# Few samples are noisy, so denoise with a filter unless the arguments contain --denoise.
case " $* " in
  *" --denoise "* | *" --denoise="*) ;;
  *)
    set -- "$@" --denoise fast
    say "the images are denoised by a filter (--denoise fast); --denoise off disables this"
    ;;
esac
for picture in sample:cumulet sample_explosion:explosion; do
  say "rendering $scene/${picture%:*}.json"
  "$bin/cumulet-render" --scene "$scene/${picture%:*}.json" "$@" -o "${picture#*:}.png" || die "cumulet-render failed"
done
say "the images are cumulet.png and explosion.png in $root"

if [ -n "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ] && [ -x "$bin/cumulet-demo" ]; then
  say "opening the demo"
  exec "$bin/cumulet-demo" --scene "$scene/sample.json"
fi
