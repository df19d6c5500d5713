// Whether the RMW exists here that the environment names.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace connect_bridge::ros {

// The variables with which rcl refuses every other RMW, as soon as it is loaded.
inline constexpr const char* kRmwVariables[] = {"RMW_IMPLEMENTATION", "RCL_ASSERT_RMW_ID_MATCHES"};

struct MissingMiddleware {
  std::string variable;                // "RMW_IMPLEMENTATION"
  std::string name;                    // its value
  std::vector<std::string> installed;  // the RMWs that ROS has here

  friend bool operator==(const MissingMiddleware&, const MissingMiddleware&) = default;
};

// The RMW that one of the variables names and that cannot be loaded: no program of ROS starts.
// Loads the RMW, as rcl does. Thread: not beside others that change the environment.
[[nodiscard]] std::optional<MissingMiddleware> missing_middleware();

// "RMW_IMPLEMENTATION=rmw_x_cpp; installed are rmw_fastrtps_cpp".
[[nodiscard]] std::string to_text(const MissingMiddleware& missing);

// The RMWs below these folders with ':' between them (AMENT_PREFIX_PATH).
[[nodiscard]] std::vector<std::string> installed_middlewares(const std::string& prefixes);

}  // namespace connect_bridge::ros
