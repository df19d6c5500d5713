// Messages that leave with a larger one: the CameraInfo of an image.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <unordered_map>

#include "core/base/time.hpp"

namespace connect_bridge {

// Messages that belong together have the same set (node and namespace) and the same stamp.
struct Moment {
  std::uint64_t set = 0;  // 0: it belongs to nothing
  Stamp stamp = 0;
  bool follows = false;  // it leaves with the large one of the moment, which does not wait for it

  [[nodiscard]] bool is_large() const { return set != 0 && !follows; }
};

// The fate of a link's large messages, so that the messages that follow them leave with them and
// not without them. Single-threaded.
class Together {
 public:
  // A large message was admitted, and will leave or be given up.
  void expect(const Moment& moment, TimePoint now);
  // All of it was handed out.
  void left(const Moment& moment) { end(moment, true); }
  // The message was dropped, or refused in the first place.
  void gone(const Moment& moment) { end(moment, false); }

  enum class Verdict : std::uint8_t { kGo, kWait, kDrop };
  struct Answer {
    Verdict verdict = Verdict::kGo;
    TimePoint until = TimePoint::max();  // kWait: then it is kGo, unless more is known before
  };
  // About a message that follows and came at `since`: it goes when the large one has left, and is
  // dropped when that was. It goes alone where no large ones are sent, or none came for it within
  // one period of theirs.
  [[nodiscard]] Answer ask(const Moment& moment, TimePoint since, TimePoint now) const;

  // Whether an answer may have changed since this was called last.
  [[nodiscard]] bool changed() const { return changed_; }
  void settled() { changed_ = false; }

 private:
  struct Large {
    Stamp stamp = 0;
    std::uint32_t under_way = 0;  // several, where an image is sent in several forms
    bool left = false;
  };
  struct Set {
    std::deque<Large> large;  // the newest; more only while they are under way
    Stamp newest = 0;
    std::optional<TimePoint> came{};
    Duration period{};  // between the last two
  };
  static Large& find_or_add(Set& set, Stamp stamp);
  static const Large* find(const Set& set, Stamp stamp);
  Set& set_of(const Moment& moment);
  void end(const Moment& moment, bool left);

  std::unordered_map<std::uint64_t, Set> sets_;
  bool changed_ = false;
};

}  // namespace connect_bridge
