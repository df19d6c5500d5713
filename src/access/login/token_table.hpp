// Tokens that a server accepts, and their identities.
//
// A token file is YAML: a list of entries, each with `token_sha256` and `identity`, and optionally
// `groups` (list or name), `expires` (2027-01-31, or 2027-01-31T12:00:00Z; UTC) and `comment`. A
// file that is one word is one token.
//
// A plain hash is right for random tokens: 256 bits cannot be found by trying, however fast the
// hash is. Salt and a slow hash, which passwords need, would only make logins slow. A reader of the
// file learns names, but no token.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "access/login/authenticator.hpp"
#include "access/login/secret.hpp"
#include "core/base/time.hpp"
#include "core/policy/policy.hpp"
#include "core/ports/inputs.hpp"

namespace connect_bridge {

class TokenTable {
 public:
  // The identity of every client with the only token.
  static constexpr char kSingleIdentity[] = "token";

  // Reads a text of entries or one token. Problems and warnings each begin with "<source>:<line>:
  // ".
  void read(std::string_view text, const std::string& source, Stamp now,
            std::vector<std::string>& problems, std::vector<std::string>& warnings);
  // Adds one token. `source` names the parameter.
  void add_single(std::string_view token, const std::string& source,
                  std::vector<std::string>& problems);

  // The identity of a credential, or the reason of a refusal. The search takes the same time for
  // every entry, and for none.
  [[nodiscard]] Judgement find(ByteView credential, Stamp now) const;
  [[nodiscard]] Judgement find(const Digest& digest, Stamp now) const;
  [[nodiscard]] bool knows(const std::string& identity) const;
  // Number of an identity's tokens, and all their groups in the order of their first appearance.
  struct Tokens {
    std::size_t count = 0;
    std::vector<std::string> groups;
  };
  [[nodiscard]] Tokens of_identity(const std::string& identity) const;
  // Identities with a token that expires after `from` and not after `to`, each with the earliest
  // such time, sorted by it. An identity with a later token is left out, and so are tokens of the
  // group `but`, if any.
  struct Ending {
    std::string identity;
    Stamp end = 0;
  };
  [[nodiscard]] std::vector<Ending> ending(Stamp from, Stamp to, const std::string& but = {}) const;
  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  // Whether a token itself was given, not its hash.
  [[nodiscard]] bool has_plain() const;
  // The changes for links that logged in by this table, when `next` replaces it.
  [[nodiscard]] std::vector<IdentitiesChanged::Change> changes_to(const TokenTable& next) const;

 private:
  struct Entry {
    Digest digest{};
    Identity identity;
    bool plain = false;  // the token itself was given, not its hash
  };

  [[nodiscard]] bool add(Entry entry);  // false: this token is there already

  friend class TokenFileReader;
  std::vector<Entry> entries_;
};

// Nanoseconds since 1970 of "2027-01-31" or "2027-01-31T12:00:00Z"; nullopt: neither.
[[nodiscard]] std::optional<Stamp> parse_date(std::string_view text);
// The date with the time, in UTC, as parse_date() reads it.
[[nodiscard]] std::string date_text(Stamp time);

}  // namespace connect_bridge
