#include "net/tls/client_hello.hpp"

#include <algorithm>
#include <optional>

namespace connect_bridge {
namespace {

constexpr std::size_t kRecordHead = 5;
constexpr std::size_t kMessageHead = 4;
// Else its bytes, one a record, would be put together thousands of times.
constexpr int kRecordsMax = 16;
constexpr std::uint8_t kHandshakeRecord = 22;
constexpr std::uint8_t kClientHelloMessage = 1;
constexpr std::size_t kServerNameExtension = 0;
constexpr std::size_t kAlpnExtension = 16;

// Takes parts of what is left; once one is not there, nothing is.
class HelloParts {
 public:
  explicit HelloParts(ByteView bytes) : rest_(bytes) {}

  std::size_t number(std::size_t size) {
    std::size_t value = 0;
    for (const std::uint8_t byte : bytes(size)) value = value << 8U | byte;
    return value;
  }
  ByteView bytes(std::size_t size) {
    if (size > rest_.size()) {
      whole_ = false;
      rest_ = {};
      return {};
    }
    const ByteView taken = rest_.first(size);
    rest_ = rest_.subspan(size);
    return taken;
  }
  // A block of bytes, after its length in `length_size` bytes.
  ByteView block(std::size_t length_size) { return bytes(number(length_size)); }
  [[nodiscard]] bool empty() const { return rest_.empty(); }
  // Nothing was missing.
  [[nodiscard]] bool whole() const { return whole_; }

 private:
  ByteView rest_;
  bool whole_ = true;
};

// The bytes of the message so far, without the heads of the records.
struct HelloRecords {
  Bytes message;
  std::size_t missing_head = 0;  // of the record that is not complete yet
  std::size_t missing_body = 0;
  bool wrong = false;
};

HelloRecords records_of(ByteView bytes) {
  HelloRecords read;
  for (int records = 1; !bytes.empty(); ++records) {
    if (records > kRecordsMax || bytes[0] != kHandshakeRecord ||
        (bytes.size() > 1 && bytes[1] != 3)) {
      read.wrong = true;
      return read;
    }
    if (bytes.size() < kRecordHead) {
      read.missing_head = kRecordHead - bytes.size();
      return read;
    }
    const std::size_t size = std::size_t{bytes[3]} << 8U | bytes[4];
    if (size == 0 || size > ClientHello::kBytesMax) {
      read.wrong = true;
      return read;
    }
    const ByteView body = bytes.subspan(kRecordHead);
    const std::size_t there = std::min(size, body.size());
    read.message.insert(read.message.end(), body.begin(),
                        body.begin() + static_cast<std::ptrdiff_t>(there));
    read.missing_body = size - there;
    bytes = body.subspan(there);
  }
  return read;
}

bool read_server_name(ByteView extension, std::string& name) {
  HelloParts outer(extension);
  HelloParts list(outer.block(2));
  while (!list.empty() && list.whole()) {
    const std::size_t kind = list.number(1);
    const ByteView text = list.block(2);
    if (kind != 0 || !name.empty()) continue;
    name.assign(text.begin(), text.end());
    for (char& c : name) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return outer.whole() && outer.empty() && list.whole();
}

bool read_protocols(ByteView extension, std::vector<std::string>& protocols) {
  HelloParts outer(extension);
  HelloParts list(outer.block(2));
  while (!list.empty() && list.whole()) {
    const ByteView text = list.block(1);
    protocols.emplace_back(text.begin(), text.end());
  }
  return outer.whole() && outer.empty() && list.whole();
}

bool read_message(ByteView body, ClientHello& hello) {
  HelloParts parts(body);
  parts.bytes(2 + 32);                      // version, random
  parts.block(1);                           // session
  parts.block(2);                           // suites
  parts.block(1);                           // compression
  if (parts.empty()) return parts.whole();  // TLS 1.2 without extensions
  HelloParts extensions(parts.block(2));
  while (!extensions.empty() && extensions.whole()) {
    const std::size_t kind = extensions.number(2);
    const ByteView extension = extensions.block(2);
    if (kind == kServerNameExtension && !read_server_name(extension, hello.server_name))
      return false;
    if (kind == kAlpnExtension && !read_protocols(extension, hello.protocols)) return false;
  }
  return parts.whole() && parts.empty() && extensions.whole();
}

const ClientHello kWrongHello{.state = ClientHello::State::kWrong};

}  // namespace

ClientHello read_client_hello(ByteView bytes) {
  if (bytes.size() > ClientHello::kBytesMax) return kWrongHello;
  const HelloRecords records = records_of(bytes);
  const Bytes& message = records.message;
  if (records.wrong || (!message.empty() && message[0] != kClientHelloMessage)) return kWrongHello;
  HelloParts parts(message);
  parts.number(1);
  const std::size_t size = parts.number(3);
  if (parts.whole()) {
    if (kRecordHead + kMessageHead + size > ClientHello::kBytesMax) return kWrongHello;
    const ByteView body = parts.bytes(size);
    // A record with anything behind the message: a ClientHello comes alone.
    const std::size_t comes = message.size() + records.missing_body;
    if (comes > kMessageHead + size || (parts.whole() && records.missing_head > 0))
      return kWrongHello;
    if (parts.whole()) {
      ClientHello hello;
      if (!read_message(body, hello)) return kWrongHello;
      hello.state = ClientHello::State::kComplete;
      return hello;
    }
  }
  const std::size_t of_record = records.missing_head + records.missing_body;  // one of them
  const std::size_t missing = of_record > 0 ? of_record : kRecordHead;
  if (bytes.size() + missing > ClientHello::kBytesMax) return kWrongHello;
  return {.missing = missing};
}

}  // namespace connect_bridge
