// The tokens that a server accepts, and whose they are.
//
// A token file is YAML: a list of entries, a map from identity to entry, or either under the key
// `tokens`. An entry has `token` or `token_sha256`, `identity` (in a list), and optionally `groups`
// (list or name) and `expires` (2027-01-31, or 2027-01-31T12:00:00Z; UTC). In a map an entry may be
// the token alone. A file that is one word is one token.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "auth/secret.hpp"
#include "core/base/time.hpp"
#include "core/policy/policy.hpp"

namespace connect_bridge {

class TokenTable {
 public:
  // The identity of whoever has the only token.
  static constexpr char kSingleIdentity[] = "token";

  struct Found {
    std::optional<Identity> identity;
    std::string reason;  // why there is none
  };

  // All problems and warnings of a text, each beginning with "<source>:<line>: ".
  void read(std::string_view text, const std::string& source, Stamp now,
            std::vector<std::string>& problems, std::vector<std::string>& warnings);
  // One token. `source` names the parameter.
  void add_single(std::string_view token, const std::string& source,
                  std::vector<std::string>& problems);

  // Takes the same time whichever entry it is, and if it is none.
  [[nodiscard]] Found find(ByteView credential, Stamp now) const;
  [[nodiscard]] std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    Digest digest{};
    Identity identity;
  };

  [[nodiscard]] bool add(Entry entry);  // false: this token is there already

  friend class TokenFileReader;
  std::vector<Entry> entries_;
};

// Nanoseconds since 1970 of "2027-01-31" or "2027-01-31T12:00:00Z"; nullopt: neither.
[[nodiscard]] std::optional<Stamp> parse_date(std::string_view text);

}  // namespace connect_bridge
