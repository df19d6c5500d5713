// Warns in time that tokens of the server end, on the machine where new ones are made.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "access/login/token_table.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {

// Somebody whose token ends is cut off at that moment, mostly far from anybody who could make
// another one.
// One thread.
class TokenEnds {
 public:
  static constexpr Stamp kSoon = 14 * 24 * 3600 * kStampSecond;
  static constexpr Stamp kPeriod = 24 * 3600 * kStampSecond;
  static constexpr std::size_t kNamedMax = 10;

  // Tokens of the group `once` end soon by their nature; empty: there are none.
  explicit TokenEnds(std::string once = {}) : once_(std::move(once)) {}

  // The line for the log, once a day while tokens of the table end soon: whose, and when. `source`
  // is what it begins with. To be called once a second.
  [[nodiscard]] std::optional<std::string> take_line(const TokenTable& table,
                                                     const std::string& source, Stamp now);
  // The table was read again: the next line does not wait for its day.
  void tell_again() { told_.reset(); }

 private:
  std::string once_;
  std::optional<Stamp> told_;  // when the last line was
};

}  // namespace connect_bridge
