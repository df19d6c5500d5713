#include "ros/rcl/shared_memory.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <string_view>
#include <system_error>

namespace connect_bridge::ros {

std::vector<SharedFile> shared_files() {
  std::vector<SharedFile> files;
  std::error_code error;
  const std::filesystem::directory_iterator end;
  for (std::filesystem::directory_iterator at("/dev/shm", error); !error && at != end;
       at.increment(error)) {
    struct stat facts {};
    const bool known = ::lstat(at->path().c_str(), &facts) == 0;  // false: it is gone by now
    if (known && (facts.st_mode & S_IWOTH) == 0)
      files.push_back({at->path().filename().string(), facts.st_uid});
  }
  return files;
}

std::string problem_of_users(const std::vector<SharedFile>& files, uid_t own, unsigned int domain) {
  // Each domain has 250 ports (DDSI-RTPS section 9.6.1.1).
  constexpr unsigned int kFirst = 7400, kPorts = 250;
  const auto is_of_domain = [&](std::string_view name) {
    const auto at = name.find("_port");
    if (!name.starts_with("fast") || at == std::string_view::npos) return false;
    unsigned int port = 0;
    name.remove_prefix(at + std::string_view("_port").size());
    std::from_chars(name.data(), name.data() + name.size(), port);
    return port >= kFirst && (port - kFirst) / kPorts == domain;
  };
  const auto other = std::find_if(files.begin(), files.end(), [&](const SharedFile& file) {
    return file.owner != own && is_of_domain(file.name);
  });
  if (other == files.end()) return {};
  return "Fast DDS's shared memory here has files of another user (/dev/shm/" + other->name +
         " is of the user id " + std::to_string(other->owner) +
         "): messages of nodes that run as that user may not arrive; run this as their user, or "
         "with FASTDDS_BUILTIN_TRANSPORTS=UDPv4 (it has no effect with "
         "ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST)";
}

}  // namespace connect_bridge::ros
