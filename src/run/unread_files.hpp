// Refuses new logins while files that decide about them cannot be read.
#pragma once

#include <atomic>
#include <optional>

#include "core/ports/actions.hpp"

namespace connect_bridge {

// A withdrawal may stand in a file that cannot be read, because descriptors or memory are lacking.
// Nobody knows whose it is, so open links stay.
class UnreadFiles {
 public:
  static constexpr int kCountMax = 10;
  // The reason of a refusal.
  static constexpr char kReason[] =
      "a file that decides has changed and cannot be read, since this process lacks descriptors or "
      "memory";

  // Called once a second. Refusals begin after kCountMax calls in a row with `lacks_means`, and end
  // with the first one without. Returns the line for the log about that. One thread.
  [[nodiscard]] std::optional<Log> count(bool lacks_means);
  // Any thread.
  [[nodiscard]] bool refuses_new() const { return refuses_new_; }

 private:
  int in_a_row_ = 0;
  std::atomic<bool> refuses_new_ = false;
};

}  // namespace connect_bridge
