// The status file (docs/config.md, `status_file`).
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "ops/status/status_json.hpp"

namespace connect_bridge {

// Replaces the file in one step; returns what went wrong, or nothing. It keeps its mode; a new one
// is its owner's alone. It does not wait for the disk: after a loss of power it may be empty.
std::string write_atomically(const std::string& file, const std::string& text);

// The text is made, and written, by a thread of its own: neither a long status nor a slow disk
// takes time of the loop.
class StatusFile {
 public:
  // `tell` is called, on the thread of the file, when a problem begins.
  explicit StatusFile(std::function<void(const std::string& problem)> tell);
  // The destructor ends the thread as end() does.
  ~StatusFile();
  StatusFile(const StatusFile&) = delete;
  StatusFile& operator=(const StatusFile&) = delete;

  // In place of what waits, if the one before is still being written. Thread: the loop's.
  void write(const std::string& file, std::shared_ptr<const StatusPicture> picture);
  // Why the file could not be written the last time; empty: it could. Thread: any.
  [[nodiscard]] std::string problem();
  // The picture that was given last is written first, and nothing afterwards. Returns its problem,
  // or nothing.
  [[nodiscard]] std::string end();

 private:
  using Waiting = std::pair<std::string, std::shared_ptr<const StatusPicture>>;
  void write_all();

  const std::function<void(const std::string&)> tell_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Waiting> waits_;
  bool ending_ = false;
  std::string last_problem_;  // changed by the thread alone, under the mutex
  std::thread thread_;        // last: it uses the others
};

}  // namespace connect_bridge
