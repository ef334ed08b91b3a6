#!/bin/bash
# Run by hand, as root and with a network: apt installs the Debian packages in a new Debian 12, the programs run there,
# and apt removes them completely. (The tests run deb_test.sh, which needs neither root nor network.) Usage:
# deb_fresh.sh BUILD_DIR
# shellcheck source=tests/package/root.sh
. "$(dirname "$0")/root.sh"
[ "$(id -u)" = 0 ] || fail "it needs to be root"
command -v mmdebstrap >/dev/null || fail "it needs mmdebstrap (Debian)"

pack "$1" DEB
root=$work/root
mmdebstrap --quiet --variant=apt bookworm "$root"
cp "$work"/pack/*.deb "$root/tmp"
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
EOF
env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin "${enter[@]}" "$root" /bin/bash /tmp/steps || fail "not in a new Debian"
[ -s "$root/tmp/picture.png" ] || fail "cumulet-render wrote no picture"
[ -s "$root/tmp/python.png" ] || fail "Python wrote no picture"
echo "installed, ran, built against, and removed after $SECONDS s"
