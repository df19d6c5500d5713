// The three login records: what is read must be exactly what would be written.
#include <cstddef>
#include <cstdint>

#include "core/base/check.hpp"
#include "core/wire/login.hpp"
#include "fuzz/slow.hpp"

using namespace connect_bridge;

namespace {

template <class Record>
void check(const Result<Record>& record, ByteView bytes) {
  if (!record.ok()) return;
  CONNECT_CHECK(bytes.size() <= kLoginRecordBytesMax);
  CONNECT_CHECK(encode(record.value()) == Bytes(bytes.begin(), bytes.end()));
}

void look(const std::uint8_t* data, std::size_t size) {
  const ByteView bytes{data, size};
  check(decode_hello(bytes), bytes);
  check(decode_login(bytes), bytes);
  check(decode_welcome(bytes), bytes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return quickly("a record", [=] { look(data, size); });
}
