// Waiting items in lines that take turns: a line with many items does not delay the others.
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <limits>
#include <list>
#include <optional>
#include <utility>

namespace connect_bridge {

// Without room the newest item of a line is rejected: of its own line if that is full, else of the
// longest. A line is found by looking at all of them. Not thread-safe.
template <class Key, class Item>
class Turns {
 public:
  struct Bounds {
    std::size_t all = std::numeric_limits<std::size_t>::max();
    std::size_t of_line = all;
  };

  Turns() = default;  // unbounded
  explicit Turns(Bounds bounds) : bounds_(bounds) {}

  // The item that finds no place, if any: the new one, or one that has waited.
  [[nodiscard]] std::optional<Item> add(const Key& line, Item item) {
    auto own = std::find_if(lines_.begin(), lines_.end(),
                            [&](const Line& other) { return other.key == line; });
    if (own == lines_.end()) own = lines_.insert(own, Line{line, {}});
    own->items.push_back(std::move(item));
    ++size_;
    if (own->items.size() > bounds_.of_line) return take_newest(own);
    if (size_ <= bounds_.all) return std::nullopt;
    auto longest = own;
    for (auto it = lines_.begin(); it != lines_.end(); ++it)
      if (it->items.size() > longest->items.size()) longest = it;
    return take_newest(longest);
  }

  // The oldest of the line that has waited longest for its turn: every other line has one turn at
  // most before it, and a line that comes later has none.
  std::optional<Item> take() {
    if (lines_.empty()) return std::nullopt;
    const auto next = lines_.begin();
    Item item = std::move(next->items.front());
    next->items.pop_front();
    lines_.splice(lines_.end(), lines_, next);  // mutant: turns
    shrink(next);
    return item;
  }

  template <class Which>
  void erase_if(Which which) {
    for (auto it = lines_.begin(); it != lines_.end();) {
      size_ -= std::erase_if(it->items, which);
      it = it->items.empty() ? lines_.erase(it) : std::next(it);
    }
  }

  void clear() {
    lines_.clear();
    size_ = 0;
  }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }

 private:
  struct Line {
    Key key;
    std::deque<Item> items;  // never empty
  };
  using Lines = std::list<Line>;  // in the order of their turns

  Item take_newest(typename Lines::iterator line) {
    Item item = std::move(line->items.back());
    line->items.pop_back();
    shrink(line);
    return item;
  }
  void shrink(typename Lines::iterator line) {
    --size_;
    if (line->items.empty()) lines_.erase(line);
  }

  Bounds bounds_;
  Lines lines_;
  std::size_t size_ = 0;
};

// Turns of groups, and within a group of its lines: a group with many lines gets no more.
// Unbounded.
template <class Group, class Key, class Item>
class TurnsOfGroups {
 public:
  void add(const Group& group, const Key& line, Item item) {
    auto own = std::find_if(groups_.begin(), groups_.end(),
                            [&](const auto& other) { return other.first == group; });
    if (own == groups_.end()) own = groups_.insert(own, {group, {}});
    static_cast<void>(own->second.add(line, std::move(item)));
  }
  std::optional<Item> take() {
    if (groups_.empty()) return std::nullopt;
    const auto next = groups_.begin();
    auto item = next->second.take();
    groups_.splice(groups_.end(), groups_, next);  // mutant: turns_of_groups
    if (next->second.empty()) groups_.erase(next);
    return item;
  }
  template <class Which>
  void erase_if(Which which) {
    for (auto it = groups_.begin(); it != groups_.end();) {
      it->second.erase_if(which);
      it = it->second.empty() ? groups_.erase(it) : std::next(it);
    }
  }
  void clear() { groups_.clear(); }
  [[nodiscard]] bool empty() const { return groups_.empty(); }

 private:
  std::list<std::pair<Group, Turns<Key, Item>>> groups_;  // in the order of their turns, none empty
};

}  // namespace connect_bridge
