// Names, groups and dates of identities, in the form that every login method must use.
#pragma once

#include <cstddef>
#include <string>

#include "core/base/time.hpp"
#include "core/wire/text.hpp"

namespace connect_bridge {

inline constexpr std::size_t kIdentityNameBytesMax = 255;
inline constexpr std::size_t kIdentityGroupsMax = 256;
inline constexpr double kExpirySecondsMax = 4e9;  // 2096: a later value is not a date

// The problem with a name of an identity or group; empty: none.
[[nodiscard]] inline std::string name_problem(const std::string& name) {
  if (name.empty()) return "is empty";
  if (name.size() > kIdentityNameBytesMax) return "has more than 255 bytes";
  return is_text(name) ? "" : "has a control character or is not UTF-8";
}

// The stamp of seconds since 1970, from 0 to kExpirySecondsMax, precise to a millisecond.
[[nodiscard]] inline Stamp stamp_of_seconds(double seconds) {
  return static_cast<Stamp>(seconds * 1000) * (kStampSecond / 1000);
}

}  // namespace connect_bridge
