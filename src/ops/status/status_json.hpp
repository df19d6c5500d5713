// The status of a side as JSON, for the status file and for who asks (docs/status.md).
#pragma once

#include <chrono>
#include <string>

#include "core/base/json.hpp"
#include "core/ports/status.hpp"
#include "ops/status/status_fields.hpp"
#include "ops/status/status_picture.hpp"

namespace connect_bridge {

// The version of what to_json() writes. It changes when a member is removed or changes its meaning.
inline constexpr int kStatusSchema = 1;

[[nodiscard]] inline double milliseconds_of(Duration time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

// The members of the side, and of one link, without what is in lists of their own.
[[nodiscard]] OrderedJson facts_of(const StatusPicture& picture, Names names);
[[nodiscard]] OrderedJson facts_of(const LinkStatus& link, Names names);

// For people with line ends, else in one line.
std::string to_json(const StatusPicture& picture, Names names = Names::kShown,
                    bool in_lines = true);

}  // namespace connect_bridge
