#include "ros/rcl/shared_memory.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

namespace connect_bridge::ros {

std::vector<SharedFile> shared_files() {
  std::vector<SharedFile> files;
  std::error_code error;
  const std::filesystem::directory_iterator end;
  for (std::filesystem::directory_iterator at("/dev/shm", error); !error && at != end;
       at.increment(error)) {
    struct stat facts {};
    const bool known = ::lstat(at->path().c_str(), &facts) == 0;  // else it is gone by now
    if (known && (facts.st_mode & S_IWOTH) == 0)
      files.push_back({at->path().filename().string(), facts.st_uid});
  }
  return files;
}

std::string problem_of_users(const std::vector<SharedFile>& files, uid_t own) {
  const auto other = std::find_if(files.begin(), files.end(), [own](const SharedFile& file) {
    const bool is_ours = file.owner == own;
    return !is_ours && (file.name.starts_with("fastdds_") || file.name.starts_with("fastrtps_"));
  });
  if (other == files.end()) return {};
  return "nodes of another user use Fast DDS's shared memory here (/dev/shm/" + other->name +
         " is of the user id " + std::to_string(other->owner) +
         "): their messages may not arrive; run this as their user, or with "
         "FASTDDS_BUILTIN_TRANSPORTS=UDPv4";
}

}  // namespace connect_bridge::ros
