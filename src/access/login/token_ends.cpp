#include "access/login/token_ends.hpp"

#include <algorithm>

namespace connect_bridge {

std::optional<std::string> TokenEnds::take_line(const TokenTable& table, const std::string& source,
                                                Stamp now) {
  // A clock that was set back must not silence the warning.
  if (logged_at_ && now >= *logged_at_ && now - *logged_at_ < kPeriod) return std::nullopt;
  const auto ending = table.ending(now, now + kSoon, once_);
  if (ending.empty()) return std::nullopt;
  logged_at_ = now;
  const std::size_t named = std::min(ending.size(), kNamedMax);
  std::string line = source + ": tokens end within 14 days: ";
  for (std::size_t i = 0; i < named; ++i)
    line += (i == 0 ? "'" : ", '") + ending[i].identity + "' (" + date_text(ending[i].end) + ")";
  if (named < ending.size()) line += " and " + std::to_string(ending.size() - named) + " more";
  return line + ": make new ones (ctl token)";
}

}  // namespace connect_bridge
