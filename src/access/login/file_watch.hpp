// Detects that a file has changed.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

namespace connect_bridge {

// Compares the file's time stamps, not its content, and follows links: mounted secrets are replaced
// by a link to another target. Blocks as long as the file system does.
class FileWatch {
 public:
  // The file's present state counts as known: create this before the file is read.
  explicit FileWatch(std::string file);

  // Whether the file has changed, appeared or disappeared, and has not changed again since the last
  // call, so that its writer is done. True once for each change.
  [[nodiscard]] bool settled_change();
  // Takes the file's present state as known: the caller reads the file now, whatever
  // settled_change() has returned.
  void read_now();
  // Records that the file could not be used, which may pass (too many open files): settled_change()
  // reports the file again if it exists. Returns whether `why` is new for this state of the file.
  [[nodiscard]] bool failed(const std::string& why);
  // Whether the file is missing: settled_change() reports it when it appears, not before.
  [[nodiscard]] bool is_missing() const { return look() == Stamps{}; }
  [[nodiscard]] const std::string& file() const { return file_; }
  // When the content that is known was written, by the file; 0: it is missing. A copy may keep a
  // time of another machine's clock. This machine sets the time of the attributes, so the smaller
  // one counts.
  [[nodiscard]] std::int64_t written_at() const {
    return std::min(std::get<3>(known_), std::get<4>(known_));
  }

 private:
  // Device, inode, size, times of content and of attributes in nanoseconds; zeros: no such file.
  using Stamps = std::tuple<std::uint64_t, std::uint64_t, std::int64_t, std::int64_t, std::int64_t>;
  [[nodiscard]] Stamps look() const;

  std::string file_;
  Stamps known_;
  std::optional<Stamps> changing_;
  bool unusable_ = false;
  std::pair<Stamps, std::string> failure_;  // the last one, with the file's state
};

}  // namespace connect_bridge
