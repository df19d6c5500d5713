#!/usr/bin/env bash
# scanner.sh: fetches the TLS scanner of tests/e2e/test_tls_scan.py (sslyze, 60 MB) into .ros2/sslyze. A failure is no error:
# the test says what it lacks.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
. "$root/tools/setup/common.sh"
folder=$root/.ros2/sslyze
stamp=$folder/stamp
wanted=sslyze==6.3.1

[ "${CONNECT_SKIP_PACKAGES:-0}" = 1 ] && exit 0
stamp_is_fresh "$stamp" "$wanted" && exit 0
rm -rf "$folder"
if ! /usr/bin/python3 -m venv "$folder" || ! telling "[setup] TLS scanner for tests" "$folder/log" \
  "$folder/bin/pip" install --progress-bar off --disable-pip-version-check "$wanted"; then
  say "the TLS scanner could not be fetched; its test will be skipped"
  exit 0
fi
stamp_write "$stamp" "$wanted"
