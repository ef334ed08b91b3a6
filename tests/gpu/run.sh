#!/bin/bash
# Measures the GPU of this machine. The folder was made by pack.sh. Appends each row at once to table.csv, so that a run
# that is stopped keeps its rows: section, name, repeat, value, unit, note.
# Usage: run.sh [--rehearse] [--seconds N] [--out DIR]
#   --rehearse  small volumes and images, to test this script with a software driver
#   --seconds   time limit (default: 540); sections that do not fit are skipped, with a row
#   --out       folder of the table and the logs (default: results, beside this script)
set -uo pipefail
here=$(cd "$(dirname "$0")" && pwd)
rehearse='' limit=540 out=$here/results
while [ $# -gt 0 ]; do
  case $1 in
    --rehearse) rehearse=1 ;;
    --seconds) limit=${2:?} && shift ;;
    --out) out=${2:?} && shift ;;
    *) echo "usage: run.sh [--rehearse] [--seconds N] [--out DIR]" >&2; exit 2 ;;
  esac
  shift
done
SECONDS=0
mkdir -p "$out" || exit 1
out=$(cd "$out" && pwd)
work=$(mktemp -d)
scene_job=''
# shellcheck disable=SC2317 # called by trap
clean() {
  [ -z "$scene_job" ] || kill "$scene_job" 2>/dev/null
  rm -rf "$work"
}
trap clean EXIT
table=$out/table.csv
log=$out/run.log
: >"$log"
[ -s "$table" ] || echo "section,name,repeat,value,unit,note" >"$table"
failures=0

trim() { # TEXT: prints it without blanks at its ends
  sed 's/^ *//; s/ *$//' <<<"$1"
}
row() { # SECTION NAME REPEAT VALUE UNIT NOTE
  local note=${6//\"/\'}
  printf '%s,"%s",%s,%s,%s,"%s"\n' "$1" "$2" "$3" "$4" "$5" "${note//$'\n'/ }" | tee -a "$table"
}
failed() { # SECTION NAME NOTE
  failures=$((failures + 1))
  row "$1" "$2" "" "" failed "$3"
}
left() { echo $((limit - SECONDS)); }
# fits SECTION SECONDS: returns 0 if that much time is left. Otherwise a row says that the section is skipped.
fits() {
  [ "$(left)" -ge "$2" ] || { row "$1" all "" "" skipped "$(left) s left, needs $2"; return 1; }
}
within() { # SECONDS COMMAND...: runs it for at most this time and the time that is left
  local seconds=$1
  shift
  [ "$(left)" -ge "$seconds" ] || seconds=$(left)
  [ "$seconds" -gt 0 ] || return 124
  timeout -k 5 "$seconds" "$@"
}

# Sizes.
size=1024x1024 few=32 many=1024 paper_spp=64 repeats=3 small_voxels=22e6 large_voxels=1.8e8
peers=(--size 512 --samples 32 --repeats 3 --error-samples 64 --threshold 0.6 0.3 0.15 --target 0.01)
pace_frames=200 grid_flags=() filter='*-*osmesa*' pictures=6
if [ -n "$rehearse" ]; then
  size=32x32 few=2 many=4 paper_spp=8 repeats=1 small_voxels=10000 large_voxels=20000
  peers=(--size 16 --samples 2 --repeats 2 --error-samples 2 --threshold 0.6 --target 0.5)
  pace_frames=8 grid_flags=(--once) pictures=1
  filter='*WhiteFurnace*:*RefinementStops*:*FireWithoutDensity*:*StateReader*:*Contract02*-*osmesa*'
fi
sun=(--sun "60,40 2.6,2.5,2.3")
sky=(--sky "0.2,0.3,0.5")
paper=("${sun[@]}" --sun-angle 0 --sky "0,0,0" --albedo "0.8,0.8,0.8")

# Programs, and libraries that the machine may lack.
if [ ! -d "$here/programs" ]; then
  tar -xf "$here/programs.tar.xz" -C "$here" 2>>"$log" ||
    python3 -c 'import sys, tarfile; tarfile.open(sys.argv[1]).extractall(sys.argv[2])' "$here/programs.tar.xz" "$here" || exit 1
fi
programs=$here/programs
has_library() { PATH=$PATH:/sbin:/usr/sbin ldconfig -p | grep -q "$1"; }
if [ -d "$programs/lib" ]; then
  libraries=$programs/lib:$programs/extra
  for library in 'libstdc++\.so\.6' 'libz\.so\.1' 'libzstd\.so\.1' 'liblzma\.so\.5'; do
    has_library "$library" || { libraries+=:$programs/lib/fallback && break; }
  done
  has_library 'libEGL\.so\.1' || libraries+=:$programs/loaders
  nvidia=/usr/local/nvidia
  if ! has_library 'libEGL_nvidia\.so' && [ -d "$nvidia/lib64" ]; then libraries+=:$nvidia/lib64; fi
  export LD_LIBRARY_PATH=$libraries${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
  vendor=$nvidia/share/glvnd/egl_vendor.d/10_nvidia.json
  if ! ls /usr/share/glvnd/egl_vendor.d/*nvidia* /etc/glvnd/egl_vendor.d/*nvidia* >/dev/null 2>&1 && [ -f "$vendor" ]; then
    export __EGL_VENDOR_LIBRARY_FILENAMES=$vendor
  fi
fi
export CUMULET_BENCH_GLSL=$here/glsl CUMULET_BENCH_PEERS=$here/hdda

number() { # KEY FILE: prints a number of a statistics file
  sed -n "s/^ *\"$1\": *\([-0-9.e+]*\),*$/\1/p" "$2" | sed -n 1p
}
# render NAME FLAGS...: renders out of sight; the statistics are in $work/NAME.json.
render() {
  local name=$1
  shift
  within 120 "$programs/bin/cumulet-render" --shader-cache "$work/cache" --stats "$work/$name.json" -o "$work/$name.exr" \
    "$@" >>"$log" 2>&1 </dev/null
}

# ---- the machine ----
render first --volume "$here/data/wdas_cloud_sixteenth.vdb" --size 32x32 --spp 1 ||
  { "$programs/bin/cumulet-scene" --only cumulus --voxels 20000 "$work/first" && render first --volume "$work/first/cumulus.vdb" --size 32x32 --spp 1; } >>"$log" 2>&1 ||
  { failed machine first "no picture: $(tail -n 3 "$log")"; exit 1; }
row machine card "" "" "" "$(sed -n 's/^ *"renderer": "\(.*\)",*$/\1/p' "$work/first.json")"
row machine driver "" "" "" "$(sed -n 's/^ *"version": "\(.*\)",*$/\1/p' "$work/first.json")"
row machine date "" "" "" "$(date -u +%Y-%m-%dT%H:%MZ), commit $(cat "$here/commit.txt")${rehearse:+, rehearsal}"
row machine processors "" "$(nproc)" cores "$(sed -n 's/^model name.*: //p' /proc/cpuinfo | sed -n 1p)"

# The volumes are made in the background, the small one first.
make_volumes() {
  "$programs/bin/cumulet-scene" --only cumulus --voxels "$small_voxels" "$work/small.part" && mv "$work/small.part" "$work/small"
  "$programs/bin/cumulet-scene" --only cumulus --voxels "$large_voxels" "$work/large.part" && mv "$work/large.part" "$work/large"
}
make_volumes >>"$log" 2>&1 &
scene_job=$!
wait_for() { # FOLDER SECONDS: waits for a volume
  local until=$((SECONDS + $2))
  while [ ! -d "$1" ] && [ "$SECONDS" -lt "$until" ] && [ "$(left)" -gt 0 ]; do sleep 0.2; done
  [ -d "$1" ]
}

# ---- pictures ----
compare_pictures() {
  local name limits flags words bounds result verdict worst
  "$programs/bin/cumulet-scene" "$work/scene" --voxels 150000 --frame 12 >>"$log" 2>&1
  while IFS=$'\t' read -r name limits flags; do
    IFS='|' read -ra words <<<"${flags//@SCENE@/$work/scene}"
    IFS='|' read -ra bounds <<<"$limits"
    if ! render "$name" "${words[@]}"; then
      failed picture "$name" "$(tail -n 1 "$log")"
      continue
    fi
    verdict=ok
    result=$("$programs/bench/cumulet-compare" "$work/$name.exr" "$here/golden/$name.exr" "${bounds[@]}") || verdict=DIFFERS
    [ "$verdict" = ok ] || failures=$((failures + 1))
    worst=${result#*worst block }
    row picture "$name" "" "${worst%% *}" % \
      "$verdict: $result; another seed on llvmpipe: $(sed -n "s/^$name\t//p" "$here/golden/errors.txt" 2>/dev/null)"
  done < <(head -n "$pictures" "$here/golden/pictures.txt")
  render seed_a --volume "$work/scene/cumulus.vdb" --size 96x72 --spp 8 --seed 3
  render seed_b --volume "$work/scene/cumulus.vdb" --size 96x72 --spp 8 --seed 3
  if cmp -s "$work/seed_a.exr" "$work/seed_b.exr"; then
    row picture same_seed "" 1 "" "two renders are bit-identical"
  else
    failed picture same_seed "two renders with one seed differ"
  fi
  # Both kernels compute the same, but a compiler may round differently in each.
  render two_paths --shaders "$here/shaders/two_paths" --volume "$work/scene/cumulus.vdb" --size 96x72 --spp 8 --seed 3
  if cmp -s "$work/seed_a.exr" "$work/two_paths.exr"; then
    row picture "two paths a lane" "" 1 "" "bit-identical with one path a lane"
  elif [ -z "$rehearse" ] && result=$("$programs/bench/cumulet-compare" "$work/two_paths.exr" "$work/seed_a.exr" --tolerance 0.3 --bias 0.03); then
    row picture "two paths a lane" "" 0 "" "ok: $result; against one path a lane"
  else
    failed picture "two paths a lane" "${result:-differs from one path a lane}"
  fi
  # By the same rules both kernels have the same mean.
  local same=(--volume "$work/scene/cumulus.vdb" --size 96x72 --spp "$paper_spp" --density-scale 1 --cells constant "${paper[@]}")
  render paper_rules --shaders "$here/shaders/paper_rules" "${same[@]}"
  render paper_kernel --shaders "$here/shaders/paper_kernel" "${same[@]}"
  if result=$("$programs/bench/cumulet-compare" "$work/paper_kernel.exr" "$work/paper_rules.exr" --tolerance 0.3 --bias 0.03); then
    row picture "paper's kernel" "" 1 "" "ok: $result; against our kernel by the same rules"
  else
    failed picture "paper's kernel" "$result; against our kernel by the same rules"
  fi
}

# ---- headline ----
# headline VOLUME NAME CASE...: each case is rendered `repeats` times, interleaved. A case is "NAME|SPP|FLAGS".
headline() {
  local volume=$1 label=$2 repeat cells entry name depth spp flags words scale
  shift 2
  # The log of the first run has the density scale for a mean optical depth of 8.
  within 120 "$programs/bin/cumulet-render" --volume "$volume" --density-scale auto --size 32x32 --spp 1 \
    --shader-cache "$work/cache" --stats "$work/scale.json" -o "$work/scale.exr" >"$work/scale.log" 2>&1 </dev/null
  scale=$(sed -n 's/.*density scale \([-0-9.e+]*\) for a mean.*/\1/p' "$work/scale.log" | sed -n 1p)
  [ -n "$scale" ] || { failed headline "$label" "no density scale: $(tail -n 1 "$work/scale.log")"; return; }
  row headline "$label" "" "$(number active_voxels "$work/scale.json")" voxels "density scale $scale for a mean optical depth of 8"
  for ((repeat = 1; repeat <= repeats; ++repeat)); do
    for entry in "$@"; do
      IFS='|' read -r name depth spp flags <<<"$entry"
      IFS='|' read -ra words <<<"$flags"
      fits headline 15 || return
      if render headline --volume "$volume" --size "$size" --spp "$spp" \
        --density-scale "$(awk "BEGIN {print $scale * $depth / 8}")" "${words[@]}"; then
        cells=$(number cells "$work/headline.json")
        row headline "$label, $name, $spp spp" "$repeat" "$(number trace_seconds "$work/headline.json")" s \
          "$(number samples_per_second "$work/headline.json") samples/s, $(number mean_steps_per_path "$work/headline.json") steps per path${cells:+, $cells cells}"
      else
        failed headline "$label, $name, $spp spp" "$(tail -n 1 "$log")"
      fi
    done
  done
}
join() { local IFS='|'; echo "$*"; }
ours=$(join "${sun[@]}" "${sky[@]}")
two_paths=$(join --shaders "$here/shaders/two_paths" "${sun[@]}" "${sky[@]}")
paper_rules=$(join --shaders "$here/shaders/paper_rules" "${paper[@]}")
paper_kernel=$(join --shaders "$here/shaders/paper_kernel" --cells constant "${paper[@]}")
cases=("tet|10|$few|$ours" "tet, two paths a lane|10|$few|$two_paths" "dense|10|$few|$ours|--grid-type|dense" "tet, paper's rules|10|$few|$paper_rules"
  "paper's kernel|10|$few|$paper_kernel" "tet, depth 60|60|$few|$ours" "tet, two paths a lane, depth 60|60|$few|$two_paths"
  "tet|10|$many|$ours" "tet, two paths a lane|10|$many|$two_paths"
  "tet, paper's rules|10|$many|$paper_rules")

# ---- the other sections ----
gl_tests() {
  local test output passed
  for test in trace_test gpu_grid_test gpu_grid_build_test gl_state_test contract_test; do
    fits tests 10 || return
    output=$(within 60 "$programs/tests/$test" --gtest_filter="$filter" --gtest_brief=1 2>&1 </dev/null | tee -a "$log" | tail -n 40)
    passed=$(sed -n 's/.*PASSED  \] \([1-9][0-9]*\) test.*/\1/p' <<<"$output")
    if [ -n "$passed" ] && ! grep -q '\[  FAILED  \]' <<<"$output"; then
      row tests "$test" "" "$passed" passed ""
    else
      failed tests "$test" "$(tail -n 5 <<<"$output")"
    fi
  done
}
hdda() {
  local line fields
  within 120 "$programs/bench/cumulet-bench" --peers --by-clock --input "cumulus=$work/small/cumulus.vdb" --optical-depth 10 \
    "${peers[@]}" --block-bytes 4000000000 >"$work/peers.txt" 2>>"$log"
  cat "$work/peers.txt" >>"$log"
  grep -q '^| HDDA' "$work/peers.txt" || { failed hdda all "$(tail -n 1 "$log")"; return; }
  while read -r line; do
    IFS='|' read -ra fields <<<"$line"
    row hdda "$(trim "${fields[1]}")" "" "$(tr -d ' ' <<<"${fields[9]}")" "x tet, time to equal variance" "$line"
  done < <(grep '^|' "$work/peers.txt" | tail -n +3)
}
grids() {
  local line
  within 60 "$programs/bench/cumulet-bench-grid" "${grid_flags[@]}" --density-scale 0.1 "$work/small/cumulus.vdb" \
    >"$work/grids.txt" 2>>"$log" || { failed grid all "$(tail -n 1 "$log")"; return; }
  cat "$work/grids.txt" >>"$log"
  while read -r line; do
    row grid "$(trim "${line%%[0-9]* cells:*}")" "" "$(sed -n 's/.*GL *\([0-9.]*\) ms.*/\1/p' <<<"$line")" "ms by GL" "$line"
  done < <(grep -E 'cells:|refit' "$work/grids.txt")
}
pace() {
  local line fields
  within 60 "$programs/bench/cumulet-bench-pace" "$work/small/cumulus.vdb" "$pace_frames" 4 8 >"$work/pace.txt" 2>>"$log" ||
    { failed pace all "$(tail -n 1 "$log")"; return; }
  cat "$work/pace.txt" >>"$log"
  while read -r line; do
    IFS='|' read -ra fields <<<"$line"
    row pace "$(trim "${fields[1]}"), budget $(trim "${fields[2]}") ms, p50" "" "$(tr -d ' ' <<<"${fields[3]}")" ms ""
    row pace "$(trim "${fields[1]}"), budget $(trim "${fields[2]}") ms, p95" "" "$(tr -d ' ' <<<"${fields[4]}")" ms ""
  done < <(grep '^|' "$work/pace.txt" | tail -n +3)
}

compare_pictures
if wait_for "$work/small" 90; then
  headline "$work/small/cumulus.vdb" small "${cases[@]}"
  fits hdda 60 && hdda
  fits grid 20 && grids
  fits pace 20 && pace
else
  failed headline small "the volume was not made in time"
fi
if fits headline_large 60 && wait_for "$work/large" 120; then
  headline "$work/large/cumulus.vdb" large "${cases[@]:0:8}"
fi
fits tests 10 && gl_tests
row end all "" "$SECONDS" s "$failures failed"
[ "$failures" -eq 0 ]
