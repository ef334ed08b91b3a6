# Sourced by tests that run packaged files in their own root folder. Provides a work folder and functions to pack and to
# enter a root.
# shellcheck shell=bash
set -euo pipefail
name=$(basename "$0" .sh)
PATH=$PATH:/usr/sbin:/sbin
if [ "$(id -u)" = 0 ]; then
  enter=("$(command -v chroot)")
elif unshare --map-root-user true 2>/dev/null; then
  enter=("$(command -v unshare)" --map-root-user "$(command -v chroot)")
else
  echo "$name: skipped: chroot needs root, or user namespaces"
  exit 77
fi

fail() { echo "$name: $*" >&2; exit 1; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

pack() { # BUILD_DIR GENERATOR: runs cpack; the packages are in $work/pack
  (cd "$1" && cpack -G "$2" -B "$work/pack") >"$work/cpack.log" 2>&1 || { cat "$work/cpack.log"; fail "cpack failed"; }
}

in_root() { # ROOT PROGRAM ARGS...: runs it with an empty environment; the loader reads $ORIGIN from /proc/self/exe
  mkdir -p "$1/proc/self"
  ln -sfn "$2" "$1/proc/self/exe"
  env -i "${enter[@]}" "$@"
}

# copy_file FILE ROOT: copies the file under the given name, as a hard link where possible.
copy_file() {
  mkdir -p "$2$(dirname "$1")"
  [ -e "$2$1" ] || cp -lL "$1" "$2$1" 2>/dev/null || cp -L "$1" "$2$1"
}

bare_root() { # ROOT: adds the C library, the loader, /tmp and /dev/null
  mkdir -p "$1/opt" "$1/tmp" "$1/dev" "$1/proc/self" "$1/usr/lib" "$1/usr/lib64"
  ln -s usr/lib usr/lib64 "$1"
  : >"$1/dev/null"
  local library
  for library in ld-linux-x86-64.so.2 libc.so.6 libm.so.6 libpthread.so.0 libdl.so.2 librt.so.1; do
    library=$(ldconfig_path "$library")
    copy_file "$library" "$1"
  done
  copy_file /lib64/ld-linux-x86-64.so.2 "$1"
}

ldconfig_path() { # SONAME: prints the library's path on this system
  ldconfig -p | awk -v name="$1" '$1 == name && /x86-64/ && !n++ {print $NF}'
}

copy_closure() { # ROOT FILE...: copies files and the libraries that they need
  local root=$1 file library
  shift
  for file in "$@"; do
    copy_file "$file" "$root"
    ldd "$file" | awk '$2 == "=>" && $3 ~ /^\// {print $3}' | while read -r library; do
      copy_file "$library" "$root"
    done
  done
}

refuse_own_libraries() { # ROOT PACKAGE: fails if the root has libraries that the package in /opt should bring
  find "$1" -path "$1/opt" -prune -o \( -name 'libopenvdb*' -o -name 'libtbb*' -o -name 'libOpenEXR*' \) -print |
    grep . && fail "the test's own root holds a library that the $2 should bring"
  return 0
}

backends=()
add_mesa() { # ROOT: adds the installed software drivers of Mesa; their names are in $backends
  local drivers egl egl_mesa osmesa vendor=/usr/share/glvnd/egl_vendor.d/50_mesa.json
  read -ra drivers <<<"$(find /usr/lib -path '*/dri/*' -name 'swrast_dri.so' -printf '%p ')"
  egl=$(ldconfig_path libEGL.so.1) egl_mesa=$(ldconfig_path libEGL_mesa.so.0) osmesa=$(ldconfig_path libOSMesa.so.8)
  if [ -n "$egl" ] && [ -n "$egl_mesa" ] && [ -f "$vendor" ] && [ "${#drivers[@]}" -gt 0 ]; then
    copy_closure "$1" "$egl" "$egl_mesa" "${drivers[@]}"
    copy_file "$vendor" "$1"
    backends+=(egl)
  fi
  if [ -n "$osmesa" ]; then
    copy_closure "$1" "$osmesa"
    backends+=(osmesa)
  fi
}

rpaths() { # FOLDER: prints a line "FILE<TAB>RPATH or RUNPATH" for each program and library that has one
  local file line
  while read -r file; do
    if line=$(readelf -d "$file" 2>/dev/null | sed -n 's/.*R\(UN\)*PATH).*\[\(.*\)\]/\2/p') && [ -n "$line" ]; then
      printf '%s\t%s\n' "$file" "$line"
    fi
  done < <(find "$1" -type f \( -path '*/bin/*' -o -name '*.so*' \))
}
