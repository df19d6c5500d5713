#!/usr/bin/env bash
# build.sh <folder> <cmake option>...: configures and compiles. On a terminal with ninja's progress, elsewhere with a line
# now and then, and the result or the errors. JOBS limits the parallel steps, TARGETS names what to build instead of everything.
# TESTS= leaves the tests out of a new folder; one that has them keeps them.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
. "$root/tools/setup/common.sh"
build=$1
shift
mkdir -p "$build"
# To a compiler cache it is the same code, whatever folder it is in.
export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$root} CCACHE_NOHASHDIR=${CCACHE_NOHASHDIR:-1}
# In CI, where warnings are errors first, also whether they are: tests/mutants compiles the same without that.
[ -z "${CI:-}" ] || export CCACHE_IGNOREOPTIONS='-Werror -Wno-*'
if ! cmake -S . -B "$build" -G Ninja ${TESTS--DCONNECT_TESTS=ON} -DCONNECT_WERROR=ON "$@" >"$build/configure.log" 2>&1; then
  grep -v '^--' "$build/configure.log" | tail -n 40 >&2
  exit 1
fi
# One broken target must not hide what else is broken.
command=(cmake --build "$build" -j "${JOBS:-$(nproc)}" ${TARGETS:+--target $TARGETS} -- -k 0)
if [ -t 1 ]; then
  exec "${command[@]}"
fi
log=$build/build.log
if telling "[build] $build" "$log" "${command[@]}"; then
  { grep -E 'warning:' "$log" || true; } | cut -c1-300 | sed -n 1,20p
  printf '[build] %s: %s\n' "$build" "$(tail -n 1 "$log")"
else
  # Without ninja's steps and the command lines; a template's error has lines of many kilobytes.
  { grep -vE '^\[[0-9]+/[0-9]+\]|^(: && )?/usr/bin/(ccache|c\+\+|clang)' "$log" || true; } | cut -c1-400 | sed -n 1,120p
  printf '[build] %s failed, all of it is in %s\n' "$build" "$log" >&2
  exit 1
fi
