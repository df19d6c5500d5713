#!/usr/bin/env bash
# rivals.sh [folder]: a Python environment with the programs that tools/bench/wan compares pictures with: aiortc (WebRTC), into .ros2/rivals.
# Nothing else needs it; a failure is no error: the bench says what it lacks.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
. "$root/tools/setup/common.sh"
folder=$(realpath -m "${1:-$root/.ros2/rivals}")
stamp=$folder/stamp
packages=(aiortc==1.16.0)

stamp_is_fresh "$stamp" "${packages[*]}" && exit 0
rm -rf "$folder"
mkdir -p "$folder"
if ! python3 -m venv "$folder" || ! telling "[setup] rivals of the bench" "$folder/log" "$folder/bin/pip" install -q "${packages[@]}"; then
  say "the rivals could not be fetched; the bench leaves them out"
  exit 0
fi
stamp_write "$stamp" "${packages[*]}"
