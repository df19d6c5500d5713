#include "access/login/secret.hpp"

#include <fcntl.h>
#include <openssl/crypto.h>
#include <openssl/rand.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "access/login/file_trust.hpp"
#include "core/base/hex.hpp"
#include "core/wire/login.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kFileBytesMax = 1 << 20;

// Calls the system itself: a copy would stay in the buffer of a stream.
std::optional<std::string> read_file(const std::string& file, bool may_be_pipe,
                                     std::string& problem) {
  std::string text(kFileBytesMax + 1, '\0');
  const int opened = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | (may_be_pipe ? 0 : O_NONBLOCK));
  struct stat facts {};
  if (opened < 0 || ::fstat(opened, &facts) != 0) {
    problem = "'" + file + "' cannot be read: " + std::strerror(errno);
    if (opened >= 0) ::close(opened);
    return std::nullopt;
  }
  // The read of a folder tells what it is.
  if (!may_be_pipe && !S_ISREG(facts.st_mode) && !S_ISDIR(facts.st_mode)) {
    problem = "'" + file + "' is no regular file";
    ::close(opened);
    return std::nullopt;
  }
  std::size_t size = 0;
  ssize_t got = 1;
  while (got > 0 && size < text.size()) {
    do got = ::read(opened, text.data() + size, text.size() - size);
    while (got < 0 && errno == EINTR);
    if (got < 0) problem = "'" + file + "' cannot be read: " + std::strerror(errno);
    size += static_cast<std::size_t>(std::max<ssize_t>(got, 0));
  }
  ::close(opened);
  if (size > kFileBytesMax) problem = "'" + file + "' is larger than 1 MiB: no token file";
  if (!problem.empty()) {
    wipe(text);
    return std::nullopt;
  }
  text.resize(size);
  return text;
}

}  // namespace

std::string random_token() {
  std::array<unsigned char, 32> random{};
  return RAND_bytes(random.data(), random.size()) == 1 ? to_hex(random) : std::string{};
}

std::optional<Digest> parse_digest(std::string_view hex) {
  std::string lower(hex);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](char c) {
    return c >= 'A' && c <= 'F' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  Digest digest{};
  if (!from_hex(lower, digest)) return std::nullopt;
  return digest;
}

std::string token_problem(std::string_view token) {
  if (token.empty()) return "the token is empty";
  if (token.starts_with("\xff\xfe") || token.starts_with("\xfe\xff"))
    return "the text is UTF-16, as of PowerShell's >: save it as plain text (ASCII; in PowerShell "
           "with Out-File -Encoding ascii)";
  if (token.size() < kTokenCharactersMin) {
    return "the token has " + std::to_string(token.size()) + " characters, at least " +
           std::to_string(kTokenCharactersMin) + " are needed ('openssl rand -hex 24' makes one)" +
           (token.starts_with('$') ? "; a parameter file expands no variables: "
                                     "auth.token_file, or CONNECT_BRIDGE_TOKEN in the environment"
                                   : "");
  }
  if (token.size() > kCredentialBytesMax) {
    return "the token has more than " + std::to_string(kCredentialBytesMax) + " characters";
  }
  const auto printable = [](char c) { return c > ' ' && c < 0x7f; };
  if (!std::all_of(token.begin(), token.end(), printable)) {
    return "the token has a blank or a character that is not printable ASCII";
  }
  return {};
}

std::string_view trim(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const auto begin = text.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

void wipe(std::string& secret) {
  OPENSSL_cleanse(secret.data(), secret.size());
  secret.clear();
}

std::optional<std::string> read_secret_file(const std::string& file, std::string& problem) {
  return read_file(file, true, problem);
}

bool lacks_means_to_open(const std::string& file) {
  const int opened = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (opened < 0) return errno == EMFILE || errno == ENFILE || errno == ENOMEM;
  ::close(opened);
  return false;
}

std::optional<std::string> read_login_file(const std::string& file, bool strict_modes,
                                           Failure& problem) {
  std::string why;
  // Another user may have put a pipe there, which holds up its reader without end.
  auto text = read_file(file, !strict_modes, why);
  if (!text) problem = {Cause::kFileUnreadable, std::move(why)};
  if (!text || !strict_modes) return text;
  // Afterwards: whoever may change it now could have done so before.
  why = who_else_may_have_changed(file);
  if (why.empty()) return text;
  problem = {Cause::kFileDistrusted, std::move(why)};
  wipe(*text);
  return std::nullopt;
}

std::string who_else_may_read(const std::string& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0 || (status.st_mode & S_IROTH) == 0) return {};
  return "'" + file + "' holds a secret and every user of this machine may read it (chmod go-r)";
}

}  // namespace connect_bridge
