#include "access/login/token_table.hpp"

#include <fmt/chrono.h>
#include <openssl/crypto.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <ctime>
#include <map>

#include "access/login/names.hpp"
#include "core/base/hex.hpp"

namespace connect_bridge {

std::optional<Stamp> parse_date(std::string_view text) {
  const std::string whole = std::string(text) + (text.size() == 10 ? "T00:00:00Z" : "");
  std::tm time{};
  if (::strptime(whole.c_str(), "%Y-%m-%dT%H:%M:%SZ", &time) == nullptr) return std::nullopt;
  if (time.tm_year < 1970 - 1900 || time.tm_year > 2200 - 1900) return std::nullopt;
  const Stamp stamp = static_cast<Stamp>(::timegm(&time)) * kStampSecond;
  // February 30 becomes March 2, and a blank is taken for a zero.
  return date_text(stamp) == whole ? std::optional(stamp) : std::nullopt;
}

std::string date_text(Stamp time) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}Z",
                     fmt::gmtime(static_cast<std::time_t>(time / kStampSecond)));
}

// Walks the YAML of one token file.
class TokenFileReader {
 public:
  TokenFileReader(TokenTable& table, std::string source, Stamp now,
                  std::vector<std::string>& problems, std::vector<std::string>& warnings)
      : table_(table),
        source_(std::move(source)),
        now_(now),
        problems_(problems),
        warnings_(warnings) {}

  void read(const YAML::Node& root) {
    if (root.IsNull()) return;  // comments only
    if (!root.IsSequence()) {
      return problem(root.Mark(),
                     "expected a list of entries ('ctl token' makes one), or one token");
    }
    for (const auto& node : root) {
      if (node.IsMap()) {
        entry(node);
      } else {
        problem(node.Mark(), "an entry is a map with 'identity' and 'token_sha256'");
      }
    }
  }

  void problem(const YAML::Mark& mark, const std::string& text) {
    problems_.push_back(at(mark) + text);
  }

 private:
  [[nodiscard]] std::string at(const YAML::Mark& mark) const {
    return source_ + ":" + std::to_string(mark.line + 1) + ": ";
  }

  void entry(const YAML::Node& node) {
    TokenTable::Entry made;
    const std::size_t before = problems_.size();
    bool has_digest = false;
    for (const auto& pair : node) {
      const std::string key = pair.first.IsScalar() ? pair.first.Scalar() : std::string{};
      has_digest = has_digest || key == "token_sha256";
      member(key, pair.first.Mark(), pair.second, made);
    }
    if (problems_.size() != before) return;
    if (!has_digest) problem(node.Mark(), "'token_sha256' is missing");
    if (made.identity.name.empty()) problem(node.Mark(), "'identity' is missing");
    if (problems_.size() == before) add(node.Mark(), std::move(made));
  }

  void member(const std::string& key, const YAML::Mark& mark, const YAML::Node& value,
              TokenTable::Entry& made) {
    if (key == "token_sha256") return digest(value, made);
    if (key == "identity") return identity_name(value, made);
    if (key == "groups") return groups(value, made);
    if (key == "expires") return expires(value, made);
    if (key == "comment") return;
    if (key == "token")
      return problem(mark,
                     "a token does not stand here in plain text: write its token_sha256 "
                     "('ctl token' makes both)");
    problem(mark,
            "unknown key '" + key + "' (known: token_sha256, identity, groups, expires, comment)");
  }

  void digest(const YAML::Node& node, TokenTable::Entry& made) {
    const auto parsed = parse_digest(node.IsScalar() ? node.Scalar() : std::string{});
    if (!parsed) {
      return problem(node.Mark(),
                     "token_sha256: expected 64 hexadecimal digits (printf %s TOKEN | sha256sum)");
    }
    made.digest = *parsed;
  }

  void identity_name(const YAML::Node& node, TokenTable::Entry& made) {
    made.identity.name = node.IsScalar() ? node.Scalar() : std::string{};
    const std::string wrong = name_problem(made.identity.name);
    if (!wrong.empty()) problem(node.Mark(), "identity: the name " + wrong);
  }

  void groups(const YAML::Node& node, TokenTable::Entry& made) {
    const auto group = [&](const YAML::Node& name) {
      const std::string text = name.IsScalar() ? name.Scalar() : std::string{};
      const std::string wrong = name_problem(text);
      if (!wrong.empty()) return problem(name.Mark(), "groups: a name " + wrong);
      made.identity.groups.push_back(text);
    };
    if (node.IsScalar()) return group(node);
    if (!node.IsSequence()) return problem(node.Mark(), "groups: expected a list of names");
    for (const auto& name : node) group(name);
  }

  void expires(const YAML::Node& node, TokenTable::Entry& made) {
    const auto date = parse_date(node.IsScalar() ? node.Scalar() : std::string{});
    if (!date) {
      return problem(node.Mark(),
                     "expires: expected a date in UTC, 2027-01-31 or 2027-01-31T12:00:00Z");
    }
    made.identity.expires = *date;
  }

  void add(const YAML::Mark& mark, TokenTable::Entry made) {
    const std::string name = made.identity.name;
    if (made.identity.expires != 0 && made.identity.expires <= now_) {
      warnings_.push_back(at(mark) + "the token of '" + name + "' has expired");
    }
    if (!table_.add(std::move(made))) {
      problem(mark, "the token of '" + name + "' is there twice");
    }
  }

  TokenTable& table_;
  std::string source_;
  Stamp now_;
  std::vector<std::string>& problems_;
  std::vector<std::string>& warnings_;
};

void TokenTable::read(std::string_view text, const std::string& source, Stamp now,
                      std::vector<std::string>& problems, std::vector<std::string>& warnings) {
  const std::string_view word = trim(text);
  // A list may be JSON without a blank; no token looks like that.
  if (word.find_first_of(" \t\r\n{}[]\"") == std::string_view::npos)
    return add_single(word, source, problems);
  TokenFileReader reader(*this, source, now, problems, warnings);
  try {
    reader.read(YAML::Load(std::string{text}));
  } catch (const YAML::Exception& error) {
    // The exception's message does not quote the file.
    reader.problem(error.mark, "invalid YAML: " + error.msg);
  }
}

void TokenTable::add_single(std::string_view token, const std::string& source,
                            std::vector<std::string>& problems) {
  const std::string wrong = token_problem(token);
  if (!wrong.empty()) {
    problems.push_back(source + ": " + wrong);
    return;
  }
  Entry entry;
  entry.plain = true;
  entry.digest = sha256(view_of(token));
  entry.identity.name = kSingleIdentity;
  if (!add(std::move(entry))) problems.push_back(source + ": the same token is there twice");
}

bool TokenTable::add(Entry entry) {
  const auto same = [&](const Entry& other) { return other.digest == entry.digest; };
  if (std::any_of(entries_.begin(), entries_.end(), same)) return false;
  // Half of the digest distinguishes tokens, and reveals nothing of a random token.
  entry.identity.credential = "token:" + to_hex(ByteView{entry.digest}.first(16));
  entries_.push_back(std::move(entry));
  return true;
}

bool TokenTable::has_plain() const {
  return std::any_of(entries_.begin(), entries_.end(), [](const Entry& e) { return e.plain; });
}

std::vector<IdentitiesChanged::Change> TokenTable::changes_to(const TokenTable& next) const {
  std::map<std::string, const Identity*> later;
  for (const Entry& entry : next.entries_) later[entry.identity.credential] = &entry.identity;
  std::vector<IdentitiesChanged::Change> changes;
  for (const auto& [digest, now, plain] : entries_) {
    const auto then = later.find(now.credential);
    // A token that has another name now belongs to somebody else: the link with the old name is
    // closed.
    if (then == later.end() || then->second->name != now.name) {  // mutant: token_renamed
      changes.push_back({now.credential, std::nullopt});
    } else if (then->second->groups != now.groups || then->second->expires != now.expires) {
      changes.push_back({now.credential, *then->second});
    }
  }
  return changes;
}

bool TokenTable::knows(const std::string& identity) const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [&](const Entry& entry) { return entry.identity.name == identity; });
}

TokenTable::Tokens TokenTable::of_identity(const std::string& identity) const {
  Tokens tokens;
  for (const Entry& entry : entries_) {
    if (entry.identity.name != identity) continue;
    ++tokens.count;
    for (const std::string& group : entry.identity.groups)
      if (std::find(tokens.groups.begin(), tokens.groups.end(), group) == tokens.groups.end())
        tokens.groups.push_back(group);
  }
  return tokens;
}

std::vector<TokenTable::Ending> TokenTable::ending(Stamp from, Stamp to,
                                                   const std::string& but) const {
  std::map<std::string, Stamp> first;
  for (const auto& [digest, identity, plain] : entries_) {
    const Stamp end = identity.expires;
    if (end == 0 || end <= from || end > to) continue;
    const auto& groups = identity.groups;
    if (!but.empty() && std::find(groups.begin(), groups.end(), but) != groups.end()) continue;
    const auto known = first.try_emplace(identity.name, end).first;
    known->second = std::min(known->second, end);
  }
  // An identity that has a later token needs no warning.
  for (const auto& [digest, identity, plain] : entries_)
    if (identity.expires == 0 || identity.expires > to) first.erase(identity.name);
  std::vector<Ending> sorted;
  for (const auto& [name, end] : first) sorted.push_back({name, end});
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Ending& a, const Ending& b) { return a.end < b.end; });
  return sorted;
}

Judgement TokenTable::find(ByteView credential, Stamp now) const {
  return find(sha256(credential), now);
}

Judgement TokenTable::find(const Digest& digest, Stamp now) const {
  // Digests have equal lengths, and a partial match reveals nothing. All entries are compared, so
  // that the time does not show which one matched.
  std::size_t found = entries_.size();
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const bool equal = CRYPTO_memcmp(entries_[i].digest.data(), digest.data(), digest.size()) == 0;
    found = equal ? i : found;
  }
  if (found == entries_.size()) return {std::nullopt, "unknown token"};
  const Identity& identity = entries_[found].identity;
  if (identity.expires != 0 && identity.expires <= now) {  // mutant: token_expiry
    return {std::nullopt, "the token of '" + identity.name + "' has expired"};
  }
  return {identity, {}};
}

}  // namespace connect_bridge
