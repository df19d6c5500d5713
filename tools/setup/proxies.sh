#!/usr/bin/env bash
# proxies.sh [folder]: fetches the reverse proxies of tests/e2e/test_proxies.py, and the sshd of make bench-wan, from the system's packages into .ros2/proxies:
# 17 MB, 60 MB unpacked, a few seconds. They are not installed, since an installed one starts as a service. What is installed already, or has
# no package here (caddy on Ubuntu 22.04), is left out. A failure is no error: the tests say what they lack.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
. "$root/tools/setup/common.sh"
folder=$(realpath -m "${1:-$root/.ros2/proxies}")
stamp=$folder/stamp
packages=(nginx-light haproxy apache2-bin caddy openssh-server libwrap0)

[ "${CONNECT_SKIP_PACKAGES:-0}" = 1 ] && exit 0
stamp_is_fresh "$stamp" "${packages[*]}" && exit 0
rm -rf "$folder"
mkdir -p "$folder/partial"

chosen=()
for p in "${packages[@]}"; do
  if apt-cache show "$p" >/dev/null 2>&1; then chosen+=("$p"); fi
done
sudo=
[ "$(id -u)" = 0 ] || sudo=sudo
if [ "${#chosen[@]}" -eq 0 ] || ! telling "[setup] proxies for tests" "$folder/log" \
  $sudo apt-get install -y -q --no-install-recommends --download-only -o Dir::Cache::archives="$folder" "${chosen[@]}"; then
  say "the proxies for tests could not be fetched; their tests will be skipped"
  exit 0
fi
for package in "$folder"/*.deb; do
  [ -e "$package" ] && dpkg-deb --extract "$package" "$folder"
done
$sudo rm -rf "$folder"/*.deb "$folder/partial" "$folder/lock"
stamp_write "$stamp" "${packages[*]}"
