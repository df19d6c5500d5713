// A .tar.gz file in memory.
#pragma once

#include <ctime>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace connect_bridge {

struct PackedFile {
  std::string name;  // "status/connect_server.json", at most 99 bytes
  std::string text;
};

// The files, of mode 0600 and of no user, as one archive (POSIX ustar in RFC 1952).
[[nodiscard]] std::string tar_gz(const std::vector<PackedFile>& files, std::time_t time);

}  // namespace connect_bridge
