// What a configuration is checked against besides itself: values of the host.
#pragma once

#include <functional>
#include <string>

namespace connect_bridge {

// The value of an environment variable; empty: it is not set.
using Variable = std::function<std::string(const char* name)>;

struct Surroundings {
  bool token_in_environment = false;
  Variable variable{};                                     // empty: none is set
  std::function<bool(const std::string& file)> readable;   // empty: not checked
  std::function<bool(const std::string& type)> installed;  // a message type; empty: not checked
};

}  // namespace connect_bridge
