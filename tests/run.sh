#!/bin/bash
# Runs every test. Installs the missing Debian packages, builds, and runs the tests. Runs the unit tests again under
# AddressSanitizer and UndefinedBehaviorSanitizer, and checks format, scripts and code (clang-tidy).
# The last line is "N passed, N failed" (", N skipped"); the exit status is 0 if none failed.
# --quick: only the release build's tests, without those labelled slow. --long: everything, clang-tidy with the static
# analyzer, then the tests of threads under ThreadSanitizer, the soak test, most tests through OSMesa, the images of all
# drivers and a minute of each fuzzer (an hour and a half more).
# --minutes N: after N minutes, starts no further step that follows the release build's tests. Such steps count as
# skipped. For machines that end the script after a time limit and discard its output.
# shellcheck source=scripts/common.sh
. "$(dirname "${BASH_SOURCE[0]}")/../scripts/common.sh"

tier=all
minutes=1000000
while [ $# -gt 0 ]; do
  case $1 in
    --quick) tier=quick ;;
    --long) tier=long ;;
    --minutes)
      [[ ${2:-} =~ ^[0-9]{1,6}$ ]] || { echo "tests/run.sh: --minutes needs a whole number" >&2; exit 2; }
      minutes=$2
      shift
      ;;
    -h | --help)
      echo "usage: tests/run.sh [--quick | --long] [--minutes N]"
      echo "  --quick: the release build's tests, but for slow ones; --long: soak, analyzer, ThreadSanitizer and fuzzers, too;"
      echo "  --minutes: of what follows the release build's tests nothing begins later, and the rest counts as skipped"
      exit 0
      ;;
    *)
      echo "tests/run.sh: unknown argument '$1'; there are --quick, --long and --minutes" >&2
      exit 2
      ;;
  esac
  shift
done
# Remaining time in seconds; less than 1 means none.
time_left() { echo $((60 * minutes - SECONDS + script_started)); }

launcher=() # command in front of ctest
passed=0 failed=0 skipped=0
count() { # PASSED FAILED SKIPPED
  passed=$((passed + $1)) failed=$((failed + $2)) skipped=$((skipped + $3))
}

failures=() # printed again at the end, for readers who see only the end of a long log
fail() { # WHAT: records a failure, which counts as one test
  count 0 1 0
  failures+=("$1")
}

left_out() { # WHAT: records a check skipped for lack of time, which counts as one test
  count 0 0 1
  say "left out for time: $1"
}

# Files that killed tests leave behind are deleted with this folder.
TMPDIR=$(mktemp -d)
export TMPDIR

finish() {
  trap - EXIT
  rm -rf "$TMPDIR"
  say "all done"
  [ "${#failures[@]}" -eq 0 ] || printf 'FAILED: %s\n' "${failures[@]}"
  if [ "$skipped" -gt 0 ]; then
    echo "$passed passed, $failed failed, $skipped skipped"
  else
    echo "$passed passed, $failed failed"
  fi
  [ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
  exit
}
# Prints the closing line even if the script ends early.
trap 'fail "$(basename "$0") ended early"; finish' EXIT
trap 'exit 130' INT TERM

check() { # NAME COMMAND...: runs one check, which counts as one test
  local name=$1 since=$SECONDS
  shift
  say "$name"
  if "$@"; then
    count 1 0 0
    say "$name: passed in $(elapsed "$since")"
  else
    fail "$name"
    say "$name: FAILED after $(elapsed "$since")"
  fi
}

run_ctest() { # NAME FOLDER CTEST_OPTION...: runs the tests of a build; each counts
  local name=$1 folder=$2 since=$SECONDS report total bad skips
  shift 2
  report=$root/build/$name.junit.xml
  rm -f "$report"
  say "$name: running"
  "${launcher[@]}" ctest --test-dir "$folder" --output-on-failure --progress --no-tests=error --parallel "$jobs" \
    --output-junit "$report" "$@" || true
  total=$(junit tests "$report") bad=$(junit failures "$report")
  skips=$(($(junit skipped "$report") + $(junit disabled "$report")))
  if [ "${total:-0}" -eq 0 ]; then
    say "$name: no test ran"
    fail "$name: no test ran"
    return
  fi
  mapfile -t -O "${#failures[@]}" failures < <(failed_tests "$name" "$report")
  count $((total - bad - skips)) "$bad" "$skips"
  say "$name: $bad of $total failed, in $(elapsed "$since")"
}

# failed_tests NAME FILE: prints the failed tests of a ctest report, each with the end of its output.
failed_tests() {
  python3 - "$@" <<'EOF'
import sys
import xml.etree.ElementTree as xml

for case in xml.parse(sys.argv[2]).iter("testcase"):
    if case.get("status") == "fail":
        output = (case.findtext("system-out") or "").strip().replace("\n", " | ")
        print(f"{sys.argv[1]}: {case.get('name')}: {output[-600:]}")
EOF
}

junit() { # ATTRIBUTE FILE: prints an attribute of the test suite, or 0 if it is absent
  local value
  value=$(sed -n "/<testsuite/,/>/s/.*[[:space:]]$1=\"\([0-9]*\)\".*/\1/p" "$2" 2>/dev/null | sed -n 1p || true)
  echo "${value:-0}"
}

# shellcheck disable=SC2317 # called by check
format_check() {
  find src demo tests \( -name '*.[ch]' -o -name '*.[ch]pp' \) -print0 | xargs -0 clang-format --dry-run --Werror
}

# shellcheck disable=SC2317 # called by check
script_check() {
  shellcheck -x .ci/run demo/run.sh scripts/*.sh tests/run.sh tests/docs/*.sh tests/embed/*.sh tests/fuzz/*.sh tests/gpu/*.sh tests/package/*.sh
}

# shellcheck disable=SC2317 # called by xargs
tidy_one() { # STAMP SOURCE
  local log
  [ "$(date +%s)" -lt "$tidy_until" ] || { : >"$1.left"; echo "  left    $2"; return; }
  # A tenth of the analyzer's default budget per function, if the analyzer runs.
  if log=$(clang-tidy --quiet -p build/release --checks="$tidy_checks" --extra-arg=-Wno-unknown-warning-option \
    --extra-arg=-Xclang --extra-arg=-analyzer-config --extra-arg=-Xclang --extra-arg=max-nodes=22500 "$2" 2>&1); then
    : >"$1"
    echo "  ok      $2"
  else
    printf '%s\n  FAILED  %s\n' "$log" "$2"
  fi
}
export -f tidy_one
# Only the long tier runs the static analyzer, which takes a third of the time. Sanitizers find such errors in each run.
tidy_checks=
[ "$tier" = long ] || tidy_checks='-clang-analyzer-*'
export tidy_checks

# Runs clang-tidy on src/ and demo/, except for files that include OpenVDB, which take more than a minute each. Each
# file is a check. A file that passed is checked again only when the file, one of our headers that it includes or the
# rules have changed. The results are stored next to the ccache, for other clones as well.
tidy() {
  local stamps=${XDG_CACHE_HOME:-${HOME:-$root/build}/.cache}/cumulet/tidy since=$SECONDS
  local rules source includes sources=() keys=() todo=() files
  mkdir -p "$stamps"
  find "$stamps" -type f -mtime +30 -delete
  say "clang-tidy"
  rules=$({ cat .clang-tidy; echo "$tidy_checks"; clang-tidy --version; } | sha256sum)
  # ninja's list of the includes of each object file. Prints the source and our headers for the files without OpenVDB.
  while read -r -a includes; do
    source=${includes[0]}
    sources+=("$source")
    keys+=("$stamps/$({ echo "$rules $source"; cat "${includes[@]}"; } | sha256sum | cut -c1-32)")
  done < <(ninja -C build/release -t deps | awk -v root="$root/" '
    /^[^ ].*: #deps/ { flush(); next }
    /^    / {
      file = $1
      if (file ~ /\/openvdb\/openvdb\.h$|\/openvdb\/.*\.h$/) vdb = 1
      if (file !~ /^\//) file = root "build/release/" file
      while (sub("/[^/.][^/]*/[.][.]/", "/", file)) {}
      if (index(file, root) == 1) ours = ours " " substr(file, length(root) + 1)
    }
    END { flush() }
    function flush() {
      if (ours && !vdb) print substr(ours, 2)
      ours = ""; vdb = 0
    }' | grep -E '^(src|demo)/[^ ]*\.cpp( |$)' | LC_ALL=C sort -u -k 1,1 || true)
  files=${#sources[@]}
  [ "$files" -gt 0 ] || { say "clang-tidy: found no files"; fail "clang-tidy: found no files"; return; }
  local i
  for ((i = 0; i < files; ++i)); do
    [ -e "${keys[i]}" ] || todo+=("${keys[i]}" "${sources[i]}")
  done
  say "clang-tidy: $((${#todo[@]} / 2)) of $files files have changed"
  rm -f "$stamps"/*.left
  tidy_until=$(($(date +%s) + $(time_left)))
  export tidy_until
  if [ "${#todo[@]}" -gt 0 ]; then
    printf '%s\0' "${todo[@]}" | xargs -0 -n 2 -P "$jobs" bash -c 'tidy_one "$@"' tidy || true
  fi
  local good=0 left=0
  for ((i = 0; i < files; ++i)); do
    if [ -e "${keys[i]}" ]; then
      good=$((good + 1))
    elif [ -e "${keys[i]}.left" ]; then
      left=$((left + 1))
    else
      failures+=("clang-tidy: ${sources[i]}")
    fi
  done
  count "$good" $((files - good - left)) "$left"
  say "clang-tidy: $((files - good - left)) of $files failed, $left left out for time, in $(elapsed "$since")"
}

# The tests run without display and session, so that their results do not depend on them.
unset DISPLAY WAYLAND_DISPLAY XDG_RUNTIME_DIR
# Tests share Mesa's cache of compiled shaders, in the build folder even if there is no home folder.
export MESA_SHADER_CACHE_DIR=$root/build/mesa MESA_SHADER_CACHE_MAX_SIZE=4G
mkdir -p "$MESA_SHADER_CACHE_DIR"
export CTEST_OUTPUT_ON_FAILURE=1
install_packages test

# build_and_test PRESET TARGETS FOLDER CTEST_OPTION...
build_and_test() {
  local preset=$1 targets=$2 folder=build/$1/$3
  shift 3
  # shellcheck disable=SC2086 # words
  if build "$preset" $targets; then
    run_ctest "$preset" "$folder" "$@"
  else
    fail "$preset: did not build"
  fi
}

# Runs the tests of the sanitizer build in groups of programs, as long as time remains.
sanitized_tests() {
  local folder=build/sanitize/tests/unit group=16 names=() first status=0 some
  if [ "$(time_left)" -lt 1 ]; then
    left_out "sanitize: nothing was built"
    return
  fi
  build_within=(timeout "$(time_left)")
  build sanitize cumulet_sanitized_tests || status=$?
  build_within=()
  case $status in
    0) ;;
    124) left_out "sanitize: not all was built"; return ;;
    *) fail "sanitize: did not build"; return ;;
  esac
  mapfile -t names < <(ctest --test-dir "$folder" --show-only --label-exclude long | sed -n 's/^ *Test *#[0-9]*: //p')
  [ "${#names[@]}" -gt 0 ] || { fail "sanitize: found no tests"; return; }
  for ((first = 0; first < ${#names[@]}; first += group)); do
    if [ "$(time_left)" -lt 1 ]; then
      left_out "sanitize: ${names[*]:first}"
      return
    fi
    printf -v some '%s|' "${names[@]:first:group}"
    run_ctest "sanitize_$first" "$folder" --tests-regex "^(${some%|})\$"
  done
}

if [ "$tier" = quick ]; then
  build_and_test release "" . --label-exclude 'slow|long'
  finish
fi
build_and_test release "" . --label-exclude long
check "clang-format" format_check
check "shellcheck" script_check
# Ignores leaks inside the software GL driver and TBB. intercept_tls_get_addr=0: the leak checker of GCC 12 mistakes the
# bytes before a block of dynamic TLS for a header of glibc 2.19 and sometimes crashes at exit. Such blocks are also
# found from the heap.
export ASAN_OPTIONS=detect_odr_violation=0:strict_string_checks=1:intercept_tls_get_addr=0
export LSAN_OPTIONS=suppressions=$root/tests/leaks.supp:print_suppressions=0
export UBSAN_OPTIONS=print_stacktrace=1
if [ "$tier" = all ]; then
  sanitized_tests
else
  build_and_test sanitize tests/unit/all tests/unit
  run_ctest release-long build/release --label-regex long
  # Ignores races in modules without ThreadSanitizer instrumentation. One core limits TBB to one thread, because its way
  # of waiting would be reported as races. The library itself still has several threads.
  export TSAN_OPTIONS=ignore_noninstrumented_modules=1:history_size=7:suppressions=$root/tests/threads.supp
  export LP_NUM_THREADS=0
  launcher=(taskset --cpu-list "$(taskset --cpu-list --pid $$ | sed 's/.*: \([0-9]*\).*/\1/')")
  build_and_test tsan cumulet_threads_tests . --label-regex threads
  launcher=()
  build_and_test fuzz cumulet_fuzzers tests/fuzz
fi
# Last, because the time may not suffice for all files.
tidy
finish
