// How much is taken of a peer before its login (docs/protocol.md, "Login").
#pragma once

#include <cstddef>
#include <cstdint>

namespace connect_bridge {

// Shut until the login is right. All bytes count, those of pings, of frames without content and of
// heads, too; and of each read and message what it costs beside them.
class Gate {
 public:
  static constexpr std::size_t kPacketBytesMax = 4096;  // of one message

  // The bytes read of the connection so far are its handshake.
  explicit Gate(std::uint64_t read_bytes) : begin_(read_bytes) {}

  void open() { open_ = true; }
  [[nodiscard]] bool is_open() const { return open_; }
  // To be asked at each read and message, with what was read in all. False: it is too much. While
  // the connection is being closed more may be on its way.
  [[nodiscard]] bool admits(std::uint64_t read_bytes, bool closing) {
    if (open_) return true;
    return read_bytes - begin_ + kStepOverhead * ++steps_ <=
           (closing ? 4 : 1) * kBytesMax;  // mutant: gate_reads
  }

 private:
  static constexpr std::uint64_t kBytesMax = 16384;
  static constexpr std::uint64_t kStepOverhead = 8;

  std::uint64_t begin_;
  std::uint64_t steps_ = 0;
  bool open_ = false;
};

}  // namespace connect_bridge
