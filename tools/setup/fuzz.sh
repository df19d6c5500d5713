#!/usr/bin/env bash
# fuzz.sh <build folder> <seconds>: runs every fuzz target for its share of the time. A finding stays in <build folder>/findings.
set -euo pipefail
shopt -s nullglob
build=$1
targets=("$build"/fuzz/fuzz_*)
[ "${#targets[@]}" -gt 0 ] || { echo "[fuzz] there are no targets" >&2; exit 1; }
share=$(($2 / ${#targets[@]}))
[ "$share" -gt 0 ] || share=1
for target in "${targets[@]}"; do
  name=${target##*/}
  mkdir -p "$build/corpus/$name" "$build/findings"
  seeds=("$build/corpus/$name")
  [ -d "tests/fuzz/corpus/${name#fuzz_}" ] && seeds+=("tests/fuzz/corpus/${name#fuzz_}")
  if ! "$target" -max_total_time="$share" -rss_limit_mb=1024 -timeout=10 -print_final_stats=1 -verbosity=0 \
    -artifact_prefix="$build/findings/$name-" "${seeds[@]}" >"$build/$name.log" 2>&1; then
    # Frames of templates have lines of kilobytes.
    grep -v NEW_FUNC "$build/$name.log" | tail -n 80 | cut -c -200
    grep -hE '^(connect_bridge: bug at|SUMMARY:|Base64:)' "$build/$name.log" | cut -c -8000 || true
    echo "[fuzz] $name failed; replay: $target $build/findings/$name-*"
    exit 1
  fi
  echo "[fuzz] $name: $(grep -oE 'number_of_executed_units: [0-9]+' "$build/$name.log" | grep -oE '[0-9]+') runs in $share s, nothing found"
done
