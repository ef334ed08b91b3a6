#!/bin/bash
# Run by hand, as root and with a network: apt installs the Debian packages in a new Debian 12, the programs run there,
# and apt removes them completely. Then pip installs the wheel there, which renders too. (The tests run deb_test.sh and
# wheel_test.sh, which need neither root nor network.) Usage: deb_fresh.sh BUILD_DIR
# shellcheck source=tests/package/root.sh
. "$(dirname "$0")/root.sh"
[ "$(id -u)" = 0 ] || fail "it needs to be root"
command -v mmdebstrap >/dev/null || fail "it needs mmdebstrap (Debian)"

pack "$1" DEB
cmake --build "$1" --target cumulet_wheel >"$work/log" 2>&1 || { cat "$work/log"; fail "the wheel was not built"; }
root=$work/root
mmdebstrap --quiet --variant=apt bookworm "$root"
cp "$work"/pack/*.deb "$1"/cumulet-*-py3-none-linux_*.whl "$root/tmp"
cp /etc/resolv.conf "$root/etc"
cp "$(dirname "$0")/consumer/main.c" "$root/tmp"
echo "a new Debian after $SECONDS s"

cat >"$root/tmp/steps" <<'EOF'
set -eu
export DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 HOME=/tmp
quietly() { "$@" >/tmp/log 2>&1 || { cat /tmp/log; exit 1; }; }
quietly apt-get update
quietly apt-get install --yes /tmp/libcumulet0_*.deb /tmp/cumulet_*.deb
cumulet-scene --only cumulus --voxels 20000 /tmp/scene
cumulet-render --volume /tmp/scene/cumulus.vdb --size 64x64 --spp 4 -o /tmp/picture.png
cumulet-demo --version
quietly apt-get install --yes /tmp/python3-cumulet_*.deb
python3 -c 'import cumulet; cumulet.render("/tmp/scene/cumulus.vdb", size=(64, 48), samples=4).save("/tmp/python.png")'
quietly apt-get install --yes --no-install-recommends /tmp/libcumulet-dev_*.deb gcc libc6-dev pkg-config
cc -std=c11 /tmp/main.c -o /tmp/host $(pkg-config --cflags --libs cumulet)
/tmp/host
quietly apt-get purge --yes cumulet python3-cumulet libcumulet-dev libcumulet0
if find /usr /etc -name '*cumulet*' | grep .; then exit 1; fi
# The wheel finds none of the libraries that the packages needed.
quietly apt-get autoremove --purge --yes
if find /usr -name 'libopenvdb*' -o -name 'libtbb*' | grep .; then exit 1; fi
quietly apt-get install --yes --no-install-recommends python3-venv libegl1 libgl1-mesa-dri
python3 -m venv /tmp/venv
quietly /tmp/venv/bin/pip install --no-index /tmp/cumulet-*.whl
/tmp/venv/bin/python -c 'import cumulet; cumulet.render("/tmp/scene/cumulus.vdb", size=(64, 48), samples=4).save("/tmp/wheel.png")'
EOF
env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin "${enter[@]}" "$root" /bin/bash /tmp/steps || fail "not in a new Debian"
[ -s "$root/tmp/picture.png" ] || fail "cumulet-render wrote no picture"
[ -s "$root/tmp/python.png" ] || fail "Python wrote no picture"
[ -s "$root/tmp/wheel.png" ] || fail "Python wrote no picture by the wheel"
echo "installed, ran, built against, and removed after $SECONDS s"
