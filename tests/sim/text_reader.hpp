// Control texts that cross compressed, for those who read along.
#pragma once

#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "core/compress/compress.hpp"
#include "core/flow/text_history.hpp"
#include "core/wire/control.hpp"
#include "core/wire/frame.hpp"

namespace connect_bridge::sim {

// Belongs to one direction of a connection.
class TextReader {
 public:
  // Copies of earlier histories, newest last: those at `complete`.
  using Kept = std::deque<Bytes>;

  // The texts of the frame; empty: it does not decompress.
  std::vector<std::string> read(const TextsFrame& frame, const Kept& kept = {}) {
    Kept bases{history_.texts()};
    if (frame.kept) bases = kept;
    for (auto base = bases.rbegin(); base != bases.rend(); ++base) {
      const auto raw = decompress_delta(frame.body, *base, frame.raw_bytes);
      if (!raw) continue;
      history_.go_on(*base);
      history_.add(raw.value());
      return split({reinterpret_cast<const char*>(raw.value().data()), raw.value().size()});
    }
    return {};
  }
  // The texts so far, if this one completes the first round.
  void note(const Control& control, Kept& kept) const {
    constexpr std::size_t kMost = 32;
    const auto* offer = std::get_if<Offer>(&control);
    if (!offer || !offer->complete) return;
    kept.push_back(history_.texts());
    if (kept.size() > kMost) kept.pop_front();
  }

 private:
  static std::vector<std::string> split(std::string_view rest) {
    std::vector<std::string> texts;
    for (;;) {
      const auto end = rest.find('\n');
      texts.emplace_back(rest.substr(0, end));
      if (end == std::string_view::npos) return texts;
      rest.remove_prefix(end + 1);
    }
  }

  TextHistory history_;
};

}  // namespace connect_bridge::sim
