// The owners of Fast DDS's files in shared memory.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace connect_bridge::ros {

struct SharedFile {
  std::string name;
  uid_t owner = 0;
};

// Files in /dev/shm that only their owner may write; empty: the folder cannot be read. Any thread.
[[nodiscard]] std::vector<SharedFile> shared_files();

// A warning if `files` contains a port of Fast DDS in the ROS domain (0 to 232) whose owner is not
// `own`; empty: none. Fast DDS sends to a process on the same machine by writing into that
// process's files, which only their owner may write. So between two users the endpoints match, and
// no message arrives. The port may be left from a killed process.
[[nodiscard]] std::string problem_of_users(const std::vector<SharedFile>& files, uid_t own,
                                           unsigned int domain);

}  // namespace connect_bridge::ros
