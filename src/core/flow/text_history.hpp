// The control texts that crossed compressed in one direction of a link.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>

#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/base/sha256.hpp"

namespace connect_bridge {

// Both sides of a connection keep the same texts, and each further compressed text is the
// difference to them. At `complete` both take a copy of the connection's own texts, to which the
// link's next connection may refer: so offers that still hold cost little then. Single-threaded.
class TextHistory {
 public:
  static constexpr std::size_t kBytesMax = 256 << 10;  // docs/protocol.md section 6

  [[nodiscard]] const Bytes& texts() const { return texts_; }
  void add(ByteView texts) {
    texts_.insert(texts_.end(), texts.begin(), texts.end());
    if (texts_.size() > kBytesMax)
      texts_.erase(texts_.begin(), texts_.end() - static_cast<std::ptrdiff_t>(kBytesMax));
    own_ = std::min(own_ + texts.size(), texts_.size());
  }
  // Continues with texts of an earlier connection.
  void go_on(Bytes kept) {
    texts_ = std::move(kept);
    own_ = 0;
  }
  // The first round is complete: keeps a copy for the next connection, unless there is one. Texts
  // of earlier connections are not in it: the round has all that holds.
  void keep() {
    if (kept_.empty()) kept_.assign(texts_.end() - static_cast<std::ptrdiff_t>(own_), texts_.end());
  }
  [[nodiscard]] const Bytes& kept() const { return kept_; }
  // Bytes that are held.
  [[nodiscard]] std::size_t size() const { return texts_.size() + kept_.size(); }

 private:
  Bytes texts_;
  std::size_t own_ = 0;  // bytes at the end of texts_ that this connection has added
  Bytes kept_;
};

// By which two sides compare what they keep; none if that is nothing.
[[nodiscard]] inline Token128 digest_of(const Bytes& kept) {
  Token128 digest;
  if (kept.empty()) return digest;
  const Digest whole = sha256(kept);
  std::copy_n(whole.begin(), digest.bytes.size(), digest.bytes.begin());
  return digest;
}

}  // namespace connect_bridge
