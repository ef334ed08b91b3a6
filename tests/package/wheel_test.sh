#!/bin/bash
# The wheel renders on a system without our libraries: in a root folder that contains only the C library, Python and
# Mesa. Then pip installs it, if it is there. Usage: wheel_test.sh BUILD_DIR PYTHON
# shellcheck source=tests/package/root.sh
. "$(dirname "$0")/root.sh"
python=$(realpath "$2")

cmake --build "$1" --target cumulet_wheel >"$work/log" 2>&1 || { cat "$work/log"; fail "the wheel was not built"; }
wheels=("$1"/cumulet-*-py3-none-linux_*.whl)
if [ "${#wheels[@]}" -ne 1 ] || [ ! -s "${wheels[0]}" ]; then fail "there are ${#wheels[@]} wheels"; fi
echo "$(basename "${wheels[0]}"): $(($(stat -c %s "${wheels[0]}") / 1048576)) MiB"

root=$work/root
bare_root "$root"
add_mesa "$root"
# Python's modules need other libraries, but none of ours.
read -r stdlib modules <<<"$("$python" -c 'import sysconfig; p = sysconfig.get_path("stdlib"); print(p, p + "/lib-dynload")')"
mkdir -p "$root$(dirname "$stdlib")"
cp -r "$stdlib" "$root$(dirname "$stdlib")"
find "$modules" -name '*.so' >"$work/modules"
mapfile -t compiled <"$work/modules"
copy_closure "$root" "$python" "${compiled[@]}"
refuse_own_libraries "$root" wheel

"$1/bin/cumulet-scene" --only cumulus --voxels 20000 "$work/scene" >/dev/null
cp "$work/scene/cumulus.vdb" "$root/tmp"
"$python" -m zipfile -e "${wheels[0]}" "$root/opt/site"
cat >"$root/tmp/render.py" <<'CODE'
import array, sys
sys.path.insert(0, "/opt/site")
import cumulet
values = memoryview(array.array("f", [1.0] * 512)).cast("B").cast("f", (8, 8, 8))
picture = cumulet.render(values, size=(32, 24), samples=2, backend=sys.argv[1])
picture.save(f"/tmp/{sys.argv[1]}.png")
cumulet.render("/tmp/cumulus.vdb", size=(32, 24), samples=2, backend=sys.argv[1]).save("/tmp/cloud.png")
print(cumulet.__version__, picture)
CODE
for backend in "${backends[@]}"; do
  in_root "$root" "$python" -B /tmp/render.py "$backend" || fail "import cumulet did not render by $backend"
  [ -s "$root/tmp/$backend.png" ] || fail "there is no picture by $backend"
done

if "$python" -m pip --version >/dev/null 2>&1 && "$python" -m venv "$work/venv" 2>/dev/null; then
  "$work/venv/bin/python" -m pip install -q --no-index --no-deps "${wheels[0]}" || fail "pip did not install the wheel"
  found=$(cd "$work" && "$work/venv/bin/python" -c "import cumulet; print(cumulet.__file__)")
  [[ $found == "$work/venv/"* ]] || fail "Python does not find the installed wheel, but '$found'"
fi
echo "rendered without our libraries by: ${backends[*]:-none: no Mesa here}"
