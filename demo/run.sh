#!/bin/bash
# From a clone to a picture: installs the Debian packages that are missing, builds, writes the sample scene and renders
# it to cumulet.png without a display. What is done already is skipped. Arguments go to cumulet-render.
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

# The scene is deterministic: written again only after its generator changed.
scene=build/sample
if [ ! -f "$scene/.done" ] || [ "$bin/cumulet-scene" -nt "$scene/.done" ]; then
  say "writing the sample scene to $scene"
  "$bin/cumulet-scene" "$scene" || die "cumulet-scene failed"
  touch "$scene/.done"
fi

# About a minute on two cores without a GPU.
[ $# -gt 0 ] || set -- --spp 16
say "rendering $scene/sample.json"
"$bin/cumulet-render" --scene "$scene/sample.json" -o cumulet.png "$@" || die "cumulet-render failed"
say "the picture is in $root/cumulet.png"

if [ -n "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ] && [ -x "$bin/cumulet-demo" ]; then
  say "opening the demo"
  exec "$bin/cumulet-demo" --scene "$scene/sample.json"
fi
