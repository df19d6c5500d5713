#include "run/heap.hpp"

#include <malloc.h>

namespace connect_bridge {
namespace {

// Buffers of large messages are allocated and freed many times a second. By default each is mapped
// and unmapped, and the kernel zeroes each page again. So they stay in the heap, which shrinks when
// much of its end is free, and when no message has moved for some seconds.
constexpr int kMappedFrom = 8 << 20;
constexpr int kFreeAtEndMax = 16 << 20;
constexpr int kArenasMax = 2;
constexpr unsigned kQuietSeconds = 5;

}  // namespace

void tune_heap() {
  mallopt(M_MMAP_THRESHOLD, kMappedFrom);
  mallopt(M_TRIM_THRESHOLD, kFreeAtEndMax);
  // The middleware's threads allocate little; a heap for each of them would only grow.
  mallopt(M_ARENA_MAX, kArenasMax);
}

void HeapTrim::every_second(std::uint64_t moved) {
  quiet_seconds_ = moved == moved_ ? quiet_seconds_ + 1 : 0;
  moved_ = moved;
  if (quiet_seconds_ == kQuietSeconds && moved > 0) malloc_trim(0);
}

}  // namespace connect_bridge
