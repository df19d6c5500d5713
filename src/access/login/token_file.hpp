// Writes token files, for `ctl token` and for pairing.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include "access/login/secret.hpp"

namespace connect_bridge {

// One entry of a token file.
struct TokenEntry {
  std::string identity;
  std::vector<std::string> groups;
  std::string expires;  // 2027-01-31 or 2027-01-31T12:00:00Z; empty: never
  std::string comment;
  Digest digest{};
};

// The entry as text of the file, with a line end. Names may have any content.
[[nodiscard]] std::string to_text(const TokenEntry& entry);

// The problem with a text as a file of entries; empty: none. `name` is used in the message.
[[nodiscard]] std::string token_entries_problem(const std::string& text, const std::string& name);

// Replaces the file (or the target of a link) by a new one with the same permissions, so that
// nobody reads a half-written file. A missing file is created for its owner alone. Returns the
// problem; empty: none.
[[nodiscard]] std::string write_secret_file(const std::string& file, const std::string& text);

// The text to print for a secret, which `name` names. On a terminal this is the secret. Other
// output may be a journal or the log of a container, which others may read: there the secret goes
// to `file`, for its owner alone, and the text names that file. A link there is replaced, not
// followed. `problem` is set if it cannot be written. Blocks as the disk does.
[[nodiscard]] std::string secret_to_print(const std::string& text, const std::string& name,
                                          bool terminal, const std::string& file,
                                          std::string& problem);

// The longest wait of a writer for the others.
inline constexpr std::chrono::seconds kLockPatience{5};
inline constexpr std::chrono::seconds kLockSoon{1};  // for a thread that serves everybody

// Adds an entry at the end, as write_secret_file() does. Writers wait for each other; then the
// problem names the process that holds the folder's lock. A line on stderr names it after 1 s.
// Returns the problem, and the file is unchanged; empty: none.
[[nodiscard]] std::string append_token_entry(const std::string& file, const TokenEntry& entry,
                                             std::chrono::seconds patience = kLockPatience);

// Replaces all entries of the identity by this one, in one step and with the same care. One of them
// must be the token `former`, so that only one of several owners of that token succeeds. Waits
// kLockSoon for other writers. Returns the problem; empty: none.
[[nodiscard]] std::string replace_token_entries(const std::string& file, const TokenEntry& entry,
                                                const Digest& former);

// Removes all entries of an identity, with the same care; comments stay. `removed` gets their
// number. Entries must stand on lines of their own. Returns the problem, and the file is unchanged;
// empty: none.
[[nodiscard]] std::string remove_token_entries(const std::string& file, const std::string& identity,
                                               std::size_t& removed);

}  // namespace connect_bridge
