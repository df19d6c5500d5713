#!/usr/bin/env bash
# asan_reports.sh <folder>: shows the sanitizers' reports in it, and fails if one of them is not known to be of the middleware
# alone, which is not built with a sanitizer. Known is:
# - Fast DDS crashes while it ends after a neighbour was killed: release() locks a port of shared memory which the listening
#   thread replaces at that moment (SharedMemManager.hpp: close() and regenerate_port() share `global_port_` without a lock).
set -euo pipefail
known='eprosima::fastdds::rtps::SharedMemChannelResource::release()'

# The crash itself must be there, not only some stack of the report.
is_known() { grep -q 'ERROR: AddressSanitizer: SEGV' "$1" && sed -n '/ #0 /,/ #4 /p;/ #4 /q' "$1" | grep -qF "$known"; }

code=0
for report in "$1"/*; do
  [ -e "$report" ] || continue
  if is_known "$report"; then
    printf 'KNOWN, of the middleware alone: %s\n' "$known"
  else
    code=1
  fi
  head -n 60 "$report"
done
exit "$code"
