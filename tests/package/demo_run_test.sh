#!/bin/bash
# demo/run.sh builds only the programs that it runs, and does not need the packages marked `test:` in packages.txt.
# Usage: demo_run_test.sh SOURCE_DIR
set -euo pipefail
cd "$1"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "demo_run_test: $*" >&2; exit 1; }

read -r _ preset _ <<<"$(grep '^build ' demo/run.sh)"
# Simulates that the tests' packages are not installed: searches for them by CMake or pkg-config fail.
absent=()
for package in GTest embree Qt6 Qt6Core; do absent+=("-DCMAKE_DISABLE_FIND_PACKAGE_$package=ON"); done
mkdir "$work/bin"
cat >"$work/bin/pkg-config" <<EOF
#!/bin/bash
for word; do case \$word in *gtk4* | *epoxy* | *gtest* | *embree*) echo "\$word" >>"$work/asked"; exit 1 ;; esac; done
exec $(command -v pkg-config) "\$@"
EOF
chmod +x "$work/bin/pkg-config"
PATH=$work/bin:$PATH cmake --preset "$preset" -B "$work/build" "${absent[@]}" >"$work/log" 2>&1 ||
  { tail -n 20 "$work/log"; fail "preset $preset cannot be configured without the tests' packages"; }
[ ! -e "$work/asked" ] || fail "preset $preset asks for $(sort -u "$work/asked" | tr '\n' ' ')"

ninja -C "$work/build" -t commands all >"$work/steps"
if grep -E 'tests/|demo/embed/|-c .*_test\.cpp' "$work/steps"; then
  fail "demo/run.sh builds more than it runs"
fi
while read -r program; do
  grep -q -- "-o bin/$program " "$work/steps" || fail "demo/run.sh runs $program and does not build it"
done < <(grep -oE 'bin/cumulet-[a-z]+' demo/run.sh | cut -d/ -f2 | sort -u)
echo "preset $preset: $(wc -l <"$work/steps") steps"
