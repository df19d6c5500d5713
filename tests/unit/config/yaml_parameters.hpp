// Parameters from YAML as rcl makes them (enough of it for the examples), and what became of them.
#pragma once

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

#include "config/config.hpp"

namespace connect_bridge {

inline ParameterValue scalar_of(const YAML::Node& node) {
  if (node.Tag() == "!") return node.as<std::string>();
  std::int64_t whole = 0;
  double number = 0;
  bool flag = false;
  if (YAML::convert<std::int64_t>::decode(node, whole)) return whole;
  if (YAML::convert<double>::decode(node, number)) return number;
  if (YAML::convert<bool>::decode(node, flag)) return flag;
  return node.as<std::string>();
}

inline void flatten(const YAML::Node& node, const std::string& key, ParameterMap& map) {
  if (node.IsMap()) {
    for (const auto& child : node) {
      const auto name = child.first.as<std::string>();
      flatten(child.second, key.empty() ? name : key + "." + name, map);
    }
  } else if (node.IsSequence()) {
    map[key] = node.as<std::vector<std::string>>();
  } else {
    map[key] = scalar_of(node);
  }
}

// The parameters of the first node in a text, whatever its name is.
inline ParameterMap parameters_of(const YAML::Node& file) {
  ParameterMap map;
  flatten(file.begin()->second["ros__parameters"], "", map);
  return map;
}

inline ParameterMap yaml(const std::string& text) {
  ParameterMap map;
  flatten(YAML::Load(text), "", map);
  return map;
}

inline const Surroundings kWithToken{
    .token_in_environment = true, .unreadable = {}, .distrusted = {}, .installed = {}};

inline std::string problems_text(const Parsed& parsed) {
  std::string text;
  for (const Problem& problem : parsed.problems) text += to_text(problem) + "\n";
  return text;
}

// The Config of parameters that must be right.
inline Config config_of(const ParameterMap& map, Role role) {
  const Parsed parsed = parse_config(map, role, kWithToken);
  EXPECT_EQ(problems_text(parsed), "");
  return parsed.config.value_or(Config{});
}

}  // namespace connect_bridge
