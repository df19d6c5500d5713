// Better defaults of Fast DDS for large messages and new processes.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace connect_bridge::ros {

// Fast DDS loses samples in the graph while a large one is on its way, because shared memory or a
// socket is full. A reader learns of the loss from the writer's next heartbeat, which comes every 3
// s: commands were up to 2.5 s late beside a sample of 64 MiB. This profile lets all publishers and
// services of the process send a heartbeat every 100 ms while a sample is not acknowledged.
//
// A process sometimes discovers an older one only by its next announcement, which comes every 3 s.
// Measured: of 211 pairs that started within 0.8 s, 22 discovered each other after 3 s, all others
// within 0.9 s. This profile lets the process announce itself every 500 ms. Bridges of one graph
// rely on that (core/graph/claiming.hpp).
//
// A participant sends through its own segment of shared memory, 512 KiB by default. Data that does
// not fit is lost, often all of a large message: best-effort messages above 1 MB never arrive,
// reliable ones are repaired in rounds of 10 ms. So a process that publishes images gets a larger
// segment, which takes all its memory from the start. There is no segment if the user has chosen
// the transports (FASTDDS_BUILTIN_TRANSPORTS, often to avoid shared memory) or /dev/shm has no
// room: a killed process leaves its segment there.
//
// The environment is the only way to set a profile through rmw. While this object lives, the
// variable for the file of default profiles names a file of ours, which is deleted at the end. Fast
// DDS reads it when the process makes its first node. Nothing happens with another middleware, or
// if the user has given profiles by the variable or in the working directory. The file is in the
// folder for temporary files, or else in /dev/shm. Thread: not beside others that read or change
// the environment.
class FastDdsProfile {
 public:
  static constexpr std::size_t kLargeSegment = 8 << 20;  // an uncompressed image of 1080 lines

  // `is_loaded`: the process has loaded its middleware; without it nothing happens.
  // `segment_bytes`: size of the shared memory, below 4 GiB; 0: the default.
  FastDdsProfile(bool is_loaded, std::size_t segment_bytes);
  FastDdsProfile(const FastDdsProfile&) = delete;
  FastDdsProfile& operator=(const FastDdsProfile&) = delete;
  ~FastDdsProfile();

  // Warnings for the log: no file can be written, or nodes of another user share memory.
  [[nodiscard]] const std::vector<std::string>& problems() const { return problems_; }

 private:
  const char* variable_ = nullptr;
  std::string path_;  // empty: no file was made
  std::vector<std::string> problems_;
};

// Asks a discovery server (ROS_DISCOVERY_SERVER) for all endpoints, as a "super client", unless the
// user has chosen (ROS_SUPER_CLIENT). Otherwise a process discovers only endpoints that match its
// own, and a bridge, which has none yet, would find nothing to bridge. Only for Fast DDS; call it
// before the process makes its first node. Thread: not beside others that read or change the
// environment.
void ask_for_whole_graph(bool is_loaded);

}  // namespace connect_bridge::ros
