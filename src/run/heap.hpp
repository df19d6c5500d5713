// The memory of buffers: kept while messages move, given back to the host when none do.
#pragma once

#include <cstdint>

namespace connect_bridge {

// Sets the limits of the heap. Call it once, before there are threads.
void tune_heap();

class HeapTrim {
 public:
  // Call it once a second, with a count that grows with every use of memory.
  void every_second(std::uint64_t moved);

 private:
  std::uint64_t moved_ = 0;
  unsigned quiet_seconds_ = 0;
};

}  // namespace connect_bridge
