# Sourced by demo/run.sh and tests/run.sh.
# shellcheck shell=bash
set -euo pipefail
exec </dev/null
export DEBIAN_FRONTEND=noninteractive

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"
# The folders of build/ share the ccache: tests/run.sh does not recompile the files that demo/run.sh compiled.
export CCACHE_BASEDIR=$root CCACHE_NOHASHDIR=1
# ccache needs this to store the tests, which use precompiled headers.
export CCACHE_SLOPPINESS=pch_defines,time_macros
script_started=$SECONDS
jobs=${CUMULET_JOBS:-$(nproc)}
# Compiling OpenVDB's headers takes up to 1.5 GiB per compiler process.
memory_jobs=$(awk '/^MemAvailable/ {print int($2 / 1572864) + 1}' /proc/meminfo)
[ "$jobs" -le "$memory_jobs" ] || jobs=$memory_jobs

die() {
  echo "$(basename "$(dirname "$0")")/$(basename "$0"): $*" >&2
  exit 1
}

elapsed() { # [SINCE]: prints m:ss since SINCE, or since the script began
  local seconds=$((SECONDS - ${1:-$script_started}))
  printf '%d:%02d' $((seconds / 60)) $((seconds % 60))
}

say() { printf '[%s] %s\n' "$(elapsed)" "$*"; }

# install_packages build|test: installs the missing packages of packages.txt. If none is missing, it needs no network
# and no root.
install_packages() {
  command -v dpkg-query >/dev/null || { say "not a Debian system: assuming what scripts/packages.txt lists is there"; return; }
  local package missing=() wanted
  mapfile -t wanted < <(sed -E -e 's/#.*//' -e "s/^$1: *//" -e '/:/d' -e '/^[[:space:]]*$/d' scripts/packages.txt)
  for package in "${wanted[@]}"; do
    dpkg-query -W -f '${db:Status-Status}\n' "$package" 2>/dev/null | grep -qx installed || missing+=("$package")
  done
  [ "${#missing[@]}" -gt 0 ] || { say "packages: all ${#wanted[@]} are here"; return; }

  local as_root=()
  if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null || die "missing packages, and neither root nor sudo to install them: ${missing[*]}"
    as_root=(sudo)
  fi
  say "packages: installing ${missing[*]}"
  local log=build/packages.log
  mkdir -p build
  local install=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends "${missing[@]}")
  # The package lists may be absent or older than the archive. If the installation fails, update them and try once more.
  "${install[@]}" >"$log" 2>&1 ||
    { "${as_root[@]}" apt-get update >>"$log" 2>&1 && "${install[@]}" >>"$log" 2>&1; } ||
    { tail -n 20 "$log" >&2; die "apt-get could not install ${missing[*]} (all of it: $log)"; }
}

build_within=() # a command that limits the duration of the build

# build PRESET [TARGET...]: configures each time, because packages may have been installed, and builds. ninja shows its
# own progress.
build() {
  local preset=$1
  shift
  local folder=build/$preset since=$SECONDS
  say "configuring $folder"
  mkdir -p "$folder"
  cmake --preset "$preset" >"$folder/configure.log" 2>&1 ||
    { tail -n 30 "$folder/configure.log" >&2; echo "configuring failed (all of it: $folder/configure.log)" >&2; return 1; }
  say "building $folder with $jobs jobs"
  "${build_within[@]}" cmake --build "$folder" --parallel "$jobs" ${1:+--target "$@"} || return
  say "built $folder in $(elapsed "$since")"
}
