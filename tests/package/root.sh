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

rpaths() { # FOLDER: prints a line "FILE<TAB>RPATH or RUNPATH" for each program and library that has one
  local file line
  while read -r file; do
    if line=$(readelf -d "$file" 2>/dev/null | sed -n 's/.*R\(UN\)*PATH).*\[\(.*\)\]/\2/p') && [ -n "$line" ]; then
      printf '%s\t%s\n' "$file" "$line"
    fi
  done < <(find "$1" -type f \( -path '*/bin/*' -o -name '*.so*' \))
}
