#!/usr/bin/env bash
# rmw_zenoh.sh <sources>: builds rmw_zenoh_cpp for the prefix in use. <sources> holds checkouts named zenoh-c and zenoh-cpp,
# of the commits that rmw_zenoh's zenoh_cpp_vendor names, and rmw_zenoh, ament_cmake_ros and rmw_implementation, of the
# versions of the distribution. Cargo compiles Zenoh; RUSTUP_TOOLCHAIN names another compiler than zenoh-c does.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
sources=${1:-}
. "$root/tools/setup/rmw_sources.sh"
with_checkouts rmw-zenoh-cpp zenoh-c zenoh-cpp rmw_zenoh ament_cmake_ros rmw_implementation

# Optimized over all of its packages, Zenoh takes several times as long to compile.
export CARGO_PROFILE_RELEASE_LTO=${CARGO_PROFILE_RELEASE_LTO:-off}
export CARGO_PROFILE_RELEASE_CODEGEN_UNITS=${CARGO_PROFILE_RELEASE_CODEGEN_UNITS:-16}
export CARGO_BUILD_JOBS=${JOBS:-$(nproc)}
step zenoh-c zenoh-c -DZENOHC_BUILD_WITH_UNSTABLE_API=TRUE -DZENOHC_BUILD_WITH_SHARED_MEMORY=TRUE "-DZENOHC_CARGO_FLAGS=${ZENOHC_CARGO_FLAGS:-}"
step zenoh-cpp zenoh-cpp -DZENOHCXX_ZENOHC=OFF -DZENOHCXX_ENABLE_TESTS=OFF -DZENOHCXX_ENABLE_EXAMPLES=OFF
# The package of this name would fetch and compile both once more.
mkdir -p "$target/share/zenoh_cpp_vendor/cmake"
printf 'find_package(%s REQUIRED)\n' zenohc zenohcxx >"$target/share/zenoh_cpp_vendor/cmake/zenoh_cpp_vendorConfig.cmake"
step ament_cmake_ros rmw_test_fixture
step rmw_zenoh rmw_zenoh_cpp
step_chooser rmw_zenoh_cpp
