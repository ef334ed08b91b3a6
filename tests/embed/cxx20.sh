#!/bin/sh
# cxx20.sh COMPILER INCLUDE...: cumulet.hpp compiles as C++20. With an older standard it causes a single error that says
# so. MSVC has a macro of its own for the standard.
set -eu
compiler=$1
shift
# Prints the compiler's error lines.
errors() {
  printf '#include <cumulet/cumulet.hpp>\n' | LC_ALL=C "$compiler" "$@" -fsyntax-only -x c++ - 2>&1 | grep ': error: ' || true
}
includes=""
for folder in "$@"; do includes="$includes -I$folder"; done
failed=0
expect() {
  wanted=$1
  shift
  # shellcheck disable=SC2086  # folders of builds have no blanks
  found=$(errors $includes "$@")
  count=$(printf '%s' "$found" | grep -c ': error: ' || true)
  case $wanted in
    none) [ "$count" -eq 0 ] && return ;;
    one) [ "$count" -eq 1 ] && printf '%s' "$found" | grep -q 'cumulet.hpp needs C++20' && return ;;
  esac
  printf 'with %s: expected %s error, found %s:\n%s\n' "$*" "$wanted" "$count" "$found"
  failed=1
}
expect none -std=c++20
expect one -std=c++17
expect one -std=c++14
expect one -std=c++20 -D_MSVC_LANG=201703L
expect none -std=c++20 -D_MSVC_LANG=202002L
exit $failed
