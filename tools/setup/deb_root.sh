#!/usr/bin/env bash
# deb_root.sh <folder with the packages>: installs them in a clean Debian root of the host's release and starts what they
# install as their units do (tests/package/installed.sh), with the ROS 2 prefix mounted read-only. As root; two minutes.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
. "$root/tools/setup/common.sh"
folder=$(cd "$1" && pwd)
inside=$folder/root
[ "$(id -u)" = 0 ] || die "a root of its own needs root"
command -v mmdebstrap >/dev/null || die "there is no mmdebstrap: apt-get install mmdebstrap"
ls "$folder"/connect-bridge_*.deb >/dev/null || die "there is no package in $folder: make deb"

if [ ! -f "$folder/root.tar" ]; then
  release=$(. /etc/os-release && echo "$VERSION_CODENAME")
  # The system's sources of packages.
  telling "[deb] a clean root" "$folder/log-root" mmdebstrap --variant=apt --include=systemd,python3,bash-completion,ca-certificates \
    "$release" "$folder/root-new.tar" || { tail -n 20 "$folder/log-root" >&2; die "mmdebstrap failed"; }
  mv "$folder/root-new.tar" "$folder/root.tar"
fi
[ ! -d "$inside" ] || rm -rf --one-file-system "$inside"
mkdir "$inside"
tar -x -C "$inside" --exclude='./dev/*' -f "$folder/root.tar"
cp "$folder"/connect-bridge_*.deb "$folder"/connect-bridge-relay_*.deb "$inside/tmp/"
cp --remove-destination /etc/resolv.conf "$inside/etc/resolv.conf"
printf 'CONNECT_BRIDGE_ROOT=%s\nCONNECT_BRIDGE_PREFIX=%s\n. %s/env.sh\n' "$root" "${CONNECT_BRIDGE_PREFIX:-kilted}" "$root" >"$inside/opt/ros.sh"

in_root() {
  local at
  for at in "$root" "$(realpath "$root/.ros2")"; do
    mkdir -p "$inside$at"
    mount --rbind "$at" "$inside$at"
    mount -o remount,bind,ro "$inside$at"
  done
  mount -t tmpfs -o mode=755 none "$inside/dev"
  for at in null zero full random urandom tty; do
    touch "$inside/dev/$at"
    mount --bind "/dev/$at" "$inside/dev/$at"
  done
  mkdir "$inside/dev/shm"
  mount -t tmpfs none "$inside/dev/shm"
  mount -t proc none "$inside/proc"
  exec chroot "$inside" env -i PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 \
    DEBIAN_FRONTEND=noninteractive CONNECT_REPOSITORY="$root" bash "$root/tests/package/installed.sh"
}
export root inside
export -f in_root
# All that runs there ends with it.
unshare --mount --pid --fork --kill-child bash -euo pipefail -c in_root
