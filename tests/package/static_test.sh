#!/bin/bash
# A static library, built inside another project and installed, links into programs. The features may be turned off;
# files that need them are then refused by one line with the option.
# Usage: static_test.sh SOURCE_DIR VERSION OPENVDB_MODULE_PATH ON|OFF
set -euo pipefail
source=$1 version=$2 openvdb_module_path=$3 features=$4
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "static_test: $*" >&2; exit 1; }

cmake -S "$here/embedded" -B "$work/build" -G Ninja -DCUMULET_SOURCE_DIR="$source" -DCUMULET_STATIC=ON \
  -DCUMULET_INSTALL=ON -DCUMULET_OPENVDB="$features" -DCUMULET_DRACO="$features" -DCUMULET_MESHOPT="$features" \
  -DCUMULET_TIFF="$features" -DCUMULET_WEBP="$features"
cmake --build "$work/build"

# --- files that need features -----------------------------------------------------------------------------------------
primitive='"attributes":{"POSITION":0}'
accessor='"accessors":[{"componentType":5126,"type":"VEC3","count":3,"min":[0,0,0],"max":[1,1,1],"bufferView":0}]'
buffers='"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]'
head='"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}]'
cat >"$work/draco.gltf" <<END
{$head,$accessor,$buffers,"bufferViews":[{"buffer":0,"byteLength":36}],"extensionsUsed":["KHR_draco_mesh_compression"],
 "meshes":[{"primitives":[{$primitive,
 "extensions":{"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":0}}}}]}]}
END
cat >"$work/meshopt.gltf" <<END
{$head,$accessor,$buffers,"extensionsUsed":["EXT_meshopt_compression"],"meshes":[{"primitives":[{$primitive}]}],
 "bufferViews":[{"buffer":0,"byteLength":36,"extensions":{"EXT_meshopt_compression":{"buffer":0,"byteLength":36,
 "byteStride":12,"count":3,"mode":"ATTRIBUTES"}}}]}
END
printf ' BDV\0\0\0\0\0\0\0\0' >"$work/cloud.vdb"
"$work/build/embedding" "$work/cloud.vdb" "$work/draco.gltf" "$work/meshopt.gltf" >"$work/said"
cat "$work/said"
[ "$(wc -l <"$work/said")" = 3 ] || fail "an error has more than one line"
if [ "$features" = OFF ]; then
  for option in OPENVDB DRACO MESHOPT; do
    grep -q "(CUMULET_$option=OFF)" "$work/said" || fail "no error names CUMULET_$option"
  done
else
  if grep -q 'CUMULET_' "$work/said"; then fail "a feature is missing"; fi
fi

# --- the installed library --------------------------------------------------------------------------------------------
cmake --install "$work/build" --prefix "$work/tree" >/dev/null
find "$work/tree" -name 'libcumulet.a' | grep -q . || fail "libcumulet.a is not installed"
cmake -S "$here/consumer" -B "$work/consumer" -G Ninja -DCMAKE_PREFIX_PATH="$work/tree" -DWANTED_VERSION="$version" \
  -DOPENVDB_MODULE_PATH="$openvdb_module_path"
cmake --build "$work/consumer"
for program in consumer_c consumer_cpp; do
  [ "$("$work/consumer/$program")" = "$version" ] || fail "$program does not print the version"
done
"$work/consumer/consumer_openvdb"
