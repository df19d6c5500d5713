// Base64 (RFC 4648).
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/base/bytes.hpp"

namespace connect_bridge {

// Base64 with '+' and '/', padded (RFC 4648 section 4).
[[nodiscard]] std::string to_base64(ByteView bytes);

// Base64url without padding (RFC 7515 section 2): with '-' and '_'.
[[nodiscard]] std::string to_base64url(ByteView bytes);
// nullopt: it is not valid. Only one text for each value is.
[[nodiscard]] std::optional<Bytes> from_base64url(std::string_view text);

}  // namespace connect_bridge
