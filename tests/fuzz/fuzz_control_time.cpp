// How long a control message takes to be read, whatever its shape: the bytes are a piece of one
// that is repeated until the message is as large as a peer may send it; each '#' in it becomes a
// number.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

#include "bench/control_shapes.hpp"
#include "bench/processor_time.hpp"
#include "core/base/check.hpp"
#include "core/wire/control.hpp"

using namespace connect_bridge;
using bench::filled;

namespace {

constexpr double kTimes = 10;  // the worst that is known takes four times as long as spaces

double seconds_for(std::string_view text) {
  const double began = bench::processor_seconds();
  static_cast<void>(decode_control(text));
  return bench::processor_seconds() - began;
}

// What cannot be read faster, on this machine and with these sanitizers.
double usual() {
  static const double seconds =
      seconds_for(filled(R"({"type":"withdraw","channels":[])", " ", "}"));
  return seconds;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view piece{reinterpret_cast<const char*>(data), size};
  // As entries of a list, members of an object, bytes of a string, and as all there is.
  const std::string texts[] = {
      filled(R"({"type":"demand","channels":[)", piece, "0]}"),
      filled(R"({"type":"offer","channels":[],"x":[)", piece, "0]}"),
      filled(R"({"type":"withdraw","channels":[])", piece, "}"),
      filled(R"({"type":"decline","channel":1,"code":"x","reason":")", piece, "\"}"),
      filled("", piece, ""),
  };
  for (const auto& text : texts) {
    // Others may need the processor, too: what is slow is read again.
    double seconds = seconds_for(text);
    for (int i = 0; i < 3 && seconds >= kTimes * usual(); ++i)
      seconds = std::min(seconds, seconds_for(text));
    if (seconds < kTimes * usual()) continue;
    std::fprintf(stderr, "%.1f ms; spaces take %.1f ms\n", seconds * 1e3, usual() * 1e3);
    CONNECT_CHECK(!"a control message takes too long to be read");
  }
  return 0;
}
