// The memory of buffers: kept while messages move, given back to the host when none do.
#pragma once

#include <cstdint>

namespace connect_bridge {

// Once, before there are threads.
void tune_heap();

class HeapTrim {
 public:
  // Call once a second with a count that grows with whatever needs memory.
  void every_second(std::uint64_t moved);

 private:
  std::uint64_t moved_ = 0;
  unsigned quiet_seconds_ = 0;
};

}  // namespace connect_bridge
