#!/usr/bin/env bash
# rmw_cyclonedds.sh <sources>: builds rmw_cyclonedds_cpp for the prefix in use. <sources> holds checkouts named cyclonedds
# (0.10.x), rmw_cyclonedds and rmw_implementation, of the versions of the distribution.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
sources=${1:-}
. "$root/tools/setup/rmw_sources.sh"
with_checkouts rmw-cyclonedds-cpp cyclonedds rmw_cyclonedds rmw_implementation

step cyclonedds cyclonedds -DENABLE_SHM=OFF -DENABLE_SSL=OFF -DENABLE_SECURITY=OFF -DBUILD_IDLC=OFF -DBUILD_DDSPERF=OFF
step rmw_cyclonedds rmw_cyclonedds_cpp
step_chooser rmw_cyclonedds_cpp
