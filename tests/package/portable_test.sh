#!/bin/bash
# The portable tarball runs on a system without our libraries: in a root folder that contains only the C library, then
# in one that also contains Mesa. Usage: portable_test.sh BUILD_DIR
# shellcheck source=tests/package/root.sh
. "$(dirname "$0")/root.sh"

pack "$1" TGZ
tarball=$(find "$work/pack" -maxdepth 1 -name 'cumulet-*.tar.gz')
[ -n "$tarball" ] || fail "cpack wrote no tarball"
echo "$(basename "$tarball"): $(($(stat -c %s "$tarball") / 1048576)) MiB"

# The tarball contains the right set of libraries.
tar -tzf "$tarball" >"$work/list"
if grep -E '/lib(c|m|pthread|dl|rt|GL|GLX|EGL|OSMesa|X11|xcb|gbm|drm)(-[0-9.]+)?\.so|/ld-linux' "$work/list"; then
  fail "the tarball holds libraries that must be the system's"
fi
for wanted in lib/libcumulet.so.0 lib/fallback/libstdc++.so.6 share/doc/cumulet/LICENSE include/cumulet/cumulet.h \
  include/cumulet/cumulet.hpp include/cumulet/cumulet_descriptors.hpp include/cumulet/cumulet_openvdb.hpp \
  share/doc/cumulet/README.md share/doc/cumulet/CHANGELOG.md share/doc/cumulet/docs/scene_file.md \
  share/man/man1/cumulet-render.1 share/applications/cumulet-demo.desktop; do
  grep -q "/$wanted\$" "$work/list" || fail "the tarball lacks $wanted"
done

new_root() { # ROOT: adds the C library and the unpacked tarball in /opt
  bare_root "$1"
  tar -xzf "$tarball" -C "$1/opt" --strip-components=1
}

# 1. Only the C library. Programs that need no OpenGL run, with the bundled C++ runtime.
bare=$work/bare
new_root "$bare"

# Our files search only folders of the tree, and all of these exist.
while IFS=$'\t' read -r file path; do
  for folder in ${path//:/ }; do
    # shellcheck disable=SC2016 # $ORIGIN is the loader's
    if [[ $folder != '$ORIGIN'* ]] || [ ! -d "$(dirname "$file")/${folder#'$ORIGIN'}" ]; then
      fail "$(basename "$file") looks for libraries in $folder"
    fi
  done
done < <(rpaths "$bare/opt")

in_root "$bare" /opt/bin/cumulet-scene --voxels 20000 /tmp/scene || fail "cumulet-scene did not run in a root with the C library alone"
volume=$(find "$bare/tmp/scene" -name '*.vdb' | sort | head -n1)
[ -s "$volume" ] || fail "cumulet-scene wrote no .vdb"
in_root "$bare" /opt/bin/cumulet-render --help >"$work/help" || fail "cumulet-render --help did not run there"
grep -q -- --volume "$work/help" || fail "cumulet-render --help does not name --volume"

# 2. With Mesa, whose libraries share the process with the bundled ones.
mesa=$work/mesa
new_root "$mesa"
add_mesa "$mesa"
refuse_own_libraries "$mesa" tarball
cp -r "$bare/tmp/scene" "$mesa/tmp/scene"
for backend in "${backends[@]}"; do
  in_root "$mesa" /opt/bin/cumulet-render --volume "${volume#"$bare"}" --size 32x32 --spp 1 --threshold 1 \
    --backend "$backend" -o "/tmp/$backend.png" || fail "cumulet-render --backend $backend failed in a root with Mesa"
  [ -s "$mesa/tmp/$backend.png" ] || fail "cumulet-render --backend $backend wrote no picture"
done
if [ "${#backends[@]}" -gt 0 ]; then
  runtime=$(in_root "$mesa" /lib64/ld-linux-x86-64.so.2 --list /opt/bin/cumulet-render)
  grep -q 'libstdc++.so.6 => /opt/bin/../lib/host/' <<<"$runtime" || fail "the driver's C++ runtime was not preferred"
fi
echo "ran with the C library alone, and with Mesa by: ${backends[*]:-none: no Mesa here}"
