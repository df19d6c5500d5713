// What waits, in lines that take turns: nobody waits for long because another one brings much.
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace connect_bridge {

// Bounded. Who finds no place is the newest of a line: of its own if that is full; where all places
// are taken, of the longest. Not thread-safe.
template <class Item>
class Turns {
 public:
  struct Bounds {
    std::size_t all = 0;
    std::size_t of_line = 0;
  };

  explicit Turns(Bounds bounds) : bounds_(bounds) {}

  // What finds no place, if any: the new one, or one that has waited.
  [[nodiscard]] std::optional<Item> add(const std::string& line, Item item) {
    const auto own = lines_.try_emplace(line).first;
    own->second.push_back(std::move(item));
    ++size_;
    if (own->second.size() > bounds_.of_line) return take_newest(own);
    if (size_ <= bounds_.all) return std::nullopt;
    auto longest = own;
    for (auto it = lines_.begin(); it != lines_.end(); ++it)
      if (it->second.size() > longest->second.size()) longest = it;
    return take_newest(longest);
  }

  // The oldest of the line after the last one that had its turn.
  std::optional<Item> take() {
    if (lines_.empty()) return std::nullopt;
    auto next = lines_.upper_bound(last_);
    if (next == lines_.end()) next = lines_.begin();
    last_ = next->first;
    Item item = std::move(next->second.front());
    next->second.pop_front();
    shrink(next);
    return item;
  }

  template <class Which>
  void erase_if(Which which) {
    for (auto it = lines_.begin(); it != lines_.end();) {
      size_ -= std::erase_if(it->second, which);
      it = it->second.empty() ? lines_.erase(it) : std::next(it);
    }
  }

  void clear() {
    lines_.clear();
    size_ = 0;
  }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }

 private:
  using Lines = std::map<std::string, std::deque<Item>>;  // none is empty

  Item take_newest(typename Lines::iterator line) {
    Item item = std::move(line->second.back());
    line->second.pop_back();
    shrink(line);
    return item;
  }
  void shrink(typename Lines::iterator line) {
    --size_;
    if (line->second.empty()) lines_.erase(line);
  }

  Bounds bounds_;
  Lines lines_;
  std::string last_;
  std::size_t size_ = 0;
};

}  // namespace connect_bridge
