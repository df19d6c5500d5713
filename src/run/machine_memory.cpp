#include "run/machine_memory.hpp"

#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace connect_bridge {
namespace {

// The number in the file; "max", or no file: no limit.
std::uint64_t limit_in(const std::string& file) {
  std::ifstream in(file);
  std::uint64_t limit = 0;
  return in >> limit && limit > 0 ? limit : UINT64_MAX;
}

// Groups limit what is below them. In a container the path may be that of the host, where only the
// root of the groups is seen.
std::uint64_t limit_of(const std::string& groups, std::string path, const std::string& file) {
  std::uint64_t least = limit_in(groups + "/" + file);
  for (; path.size() > 1; path.erase(path.rfind('/')))
    least = std::min(least, limit_in(groups + path + "/" + file));
  return least;
}

}  // namespace

std::uint64_t memory_limit(std::uint64_t machine_bytes, const std::string& root) {
  std::uint64_t least = machine_bytes;
  std::ifstream in(root + "/proc/self/cgroup");
  for (std::string line; std::getline(in, line);) {
    const std::size_t controllers = line.find(':') + 1, path = line.find(':', controllers);
    if (controllers == 0 || path == std::string::npos || line.substr(path + 1, 1) != "/") continue;
    const std::string of = line.substr(controllers, path - controllers);
    if (of.empty())
      least =
          std::min(least, limit_of(root + "/sys/fs/cgroup", line.substr(path + 1), "memory.max"));
    else if (of == "memory")
      least = std::min(least, limit_of(root + "/sys/fs/cgroup/memory", line.substr(path + 1),
                                       "memory.limit_in_bytes"));
  }
  return least;
}

std::uint64_t machine_memory() {
  const long pages = ::sysconf(_SC_PHYS_PAGES), size = ::sysconf(_SC_PAGE_SIZE);
  if (pages <= 0 || size <= 0) return 0;
  return memory_limit(static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(size));
}

}  // namespace connect_bridge
