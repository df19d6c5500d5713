// A control message of any bytes: what was read can be written, and gives the same when read again.
#include <cstddef>
#include <cstdint>

#include "core/base/check.hpp"
#include "core/wire/control.hpp"
#include "fuzz/slow.hpp"

using namespace connect_bridge;

namespace {

void look(const std::uint8_t* data, std::size_t size) {
  const auto message = decode_control({reinterpret_cast<const char*>(data), size});
  if (!message.ok()) {
    CONNECT_CHECK(!message.error().message.empty());
    return;
  }
  const std::string text = encode(message.value());
  if (text.size() > kControlBytesMax) return;  // what was left to defaults is written out
  const auto again = decode_control(text);
  CONNECT_CHECK(again.ok());
  CONNECT_CHECK(encode(again.value()) == text);
  if (const auto* offer = std::get_if<Offer>(&message.value())) {
    for (const auto& part : encode_offers(offer->channels, offer->complete)) {
      CONNECT_CHECK(decode_control(part).ok());
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return quickly("a control message", [=] { look(data, size); });
}
