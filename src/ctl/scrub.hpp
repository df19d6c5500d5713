// Hides secrets in texts that are given to others.
#pragma once

#include <set>
#include <string>
#include <string_view>

#include "core/base/parameter.hpp"

namespace connect_bridge {

// Hides known secrets anywhere, and text that looks like a secret: keys in PEM, tokens of three
// parts, "Bearer ...", user and query of an address, an invitation's code. Pins, hashes of types
// and names of people stay.
class Scrubber {
 public:
  // Learns the secrets in these parameters, whole and each word of them: values of secret keys,
  // values of keys that are neither known here nor ROS's own, and secrets in addresses.
  void learn(const ParameterMap& parameters);
  // Learns one secret. Those shorter than kLeast are ignored, since harmless text would match them.
  void learn(std::string_view secret);

  // The text with "(hidden)" in place of each secret.
  [[nodiscard]] std::string scrubbed(std::string_view text) const;

  static constexpr std::size_t kLeast = 6;

 private:
  void learn_words(std::string_view secret);
  // Learns the password and the parts of the query.
  void learn_address(std::string_view address);

  struct LongestFirst {
    [[nodiscard]] bool operator()(const std::string& a, const std::string& b) const;
  };

  std::set<std::string, LongestFirst> known_;
};

// The parameters as YAML for others, one a line. Left out are values of secret keys and of keys
// that are not known here, and parts of addresses that may be secret.
[[nodiscard]] std::string parameters_to_show(const ParameterMap& parameters);

}  // namespace connect_bridge
