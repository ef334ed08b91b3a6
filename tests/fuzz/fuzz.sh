#!/bin/bash
# Runs a fuzzer for CUMULET_FUZZ_SECONDS (60) from its seeds, corpus/ and the inputs of earlier runs. Inputs that cause
# errors stay in FUZZER.found/.
# Usage: fuzz.sh FUZZER SEEDS_PROGRAM DICTIONARY|"" [LIBFUZZER_OPTION...]
set -euo pipefail
fuzzer=$1 seeds=$2 dictionary=$3
shift 3
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$fuzzer.corpus" "$fuzzer.found"
"$seeds" "$fuzzer.seeds"
export LSAN_OPTIONS=suppressions=$here/../leaks.supp:print_suppressions=0
# libFuzzer's option applies only to single inputs; without this, LeakSanitizer would report leaks again at exit.
leaks=1
[[ " $* " != *" -detect_leaks=0 "* ]] || leaks=0
export ASAN_OPTIONS=detect_leaks=$leaks:detect_odr_violation=0:alloc_dealloc_mismatch=0:allocator_may_return_null=1
exec "$fuzzer" -max_total_time="${CUMULET_FUZZ_SECONDS:-60}" -timeout=20 -rss_limit_mb=4096 -print_final_stats=1 \
  -artifact_prefix="$fuzzer.found/" ${dictionary:+-dict="$dictionary"} "$@" "$fuzzer.corpus" "$fuzzer.seeds" \
  "$here/corpus/$(basename "$fuzzer" _fuzz)"
