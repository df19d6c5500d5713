// Names that have changed, and the links that have not looked at them yet.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

#include "core/base/course.hpp"
#include "core/base/turns.hpp"
#include "core/link/link.hpp"

namespace connect_bridge {

// A node that starts may bring a thousand names, which concern each of a hundred links. A link
// looks at all names when it begins, then at the news, each once, in the order in which they came.
// Identities take turns, and links within one. The owner counts what a step may do, and calls
// neither note() nor forget() from inside of give_turns(), each() and again_if(). Single-threaded.
template <class Name>
class LinkNews {
 public:
  struct OfLink {
    explicit OfLink(Link& of) : link(&of) {}

    Link* link;
    Course all{};       // through all that there is
    bool full = false;  // set by the owner: something found no place on the link; again() clears it

   private:
    friend class LinkNews;
    std::uint64_t seen = 0;  // the news that it has looked at
    bool waits = false;      // for its turn
  };

  // All names are due at the link, and the news so far are among them.
  void begin(Link& link) {
    OfLink& of = links_.try_emplace(link.id, link).first->second;
    of.seen = last_;
    again(of);
  }
  // All names are due at it again, the news as well.
  void again(OfLink& of) {
    of.all = {};
    of.full = false;
    wait(of);
  }
  // Null: the link has not begun.
  [[nodiscard]] OfLink* find(LinkId link) {
    const auto at = links_.find(link);
    return at == links_.end() ? nullptr : &at->second;
  }
  // The connection is lost.
  void forget(LinkId link) {
    if (links_.erase(link) == 0) return;
    turns_.erase_if([&](LinkId waiting) { return waiting == link; });
    forget_old();
  }
  // The names may be due at every link.
  template <class Names>
  void note(const Names& names) {
    for (const auto& each : names) {
      const auto [at, is_new] = numbers_.try_emplace(Name(each), 0);
      if (!is_new) news_.erase(at->second);
      at->second = ++last_;
      news_.emplace(last_, at);
    }
    if (names.empty()) return;
    for (auto& [id, of] : links_) wait(of);
  }

  // Gives turns while the step has something left. `look` does what is due at the link, as much as
  // is left. True: nothing is due there any more.
  template <class Look>
  void give_turns(const std::size_t& left, Look look) {
    while (left > 0) {
      const auto next = turns_.take();
      if (!next) break;
      OfLink& of = links_.at(*next);
      of.waits = false;
      if (!look(of)) wait(of);
    }
    forget_old();
  }
  // Looks at the link's news, as many as `course` allows. True: it has looked at all.
  template <class Look>
  [[nodiscard]] bool each(OfLink& of, Course& course, Look look) {
    auto next = news_.upper_bound(of.seen);
    for (; next != news_.end() && course.take(); ++next) {
      of.seen = next->first;
      look(next->second->first);
    }
    return next == news_.end();
  }
  template <class Again>
  void again_if(Again is_due) {
    for (auto& [id, of] : links_)
      if (is_due(of)) again(of);
  }
  // A link waits for its turn.
  [[nodiscard]] bool waits() const { return !turns_.empty(); }

 private:
  void wait(OfLink& of) {
    if (!std::exchange(of.waits, true))
      turns_.add(of.link->account->number, of.link->id, of.link->id);
  }
  void forget_old() {
    std::uint64_t seen = last_;
    for (const auto& [id, of] : links_) seen = std::min(seen, of.seen);
    while (!news_.empty() && news_.begin()->first <= seen) {
      numbers_.erase(news_.begin()->second);
      news_.erase(news_.begin());
    }
  }

  std::map<LinkId, OfLink> links_;
  TurnsOfGroups<std::uint64_t, LinkId, LinkId> turns_;  // accounts, their links
  // Names that may be due at every link, each once, in the order in which they came.
  std::map<Name, std::uint64_t> numbers_;
  std::map<std::uint64_t, typename std::map<Name, std::uint64_t>::iterator> news_;
  std::uint64_t last_ = 0;
};

}  // namespace connect_bridge
