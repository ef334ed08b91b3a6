#!/bin/bash
# Packs a folder that measures a GPU on a machine without our libraries, packages or network: programs, benchmarks, GL
# tests, reference images, shaders and run.sh. docs/gpu.md says how to use it.
# Usage: pack.sh [--links] BUILD_DIR OUT
#   --links: links to BUILD_DIR instead of an archive, for a rehearsal on this machine
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
links=
if [ "${1:-}" = --links ]; then
  links=1
  shift
fi
[ $# -eq 2 ] || { echo "usage: pack.sh [--links] BUILD_DIR OUT" >&2; exit 2; }
build=$(cd "$1" && pwd)
mkdir -p "$2"
out=$(cd "$2" && pwd)
max_mib=50
tests=(trace_test gpu_grid_test gpu_grid_build_test gl_state_test contract_test)
benches=(cumulet-bench cumulet-bench-grid cumulet-bench-pace cumulet-compare)

fail() { echo "pack.sh: $*" >&2; exit 1; }
[ -z "$(ls -A "$out")" ] || fail "$out is not empty"
for program in "${tests[@]}" "${benches[@]}" cumulet-render cumulet-scene; do
  [ -x "$build/bin/$program" ] || fail "$build/bin/$program is missing: build the preset release first"
done

# copy_libraries STAGE: copies the libraries that the benchmarks and tests need in addition to the programs, except
# those of the C library and of OpenGL (cmake/bundle.cmake).
copy_libraries() {
  local stage=$1 name path
  ldd "$stage"/bench/* "$stage"/tests/* | awk '$2 == "=>" && $3 ~ /^\// {print $1, $3}' | sort -u |
    grep -vE '^(ld-linux|lib(c|m|pthread|dl|rt|util|resolv|GL|GLX|GLdispatch|OpenGL|EGL|OSMesa|stdc\+\+|gcc_s)\.so|lib(X|xcb))' |
    while read -r name path; do
      [ -e "$stage/lib/$name" ] || [ -e "$stage/lib/fallback/$name" ] || cp -L "$path" "$stage/extra/$name"
    done
}

copy_loaders() { # FOLDER: the vendor-neutral loaders of OpenGL, for machines that have only the driver
  local library path
  for library in libEGL.so.1 libGLdispatch.so.0 libOpenGL.so.0; do
    path=$(PATH=$PATH:/sbin:/usr/sbin ldconfig -p | awk -v name="$library" '$1 == name && /x86-64/ && !n++ {print $NF}')
    [ -z "$path" ] || cp -L "$path" "$1/$library"
  done
}

stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT
if [ -n "$links" ]; then
  mkdir -p "$out/programs"
  for folder in bin bench tests; do ln -s "$build/bin" "$out/programs/$folder"; done
else
  (cd "$build" && cpack -G TGZ -B "$stage/pack") >"$stage/cpack.log" 2>&1 || { cat "$stage/cpack.log"; fail "cpack failed"; }
  mkdir -p "$stage/programs"/{bench,tests,extra,loaders}
  tar -xzf "$stage"/pack/cumulet-*.tar.gz -C "$stage/programs" --strip-components=1
  for program in "${benches[@]}"; do strip -o "$stage/programs/bench/$program" "$build/bin/$program"; done
  for program in "${tests[@]}"; do strip -o "$stage/programs/tests/$program" "$build/bin/$program"; done
  copy_libraries "$stage/programs"
  copy_loaders "$stage/programs/loaders"
  rm -rf "$stage/programs/share" "$stage/programs/include" "$stage"/programs/bin/cumulet-demo
  # The tests contain the same library. A large dictionary stores it once.
  tar -C "$stage" -c programs | xz -T1 --lzma2=preset=6,dict=128MiB >"$out/programs.tar.xz"
fi

# The reference images and how they are made, from the image tests.
mkdir -p "$out/golden"
(cd "$build" && ctest --show-only=json-v1 -R '^image\.') |
  python3 -B "$here/pictures.py" "$out/golden" >"$out/golden/pictures.txt"

# Renders the same images with this machine's driver and another seed. Their errors come from noise alone.
if [ -z "$links" ]; then
  "$build/bin/cumulet-scene" "$stage/scene" --voxels 150000 --frame 12 >"$stage/scene.log"
  while IFS=$'\t' read -r name limits flags; do
    IFS='|' read -ra words <<<"${flags//@SCENE@/$stage/scene}"
    IFS='|' read -ra limit <<<"$limits"
    "$build/bin/cumulet-render" "${words[@]}" --seed 1 -o "$stage/$name.exr" 2>>"$stage/render.log"
    printf '%s\t%s\n' "$name" "$("$build/bin/cumulet-compare" "$stage/$name.exr" "$out/golden/$name.exr" "${limit[@]}" || true)"
  done <"$out/golden/pictures.txt" >"$out/golden/errors.txt"
fi

cp -r "$root/glsl" "$out/glsl"
python3 -B "$here/shader_variants.py" "$root/glsl" "$root/tests/bench" "$out/shaders"
mkdir -p "$out/hdda/nanovdb" "$out/data"
cp "$root"/tests/bench/*_hdda.glsl "$out/hdda"
nanovdb=$(find /usr/include /usr/local/include -name PNanoVDB.h 2>/dev/null | sed -n 1p)
[ -z "$nanovdb" ] || cp "$nanovdb" "$out/hdda/nanovdb"
disney=$root/../shared/data/vdb/wdas/wdas_cloud_sixteenth.vdb
[ ! -f "$disney" ] || cp "$disney" "$out/data"
cp "$here/run.sh" "$out"
git -C "$root" rev-parse --short HEAD >"$out/commit.txt" 2>/dev/null || echo unknown >"$out/commit.txt"

chmod -R u+w "$out"
mib=$(($(du -s --apparent-size --block-size=1 "$out" | cut -f1) / 1048576))
echo "$out: $mib MiB"
[ "$mib" -lt "$max_mib" ] || fail "the folder must be smaller than $max_mib MiB"
