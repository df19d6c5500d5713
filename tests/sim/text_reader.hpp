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
    std::deque<TextHistory> before = std::exchange(possible_, {});
    if (frame.kept) {
      before.clear();
      for (const Bytes& base : kept) before.emplace_back().go_on(base);
    }
    std::string said;
    for (TextHistory& history : before) {
      const auto raw = decompress_delta(frame.body, history.texts(), frame.raw_bytes);
      if (!raw) continue;
      history.add(raw.value());
      said.assign(raw.value().begin(), raw.value().end());
      possible_.push_back(std::move(history));
    }
    return possible_.empty() ? std::vector<std::string>{} : split(said);
  }
  // The texts so far, if this one completes the first round.
  void note(const Control& control, Kept& kept) {
    constexpr std::size_t kMost = 32;
    const auto* offer = std::get_if<Offer>(&control);
    if (!offer || !offer->complete) return;
    for (TextHistory& history : possible_) {
      history.keep();
      std::erase(kept, history.kept());
      kept.push_back(history.kept());
    }
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

  std::deque<TextHistory> possible_{TextHistory{}};
};

}  // namespace connect_bridge::sim
