// Warns before tokens of the server expire, on the machine where new ones are made.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "access/login/token_table.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {

// A peer whose token expires is cut off at that moment, mostly far from anybody who could make
// another token. One thread.
class TokenEnds {
 public:
  static constexpr Stamp kSoon = 14 * 24 * 3600 * kStampSecond;
  static constexpr Stamp kPeriod = 24 * 3600 * kStampSecond;
  static constexpr std::size_t kNamedMax = 10;

  // Tokens of the group `once` expire soon by their nature; empty: there are none.
  explicit TokenEnds(std::string once = {}) : once_(std::move(once)) {}

  // The line for the log, once a day while tokens of the table expire soon: their identities and
  // dates. The line begins with `source`. Called once a second.
  [[nodiscard]] std::optional<std::string> take_line(const TokenTable& table,
                                                     const std::string& source, Stamp now);
  // The table was read again: the next line does not wait for its day.
  void tell_again() { logged_at_.reset(); }

 private:
  std::string once_;
  std::optional<Stamp> logged_at_;  // time of the last line
};

}  // namespace connect_bridge
