// Lines for the log about types that have one definition here and another one at a peer.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/link/account.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// The name of a type, and the hash of one of its definitions ("RIHS01_...").
using Definition = std::pair<std::string, std::string>;

struct Mismatch {
  Definition there;  // the peer's
  std::string hash_here;
  std::string what;                  // "cannot mirror /pose of /talker"
  std::string peer;                  // its label
  bool used = false;                 // the rules use it nevertheless
  std::shared_ptr<Account> account;  // of the peer
};

// A line waits for both descriptions, but not for long. Single-threaded.
class Mismatches {
 public:
  static constexpr Duration kPatience = std::chrono::seconds(5);
  static constexpr std::size_t kWaitingMax = 256;        // lines; further ones do not wait
  static constexpr std::size_t kAccountWaitingMax = 32;  // the same of one identity

  explicit Mismatches(Outputs& outputs) : outputs_(outputs) {}

  // False: this type and hash were told before, to this identity.
  [[nodiscard]] bool begin(Mismatch mismatch, const Now& now);
  [[nodiscard]] bool waits_for(const Definition& there) const;
  // The peer's description; empty: it will not come.
  void on_there(const Definition& there, const std::string& text);
  // Nobody offers that any longer: nothing of its description is kept.
  void on_gone(const Definition& there);
  void on_looked_up(const TypeLookedUp& found);
  void on_time(const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const;

 private:
  struct Line {
    Mismatch mismatch;
    LookupId lookup;  // none: neither side is asked
    TimePoint until;
    std::optional<std::string> here, there;  // descriptions; none: not known yet
  };

  void write(const Line& line);
  void write_complete();

  Outputs& outputs_;
  std::vector<Line> lines_;  // in the order of `until`
};

}  // namespace connect_bridge
