// Control texts that cross compressed, for those who read along.
#pragma once

#include <deque>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/compress/compress.hpp"
#include "core/flow/text_history.hpp"
#include "core/wire/control.hpp"
#include "core/wire/frame.hpp"

namespace connect_bridge::sim {

// Belongs to one direction of a connection. Who reads along does not know which copy the two sides
// agreed upon. A frame may refer only to what several copies have in common: each that fits stays
// possible.
class TextReader {
 public:
  // Copies of earlier histories, newest last: those at `complete`.
  using Kept = std::deque<Bytes>;

  // The texts of the frame; empty: it does not decompress.
  std::vector<std::string> read(const TextsFrame& frame, const Kept& kept = {}) {
    const Kept bases = frame.kept ? kept : std::exchange(possible_, {});
    std::string said;
    possible_.clear();
    for (const Bytes& base : bases) {
      const auto raw = decompress_delta(frame.body, base, frame.raw_bytes);
      if (!raw) continue;
      TextHistory history;
      history.go_on(base);
      history.add(raw.value());
      add(possible_, history.texts());
      said.assign(raw.value().begin(), raw.value().end());
    }
    return possible_.empty() ? std::vector<std::string>{} : split(said);
  }
  // The texts so far, if this one completes the first round.
  void note(const Control& control, Kept& kept) const {
    constexpr std::size_t kMost = 4;
    const auto* offer = std::get_if<Offer>(&control);
    if (!offer || !offer->complete) return;
    for (const Bytes& texts : possible_) add(kept, texts);
    while (kept.size() > kMost) kept.pop_front();
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

  static void add(Kept& to, const Bytes& texts) {
    std::erase(to, texts);
    to.push_back(texts);
  }

  Kept possible_{Bytes{}};
};

}  // namespace connect_bridge::sim
