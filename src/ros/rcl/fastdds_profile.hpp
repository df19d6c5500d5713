// A shorter time to repair what Fast DDS loses in the graph.
#pragma once

#include <string>

namespace connect_bridge::ros {

// Fast DDS loses samples in the graph while a large one is on its way: shared memory, or a socket,
// is full. A reader learns of the loss by the writer's next heartbeat, which comes every 3 s:
// commands were up to 2.5 s late beside a sample of 64 MiB. This profile gives all publishers and
// services of the process a heartbeat every 100 ms while somebody has not acknowledged a sample.
//
// The only way to it through rmw is the environment: while this object lives, the variable for the
// file of default profiles names a file of ours, which is deleted in the end. Fast DDS reads it
// when the process makes its first node. Where there is another middleware, where the user has
// given profiles, by the variable or in the working directory, or where no file can be written,
// nothing happens. Thread: not beside others that read or change the environment.
class FastDdsProfile {
 public:
  // Whether the process has loaded its middleware; before, nothing happens.
  explicit FastDdsProfile(bool is_loaded);
  FastDdsProfile(const FastDdsProfile&) = delete;
  FastDdsProfile& operator=(const FastDdsProfile&) = delete;
  ~FastDdsProfile();

 private:
  const char* variable_ = nullptr;
  std::string path_;  // empty: none
};

}  // namespace connect_bridge::ros
