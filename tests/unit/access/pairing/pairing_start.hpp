// What the tests of a pairing's start have in common: a home of their own, and lines to start with.
#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <string>
#include <vector>

#include "access/pairing/pairing.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge {

inline constexpr char kRelayLine[] =
    "wss+relay://robot7@relay.example:443/"
    "#aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa."
    "47DEQpj8HBSa-_TImW-5JCeuQeRkm5NMpJWZG3hSuFU";
inline constexpr char kLine[] =
    "wss+pair://robot.local:9090/"
    "#00112233445566778899aabbccddeeff.47DEQpj8HBSa-_TImW-5JCeuQeRkm5NMpJWZG3hSuFU";

class PairingStart : public testing::Test {
 protected:
  PairingStart() {
    static int number = 0;
    ::setenv("ROS_HOME", (test::scratch_folder() + "home" + std::to_string(++number)).c_str(), 1);
  }
  ~PairingStart() override { ::unsetenv("ROS_HOME"); }

  static Start serve(const std::vector<std::string>& words, const ParameterMap& given = {}) {
    return start_with(given, read_arguments(words, Role::kServer), "/connect_server");
  }
  static Start join(const std::vector<std::string>& words, const ParameterMap& given = {}) {
    return start_with(given, read_arguments(words, Role::kClient), "/robot1/connect_client");
  }
};

}  // namespace connect_bridge
