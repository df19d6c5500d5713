// A proxy's headers: before the first byte, and in the request.
#include <cstddef>
#include <cstdint>
#include <string>

#include "core/base/check.hpp"
#include "fuzz/slow.hpp"
#include "net/tcp/proxy_header.hpp"

using namespace connect_bridge;

namespace {

constexpr std::size_t kHeaderBytesMax = 2064;

void check_header(ByteView bytes) {
  const ProxyHeader header = read_proxy_header(bytes);
  if (header.state == ProxyHeader::State::kMore)
    CONNECT_CHECK(header.missing > 0 && bytes.size() + header.missing <= kHeaderBytesMax);
  if (header.state != ProxyHeader::State::kComplete) return;
  // No byte behind it is taken: all that is shorter wants more, and never beyond the end.
  for (std::size_t size = 0; size < bytes.size();) {
    const ProxyHeader before = read_proxy_header(bytes.first(size));
    CONNECT_CHECK(before.state == ProxyHeader::State::kMore);
    size += before.missing;
    CONNECT_CHECK(size <= bytes.size());
  }
}

// Whatever a client has written, only the proxy's own entry after it counts.
void check_forwarded(const std::string& written) {
  static const AddressRanges trusted{AddressRange::parse("10.0.0.0/8").value()};
  const std::string both = written + ", 203.0.113.5";
  const auto source = forwarded_source({both}, trusted);
  CONNECT_CHECK(source && source->address.to_string() == "203.0.113.5");
  static_cast<void>(forwarded_source({written}, trusted));
}

void look(const std::uint8_t* data, std::size_t size) {
  check_header({data, size});
  const std::string written{reinterpret_cast<const char*>(data), size};
  check_forwarded(written);
  static_cast<void>(AddressRange::parse(written));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return quickly("a proxy's header", [=] { look(data, size); });
}
