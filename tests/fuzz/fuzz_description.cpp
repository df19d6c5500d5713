// Descriptions of types, of any bytes: what is read is written alike, and any two can be compared.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/base/check.hpp"
#include "core/types/description_service.hpp"
#include "core/types/type_difference.hpp"

using namespace connect_bridge;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // Two descriptions, one line each.
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto end = text.find('\n');
  const auto first = parse_description(text.substr(0, end));
  if (!first.ok()) {
    CONNECT_CHECK(!first.error().message.empty());
    return 0;
  }
  CONNECT_CHECK(canonical_text(first.value()) == text.substr(0, end));
  // What our nodes tell of it is read as what other nodes tell.
  const auto response = description_response(first.value(), true);
  CONNECT_CHECK(text_of_response(response.view()) == text.substr(0, end));
  if (end == std::string_view::npos) return 0;
  const auto second = parse_description(text.substr(end + 1));
  if (!second.ok()) return 0;
  const std::string shown = difference(first.value(), second.value());
  CONNECT_CHECK(!shown.empty() && shown.size() <= kDifferenceBytesMax);
  return 0;
}
