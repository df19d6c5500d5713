// What strangers begin with at a relay.
#include <cstddef>
#include <cstdint>

#include "core/base/check.hpp"
#include "fuzz/slow.hpp"
#include "net/tls/client_hello.hpp"

using namespace connect_bridge;

namespace {

// No byte beyond it is taken: all that is shorter wants more, and never beyond the end.
void look(const std::uint8_t* data, std::size_t size) {
  const ByteView bytes(data, size);
  const ClientHello whole = read_client_hello(bytes);
  if (whole.state == ClientHello::State::kMore)
    CONNECT_CHECK(whole.missing > 0 && size + whole.missing <= ClientHello::kBytesMax);
  if (whole.state != ClientHello::State::kComplete) return;
  CONNECT_CHECK(size <= ClientHello::kBytesMax);
  for (std::size_t have = 0; have < size;) {
    const ClientHello part = read_client_hello(bytes.first(have));
    CONNECT_CHECK(part.state == ClientHello::State::kMore);
    have += part.missing;
    CONNECT_CHECK(have <= size);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return quickly("a ClientHello", [=] { look(data, size); });
}
