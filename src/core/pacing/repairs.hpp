// TCP's report on the losses that it repairs, and on its segments.
#pragma once

#include <cstdint>

namespace connect_bridge {

// Data behind a lost segment has crossed the path, but waits in a kernel until the segment has been
// sent again: our data at the peer, its acknowledgements here. Meanwhile only TCP knows how much is
// still under way.
struct Repairs {
  bool open = false;                  // a segment is missing, in this direction or in the other
  std::uint64_t under_way_bytes = 0;  // handed to the kernel and not known to have arrived
  std::uint64_t repeated = 0;         // segments that were sent again, since the beginning
  std::uint32_t segment_bytes = 0;    // of data in a full segment; 0: not known
};

}  // namespace connect_bridge
