// Detects that a file has changed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

namespace connect_bridge {

// Looks at the file's time stamps, not at its content, and follows links: mounted secrets are
// replaced by changing a link's target. Blocks as long as the file system does.
class FileWatch {
 public:
  // The file's present state counts as known: create this before the file is read.
  explicit FileWatch(std::string file);

  // Whether the file has changed, appeared or disappeared, and has not changed again since the last
  // call, so that its writer is done. True once for each change.
  [[nodiscard]] bool settled_change();
  // The caller reads the file now, whatever settled_change() has said.
  void read_now();
  // The file could not be used, which may pass (too many open files): settled_change() reports it
  // again, if there is one. Whether `why` is news for the file as it is.
  [[nodiscard]] bool failed(const std::string& why);
  [[nodiscard]] const std::string& file() const { return file_; }

 private:
  // Device, inode, size, times of content and of attributes in nanoseconds; zeros: no such file.
  using Stamps = std::tuple<std::uint64_t, std::uint64_t, std::int64_t, std::int64_t, std::int64_t>;
  [[nodiscard]] Stamps look() const;

  std::string file_;
  Stamps known_;
  std::optional<Stamps> changing_;
  bool unusable_ = false;
  std::pair<Stamps, std::string> failure_;  // the last one, and of which file
};

}  // namespace connect_bridge
