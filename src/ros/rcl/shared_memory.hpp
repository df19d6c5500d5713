// Whose files Fast DDS has in shared memory.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace connect_bridge::ros {

struct SharedFile {
  std::string name;
  uid_t owner = 0;
};

// The files in /dev/shm that only their owner may write; empty: it cannot be read. Any thread.
[[nodiscard]] std::vector<SharedFile> shared_files();

// Fast DDS sends to a process on the same machine by writing into files of that process, and makes
// them writable for their owner alone: between two users the endpoints match, and no message
// arrives. The warning of that, if `files` has a port of Fast DDS in the ROS domain (0 to 232) that
// is not of `own`; empty: none. The port may be left of a process that was killed.
[[nodiscard]] std::string problem_of_users(const std::vector<SharedFile>& files, uid_t own,
                                           unsigned int domain);

}  // namespace connect_bridge::ros
