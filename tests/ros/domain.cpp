#include "ros/domain.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <filesystem>
#include <stdexcept>
#include <string>

namespace connect_bridge::ros {
namespace {

// Above 101 their ports may be those that the system gives out.
constexpr int kFirst = 40;
constexpr int kDomains = 62;

}  // namespace

Domain::Domain() {
  const auto folder = std::filesystem::temp_directory_path() /
                      ("connect-bridge-domains-" + std::to_string(getuid()));
  std::filesystem::create_directories(folder);
  // Each test begins elsewhere: where a test has just ended, others may still believe in its nodes.
  static int first = getpid();
  ++first;
  for (int i = 0; i < kDomains; ++i) {
    id_ = kFirst + (first + i) % kDomains;
    lock_ = open((folder / std::to_string(id_)).c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    if (lock_ < 0) continue;
    if (flock(lock_, LOCK_EX | LOCK_NB) == 0) return;
    close(lock_);
  }
  throw std::runtime_error("no free ROS domain");
}

Domain::~Domain() {
  close(lock_);
}

}  // namespace connect_bridge::ros
