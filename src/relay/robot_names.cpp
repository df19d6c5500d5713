#include "relay/robot_names.hpp"

#include <algorithm>

#include "access/login/secret.hpp"
#include "net/tcp/system_now.hpp"

namespace connect_bridge {
namespace {

bool is_line(const Identity& identity) {
  const auto& groups = identity.groups;
  return std::find(groups.begin(), groups.end(), kLineGroup) != groups.end();
}

Bytes bytes_of(std::string_view text) {
  return {text.begin(), text.end()};
}

}  // namespace

bool RobotNames::has(const std::string& robot, std::string_view token,
                     const std::string& peer) const {
  const Judgement judged = robots_->judge({"token", bytes_of(token), peer}, system_now());
  const bool may = judged.identity && !is_line(*judged.identity);  // mutant: line_as_login
  return may && judged.identity->name == robot;                    // mutant: name_of_another
}

std::optional<RobotNames::Taking> RobotNames::taking(const std::string& robot,
                                                     std::string_view token, std::string_view code,
                                                     const std::string& peer) const {
  if (code.empty() || !hand_over_ || !token_problem(token).empty()) return std::nullopt;
  const Judgement judged = robots_->judge({"token", bytes_of(code), peer}, system_now());
  if (!judged.identity || judged.identity->name != robot || !is_line(*judged.identity))
    return std::nullopt;
  return Taking{robot, sha256(view_of(token)), sha256(view_of(code))};
}

Refreshed RobotNames::refresh() {
  return robots_->refresh(system_now());
}

}  // namespace connect_bridge
