#!/usr/bin/env bash
# packages.sh [programs|all|deb]: installs the system packages of the programs and the ROS prefix, or also those of the tests,
# of Debian packages, on Debian 12, Ubuntu 22.04 and 24.04. A stamp makes the second run a no-op. CONNECT_SKIP_PACKAGES=1 leaves the system alone.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
what=${1:-all}
stamp=$root/.ros2/stamp-packages-$what
. "$root/tools/setup/common.sh"

packages=(
  make cmake ninja-build ccache g++ patchelf                    # build
  libboost-dev libssl-dev nlohmann-json3-dev libfmt-dev         # the programs
  liblz4-dev libzstd-dev libyaml-cpp-dev libcli11-dev
  libvpx-dev libturbojpeg0-dev pkg-config
  python3-venv python3-dev                                      # the prefix and the type support of its messages
)
if ! ros_is_sourced; then
  packages+=(ament-cmake)                                       # a ROS distribution brings its own
fi
if [ "$what" = all ]; then
  packages+=(
    libgtest-dev libgmock-dev zsh fish                          # tests
    clang clang-format libclang-rt-14-dev                       # second compiler, sanitizers, libFuzzer, format
  )
fi

case $what in
  deb) packages+=(debhelper lintian mmdebstrap) ;;              # Debian packages, and a clean root to try them in
esac

# Ubuntu 24.04 has clang 18 only.
available() { apt-cache show "$1" >/dev/null 2>&1; }
other_name() {
  case $1 in
    libclang-rt-14-dev) echo "libclang-rt-18-dev libclang-rt-dev" ;;
  esac
}

[ "${CONNECT_SKIP_PACKAGES:-0}" = 1 ] && exit 0
stamp_is_fresh "$stamp" "${packages[*]}" && exit 0

missing() {
  for p in "${packages[@]}"; do
    dpkg-query -W -f '${db:Status-Abbrev}' "$p" 2>/dev/null | grep -q '^ii' || printf '%s\n' "$p"
  done
}

mapfile -t wanted < <(missing)
if [ "${#wanted[@]}" -gt 0 ]; then
  sudo=
  [ "$(id -u)" = 0 ] || sudo=sudo
  say "system packages to install: ${wanted[*]}"
  log=$root/.ros2/log-packages
  telling "[setup] the lists of packages" "$log" $sudo apt-get update -q || { tail -n 30 "$log" >&2; die "apt-get failed"; }
  chosen=()
  for p in "${wanted[@]}"; do
    if available "$p"; then chosen+=("$p"); continue; fi
    found=
    for q in $(other_name "$p"); do available "$q" && { found=$q; break; }; done
    [ -n "$found" ] || die "the package '$p' does not exist here; this works on Debian 12, Ubuntu 22.04 and 24.04"
    chosen+=("$found")
  done
  telling "[setup] packages" "$log" $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends \
    "${chosen[@]}" || { tail -n 30 "$log" >&2; die "apt-get failed"; }
fi
stamp_write "$stamp" "${packages[*]}"
