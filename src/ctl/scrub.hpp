// Takes secrets out of texts that are given to others.
#pragma once

#include <set>
#include <string>
#include <string_view>

#include "core/base/parameter.hpp"

namespace connect_bridge {

// What is known to be secret goes wherever it stands, and what looks like a secret (keys in PEM,
// tokens of three parts, "Bearer ...", user and query of an address, an invitation's code). Pins,
// hashes of types and names of people stay.
class Scrubber {
 public:
  // Secrets that these parameters hold, whole and each word of them: of secret keys and of those
  // that are not known here, but for ROS's own, and in addresses.
  void learn(const ParameterMap& parameters);
  // Shorter ones than kLeast would also take what is none.
  void learn(std::string_view secret);

  [[nodiscard]] std::string scrubbed(std::string_view text) const;

  static constexpr std::size_t kLeast = 6;

 private:
  void learn_words(std::string_view secret);
  // The password and the parts of the query.
  void learn_address(std::string_view address);

  struct LongestFirst {
    [[nodiscard]] bool operator()(const std::string& a, const std::string& b) const;
  };

  std::set<std::string, LongestFirst> known_;
};

// The parameters as YAML for others, one a line. Values of secret keys and of keys that are not
// known here are left out, and what may be secret in an address.
[[nodiscard]] std::string parameters_to_show(const ParameterMap& parameters);

}  // namespace connect_bridge
