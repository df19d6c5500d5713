// Writing of token files, for `ctl token` and for pairing.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "access/login/secret.hpp"

namespace connect_bridge {

struct TokenEntry {
  std::string identity;
  std::vector<std::string> groups;
  std::string expires;  // 2027-01-31 or 2027-01-31T12:00:00Z; empty: never
  std::string comment;
  Digest digest{};
};

// The entry as text of the file, with a line end. Names may have any content.
[[nodiscard]] std::string to_text(const TokenEntry& entry);

// What is wrong with a text that is to be a file of entries; empty: nothing. `name` is used in the
// message.
[[nodiscard]] std::string token_entries_problem(const std::string& text, const std::string& name);

// Replaces the file (if it is a link, that to which it leads) by a new one with the same
// permissions, so that nobody ever reads a half-written file; a missing file is created for its
// owner alone. Returns what is wrong, empty if nothing.
[[nodiscard]] std::string write_secret_file(const std::string& file, const std::string& text);

// What is printed of a text with a secret, which `name` names: on a terminal the text; else, since
// others may read that output (a journal, the log of a container), the name of the file that then
// has the text, for its owner alone. `problem` is set if it cannot be written. Blocks as the disk
// does.
[[nodiscard]] std::string secret_to_print(const std::string& text, const std::string& name,
                                          bool terminal, const std::string& file,
                                          std::string& problem);

// Adds an entry at the end, as write_secret_file() does. Writers wait for each other, at most five
// seconds: then the problem names who holds the folder locked, as a line on stderr does after one.
// Returns what is wrong, empty if nothing; then the file is as it was.
[[nodiscard]] std::string append_token_entry(const std::string& file, const TokenEntry& entry);

// This one in place of all entries of its identity, in one step and with the same care; one of them
// must be the token `former`, so that of several who have it one alone succeeds. Waits for other
// writers at most a second: its thread may be everybody's.
[[nodiscard]] std::string replace_token_entries(const std::string& file, const TokenEntry& entry,
                                                const Digest& former);

// Removes all entries of an identity, with the same care; comments stay. `removed`: how many. Only
// entries that stand on lines of their own. Returns what is wrong, empty if nothing; then the file
// is as it was.
[[nodiscard]] std::string remove_token_entries(const std::string& file, const std::string& identity,
                                               std::size_t& removed);

}  // namespace connect_bridge
