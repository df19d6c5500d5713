// Reads tokens, checks their form, and wipes them.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/base/sha256.hpp"
#include "core/ports/failure.hpp"

namespace connect_bridge {

inline constexpr std::size_t kTokenCharactersMin = 16;

// 32 random bytes as 64 hexadecimal digits; empty: the system has none.
[[nodiscard]] std::string random_token();

// A SHA-256 from 64 hexadecimal digits of either case; nullopt: the text is something else.
[[nodiscard]] std::optional<Digest> parse_digest(std::string_view hex);

// The reason why this text is not an acceptable token; empty: it is one. Never contains the token.
[[nodiscard]] std::string token_problem(std::string_view token);

// The text without blanks and line ends at both ends.
[[nodiscard]] std::string_view trim(std::string_view text);

// Overwrites the secret in a way that the optimizer does not remove.
void wipe(std::string& secret);

// The content of a file of at most 1 MiB. nullopt: `problem` has the reason, with the file's name.
[[nodiscard]] std::optional<std::string> read_secret_file(const std::string& file,
                                                          std::string& problem);
// Whether the file cannot be opened because descriptors or memory are lacking now.
[[nodiscard]] bool lacks_means_to_open(const std::string& file);
// Reads a file that decides who may log in, with the errors of read_secret_file(). With
// `strict_modes` (LoginOptions) it fails, too, if another user may change the file, or if it is no
// regular file.
[[nodiscard]] std::optional<std::string> read_login_file(const std::string& file, bool strict_modes,
                                                         Failure& problem);
// Says that every user of this machine may read a secret, with the cure; empty: not every one may.
[[nodiscard]] std::string who_else_may_read(const std::string& file);

}  // namespace connect_bridge
