// An entry of `tls.pin`: a server's public key, and the server's identity for the rules.
#pragma once

#include <iterator>
#include <sstream>
#include <string>

#include "core/policy/policy.hpp"

namespace connect_bridge {

struct Pin {
  std::string key;  // SHA-256 of the public key (SPKI), in base64
  Identity is;      // without a name: no identity
};

// "KEY", "KEY NAME" or "KEY NAME GROUP ...".
[[nodiscard]] inline Pin pin_in(const std::string& entry) {
  std::istringstream words(entry);
  Pin pin;
  words >> pin.key >> pin.is.name;
  pin.is.groups.assign(std::istream_iterator<std::string>(words), {});
  return pin;
}

}  // namespace connect_bridge
