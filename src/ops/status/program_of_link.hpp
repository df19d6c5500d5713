// The program at the other end of a link, as far as the status tells it: for `ctl status` and `ctl
// doctor`.
#pragma once

#include <compare>
#include <string>

#include "core/base/json.hpp"
#include "core/ports/url.hpp"
#include "ops/status/json_members.hpp"

namespace connect_bridge {

struct ProgramOfLink {
  std::string identity, node, host;

  // "anna /connect_client"
  [[nodiscard]] std::string name() const { return identity.empty() ? node : identity + " " + node; }
  friend auto operator<=>(const ProgramOfLink&, const ProgramOfLink&) = default;
};

// A program that was started again has another port, and all else as before.
[[nodiscard]] inline ProgramOfLink program_of(const Json& link) {
  return {text_in(link, "identity"), text_in(link, "node"), host_of(text_in(link, "peer"))};
}

}  // namespace connect_bridge
