#!/usr/bin/env bash
# arm64.sh <folder> <seeds>: the core's unit tests and the simulator, compiled for arm64 by the cross compiler and run under
# qemu, and the relay's --version. None needs ROS. The libraries are those of Debian's arm64 packages, unpacked into the folder and
# not installed. On Debian 12 only: the names of the packages are of that.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
. "$root/tools/setup/common.sh"
(. /etc/os-release && [ "$ID $VERSION_ID" = "debian 12" ]) || die "this works on Debian 12 only: it takes the arm64 packages of that"
for tool in aarch64-linux-gnu-g++ qemu-aarch64-static; do
  command -v "$tool" >/dev/null || die "there is no $tool: apt-get install g++-aarch64-linux-gnu qemu-user-static"
done
mkdir -p "$1"
folder=$(cd "$1" && pwd)
seeds=$2
sysroot=$folder/sysroot
libraries=(libboost1.74-dev nlohmann-json3-dev libcli11-dev googletest libssl-dev libssl3 libfmt-dev libfmt9 liblz4-dev liblz4-1 libzstd-dev libzstd1 libvpx-dev libvpx7 libturbojpeg0-dev libturbojpeg0 libyaml-cpp-dev libyaml-cpp0.7
  libgtest-dev libgmock-dev libc6 libstdc++6 libgcc-s1)

if ! stamp_is_fresh "$sysroot/stamp" "${libraries[*]}"; then
  rm -rf "$sysroot" "$folder/archives"
  mkdir -p "$folder/lists/partial" "$folder/archives/partial" "$sysroot"
  # Lists of their own: the system does not get another architecture.
  apt=(apt-get -q -o APT::Architecture=arm64 -o APT::Architectures=arm64 -o Dir::State::lists="$folder/lists"
    -o Dir::Cache::pkgcache= -o Dir::Cache::srcpkgcache= -o Dir::Cache::archives="$folder/archives" -o APT::Sandbox::User=root)
  telling "[arm64] lists of packages" "$folder/log" "${apt[@]}" update || die "no lists of arm64 packages"
  cd "$folder/archives"
  telling "[arm64] libraries" "$folder/log" "${apt[@]}" download "${libraries[@]}" || { tail -n 20 "$folder/log" >&2; die "no arm64 packages"; }
  for package in *.deb; do dpkg-deb --extract "$package" "$sysroot"; done
  cd "$root"
  # Links to /lib/... are of the folder.
  find "$sysroot" -type l -lname '/*' | while read -r link; do ln -sfn "$sysroot$(readlink "$link")" "$link"; done
  stamp_write "$sysroot/stamp" "${libraries[*]}"
fi

cat >"$folder/toolchain.cmake" <<CMAKE
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_FIND_ROOT_PATH "$sysroot")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
add_compile_options("SHELL:-isystem $sysroot/usr/include" "SHELL:-isystem $sysroot/usr/include/aarch64-linux-gnu")
add_link_options("-Wl,-rpath-link,$sysroot/usr/lib/aarch64-linux-gnu:$sysroot/lib/aarch64-linux-gnu")
set(OPENSSL_INCLUDE_DIR "$sysroot/usr/include")
set(OPENSSL_SSL_LIBRARY "$sysroot/usr/lib/aarch64-linux-gnu/libssl.so")
set(OPENSSL_CRYPTO_LIBRARY "$sysroot/usr/lib/aarch64-linux-gnu/libcrypto.so")
CMAKE
TARGETS="flow_tests core_tests sim relay" "$root/tools/setup/build.sh" "$folder/build" -DCMAKE_TOOLCHAIN_FILE="$folder/toolchain.cmake" \
  -DCONNECT_ROS=OFF -DCONNECT_WERROR=OFF
run=(qemu-aarch64-static -L /usr/aarch64-linux-gnu -E LD_LIBRARY_PATH="$sysroot/usr/lib/aarch64-linux-gnu")
"${run[@]}" "$folder/build/flow_tests" --gtest_brief=1
"${run[@]}" "$folder/build/core_tests" --gtest_brief=1
"${run[@]}" "$folder/build/sim" --seeds "$seeds"
"${run[@]}" "$folder/build/relay" --version
