// A server's token file: problems or tokens, never a token in a text, and what replaces it. Input:
// two files, with a zero byte between them.
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "access/login/token_table.hpp"
#include "core/base/check.hpp"

using namespace connect_bridge;

namespace {

// Texts are searched for a token if it is written like this and nothing else is.
constexpr std::string_view kHush = "hush!";

TokenTable read(std::string_view text) {
  TokenTable table;
  std::vector<std::string> problems, warnings;
  table.read(text, "f", 1'000'000'000, problems, warnings);
  const bool plain = text.starts_with(kHush) && text.find('\n') == std::string_view::npos;
  for (const auto& problem : problems) {
    CONNECT_CHECK(problem.starts_with("f:"));
    CONNECT_CHECK(!plain || problem.find(kHush) == std::string::npos);
  }
  return table;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text{reinterpret_cast<const char*>(data), size};
  const auto middle = text.find('\0');
  const TokenTable before = read(text.substr(0, middle));
  const TokenTable after =
      read(middle == std::string_view::npos ? std::string_view{} : text.substr(middle + 1));
  CONNECT_CHECK(before.changes_to(before).empty());
  CONNECT_CHECK(before.changes_to(after).size() <= before.size());
  const auto found = before.find({data, size}, 0);
  CONNECT_CHECK(found.identity.has_value() == found.reason.empty());
  return 0;
}
