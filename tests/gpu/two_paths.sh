#!/bin/bash
# Renders small images with one path a lane and with two (tests/bench/two_paths), and compares the files byte by byte.
# The driver must round alike in both kernels, as llvmpipe does.
# Usage: two_paths.sh BUILD_DIR OUT
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
programs=$1/bin
out=$2
rm -rf "$out"
mkdir -p "$out"
python3 -B "$here/shader_variants.py" "$root/glsl" "$root/tests/bench" "$out/shaders"
"$programs/cumulet-scene" "$out/scene" --voxels 60000 --frame 12 >"$out/scene.log"

# same VARIANT NAME FLAGS...: VARIANT is `new` if the image has a kernel of its own, and `old` if it does not.
same() {
  local variant=$1 name=$2
  shift 2
  for folder in "$root/glsl" "$out/shaders/two_paths"; do
    "$programs/cumulet-render" --shaders "$folder" --size 40x30 --spp 6 --seed 3 --shader-cache "$out/cache" "$@" \
      -o "$out/$name-$(basename "$folder").exr" 2>"$out/$name-$(basename "$folder").log"
  done
  cmp "$out/$name-glsl.exr" "$out/$name-two_paths.exr" || { echo "two_paths.sh: $name differs" >&2; exit 1; }
  echo "$name ($variant kernel): identical"
}
cloud=(--volume "$out/scene/cumulus.vdb")
same new linear "${cloud[@]}"
same new constant "${cloud[@]}" --cells constant
same new general "${cloud[@]}" --ground below --sun-angle 3 --anisotropy 0.6 --albedo 0.7,0.8,0.9
same new long "${cloud[@]}" --size 72x54 --spp 8 --density-scale 2  # several dispatches
same old dense "${cloud[@]}" --grid-type dense
same old bricks "${cloud[@]}" --grid-type bricks
same old emission --volume "$out/scene/explosion_0012.vdb"
