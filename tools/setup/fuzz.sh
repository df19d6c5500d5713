#!/usr/bin/env bash
# fuzz.sh <build folder> <seconds>: runs every fuzz target for its share of the time, one on each processor (JOBS). A finding
# stays in <build folder>/findings.
set -euo pipefail
shopt -s nullglob
export build=$1 share
targets=("$build"/fuzz/fuzz_*)
[ "${#targets[@]}" -gt 0 ] || { echo "[fuzz] there are no targets" >&2; exit 1; }
share=$(($2 / ${#targets[@]}))
[ "$share" -gt 0 ] || share=1

fuzz() {
  local target=$1 name=${1##*/} seeds
  mkdir -p "$build/corpus/$name" "$build/findings"
  seeds=("$build/corpus/$name")
  [ -d "tests/fuzz/corpus/${name#fuzz_}" ] && seeds+=("tests/fuzz/corpus/${name#fuzz_}")
  if ! "$target" -max_total_time="$share" -rss_limit_mb=1024 -timeout=5 -print_final_stats=1 -verbosity=0 \
    -artifact_prefix="$build/findings/$name-" "${seeds[@]}" >"$build/$name.log" 2>&1; then
    # Frames of templates have lines of kilobytes.
    grep -v NEW_FUNC "$build/$name.log" | tail -n 80 | cut -c -200
    grep -hE '^(connect_bridge: bug at|SUMMARY:|Base64:)' "$build/$name.log" | cut -c -8000 || true
    echo "[fuzz] $name failed; replay: $target $build/findings/$name-*"
    return 1
  fi
  echo "[fuzz] $name: $(grep -oE 'number_of_executed_units: [0-9]+' "$build/$name.log" | grep -oE '[0-9]+') runs in $share s, nothing found"
}
export -f fuzz
printf '%s\0' "${targets[@]}" | xargs -0 -n 1 -P "${JOBS:-$(nproc)}" bash -c 'set -euo pipefail; fuzz "$1"' fuzz
