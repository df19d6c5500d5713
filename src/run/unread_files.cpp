#include "run/unread_files.hpp"

#include <algorithm>
#include <string>

namespace connect_bridge {

std::optional<Log> UnreadFiles::count(bool lacks_means) {
  in_a_row_ = lacks_means ? std::min(in_a_row_ + 1, kCountMax) : 0;
  const bool refuses = in_a_row_ == kCountMax;
  if (refuses_new_.exchange(refuses) == refuses) return std::nullopt;
  if (!refuses)
    return Log{LogLevel::kInfo, "the files that decide can be read: new logins are judged"};
  return Log{LogLevel::kError, std::string{kReason} +
                                   ": new logins are refused until it is read (end what has many "
                                   "connections or files open, or raise LimitNOFILE)"};
}

}  // namespace connect_bridge
