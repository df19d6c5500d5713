// Handling of tokens: reading them, checking their form, wiping them.
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

[[nodiscard]] std::optional<Digest> parse_digest(std::string_view hex);

// Why this text is not an acceptable token; empty: it is one. Never contains the token.
[[nodiscard]] std::string token_problem(std::string_view token);

// Removes blanks and line ends at both ends.
[[nodiscard]] std::string_view trim(std::string_view text);

// Overwrites it in a way that the optimizer does not remove.
void wipe(std::string& secret);

// A small file's content. nullopt: `problem` says why, with the file's name.
[[nodiscard]] std::optional<std::string> read_secret_file(const std::string& file,
                                                          std::string& problem);
// Whether descriptors or memory are lacking now to open the file.
[[nodiscard]] bool lacks_means_to_open(const std::string& file);
// As read_secret_file(), for a file that decides who may log in; `strict_modes` as in LoginOptions.
[[nodiscard]] std::optional<std::string> read_login_file(const std::string& file, bool strict_modes,
                                                         Failure& problem);
// Says that every user of this machine may read a secret, with the cure; empty: not every one may.
[[nodiscard]] std::string who_else_may_read(const std::string& file);

}  // namespace connect_bridge
