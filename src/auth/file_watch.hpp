// Whether a file is another one than before.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <tuple>

namespace connect_bridge {

// Looks at the file's stamps, not at its content, and follows links: mounted secrets are replaced
// by a link's new target. Blocks as long as the file system does.
class FileWatch {
 public:
  // What the file is now counts as known: to be made before it is read.
  explicit FileWatch(std::string file);

  // It has changed, or gone or come, since it was last known, and has not changed any more since
  // the last look: who writes it is done. True once for each change.
  [[nodiscard]] bool settled_change();
  [[nodiscard]] const std::string& file() const { return file_; }

 private:
  // Device, inode, size, times of content and of attributes in nanoseconds; zeros: no such file.
  using Stamps = std::tuple<std::uint64_t, std::uint64_t, std::int64_t, std::int64_t, std::int64_t>;
  [[nodiscard]] Stamps look() const;

  std::string file_;
  Stamps known_;
  std::optional<Stamps> changing_;
};

}  // namespace connect_bridge
