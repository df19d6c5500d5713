// What Fast DDS does by default with large messages and new processes, made better.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace connect_bridge::ros {

// Fast DDS loses samples in the graph while a large one is on its way: shared memory, or a socket,
// is full. A reader learns of the loss by the writer's next heartbeat, which comes every 3 s:
// commands were up to 2.5 s late beside a sample of 64 MiB. This profile gives all publishers and
// services of the process a heartbeat every 100 ms while somebody has not acknowledged a sample.
//
// A process at times knows one that was there before only when that announces itself again, which
// it does every 3 s: of 211 pairs that started within 0.8 s, 22 knew each other after 3 s, all
// others within 0.9 s. This process announces itself every 500 ms. Bridges of one graph rely on
// that (core/graph/claiming.hpp).
//
// A participant sends through a segment of shared memory of its own, 512 KiB by default. What does
// not fit is lost, often all of a large message: best-effort ones above 1 MB never arrive, reliable
// ones are repaired in rounds of 10 ms. So a process that publishes images gets a larger segment,
// all of which takes memory from the start. There is none where the user has chosen the transports
// (FASTDDS_BUILTIN_TRANSPORTS: often to do without shared memory) or /dev/shm has no room: a
// process that is killed leaves its segment there.
//
// The only way to it through rmw is the environment: while this object lives, the variable for the
// file of default profiles names a file of ours, which is deleted in the end. Fast DDS reads it
// when the process makes its first node. Where there is another middleware, where the user has
// given profiles, by the variable or in the working directory, nothing happens. The file is in the
// folder for temporary files, else in /dev/shm. Thread: not beside others that read or change the
// environment.
class FastDdsProfile {
 public:
  static constexpr std::size_t kLargeSegment = 8 << 20;  // an uncompressed image of 1080 lines

  // `is_loaded`: whether the process has loaded its middleware; before, nothing happens.
  // `segment_bytes`: of shared memory, below 4 GiB; 0: the default.
  FastDdsProfile(bool is_loaded, std::size_t segment_bytes);
  FastDdsProfile(const FastDdsProfile&) = delete;
  FastDdsProfile& operator=(const FastDdsProfile&) = delete;
  ~FastDdsProfile();

  // Warnings for the log: no file can be written; nodes of another user share memory.
  [[nodiscard]] const std::vector<std::string>& problems() const { return problems_; }

 private:
  const char* variable_ = nullptr;
  std::string path_;  // empty: none
  std::vector<std::string> problems_;
};

// With a discovery server (ROS_DISCOVERY_SERVER) a process discovers only the endpoints that match
// its own: a bridge, which has none yet, would find nothing to bridge. So it asks for all of them,
// as a "super client", unless the user has chosen (ROS_SUPER_CLIENT). For Fast DDS; before
// the process makes its first node. Thread: not beside others that read or change the environment.
void ask_for_whole_graph(bool is_loaded);

}  // namespace connect_bridge::ros
