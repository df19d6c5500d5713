#include "run/surroundings.hpp"

#include <cstdlib>
#include <memory>
#include <string>
#include <variant>

#include "access/login/credential.hpp"
#include "access/login/file_trust.hpp"
#include "ops/doctor/host_check.hpp"
#include "ros/types/type_supports.hpp"
#include "run/machine_memory.hpp"

namespace connect_bridge {

Variable environment() {
  return [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string{value ? value : ""};
  };
}

Surroundings surroundings() {
  Surroundings s;
  const char* token = std::getenv(kTokenVariable);
  s.token_in_environment = token && *token;
  s.variable = environment();
  s.unreadable = why_unreadable;
  s.distrusted = who_else_may_change;
  s.memory_bytes = machine_memory();
  s.installed = [types = std::make_shared<ros::TypeSupports>()](const std::string& type) {
    return !std::holds_alternative<ros::Refusal>(types->message(type, ""));
  };
  return s;
}

}  // namespace connect_bridge
