#include "apps/ctl_token.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>

#include "auth/names.hpp"
#include "auth/secret.hpp"
#include "auth/token_table.hpp"
#include "core/base/hex.hpp"

namespace {

using connect_bridge::ByteView;
using connect_bridge::Stamp;

constexpr int kSecondsOfADay = 86'400;

int refuse(const std::string& text) {
  std::fprintf(stderr, "%s\n", text.c_str());
  return 2;
}

// As a YAML string, whatever is in it.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

std::string date_after(int days) {
  const std::time_t then = std::time(nullptr) + std::time_t{days} * kSecondsOfADay;
  std::tm parts{};
  std::array<char, 32> text{};
  ::gmtime_r(&then, &parts);
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &parts)};
}

std::string entry_of(const TokenRequest& request, const std::string& token) {
  const auto digest =
      connect_bridge::sha256({reinterpret_cast<const std::uint8_t*>(token.data()), token.size()});
  std::string text = "- identity: " + quoted(request.identity) + "\n";
  std::string groups;
  for (const auto& group : request.groups) groups += (groups.empty() ? "" : ", ") + quoted(group);
  if (!groups.empty()) text += "  groups: [" + groups + "]\n";
  const std::string expires = request.days > 0 ? date_after(request.days) : request.expires;
  if (!expires.empty()) text += "  expires: " + expires + "\n";
  if (!request.comment.empty()) text += "  comment: " + quoted(request.comment) + "\n";
  return text + "  token_sha256: " + connect_bridge::to_hex(digest) + "\n";
}

// What a file of tokens says; empty when it is right.
std::string problems_of(const std::string& text, const std::string& name) {
  connect_bridge::TokenTable table;
  std::vector<std::string> problems, warnings;
  table.read(text, name, Stamp{0}, problems, warnings);
  if (problems.empty() && table.has_plain())
    problems.push_back(name + ": holds one token, not a list of entries");
  std::string joined;
  for (const auto& problem : problems) joined += (joined.empty() ? "" : "\n") + problem;
  return joined;
}

// The file as it will be: a new one beside it takes its place, so that a server never reads half.
std::string replace(const std::string& file, const std::string& text) {
  struct stat status {};
  const mode_t mode = ::stat(file.c_str(), &status) == 0 ? status.st_mode & 0777 : 0600;
  const std::string part = file + ".part";
  const auto problem = [&] { return part + ": " + std::strerror(errno); };
  ::unlink(part.c_str());
  const int out = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (out < 0) return problem();
  const bool written = ::write(out, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  const bool whole = written && ::fchmod(out, mode) == 0 && ::fsync(out) == 0;
  const std::string wrong = whole ? "" : problem();
  ::close(out);
  if (!wrong.empty()) return wrong;
  return ::rename(part.c_str(), file.c_str()) == 0 ? "" : problem();
}

std::string append(const std::string& file, const std::string& entry) {
  std::string text, problem;
  if (::access(file.c_str(), F_OK) == 0) {
    auto before = connect_bridge::read_secret_file(file, problem);
    if (!before) return problem;
    text = *before;
  }
  if (!text.empty() && text.back() != '\n') text += '\n';
  text += entry;
  problem = problems_of(text, file);
  return problem.empty() ? replace(file, text) : problem;
}

}  // namespace

int make_token(const TokenRequest& request) {
  std::vector<std::string> names = request.groups;
  names.push_back(request.identity);
  if (!request.comment.empty()) names.push_back(request.comment);
  for (const auto& name : names) {
    const auto wrong = connect_bridge::name_problem(name);
    if (!wrong.empty()) return refuse("a name, group or comment " + wrong);
  }
  const std::string token = connect_bridge::random_token();
  if (token.empty()) return refuse("no random numbers are to be had");
  const std::string entry = entry_of(request, token);
  if (const auto wrong = problems_of(entry, "entry"); !wrong.empty()) return refuse(wrong);
  if (request.file.empty()) {
    std::fprintf(stderr, "The entry for the server's token file:\n%s", entry.c_str());
  } else {
    const auto wrong = append(request.file, entry);
    if (!wrong.empty()) return refuse(wrong);
    std::fprintf(stderr, "%s: one more entry, of %s. The token is shown this once:\n",
                 request.file.c_str(), request.identity.c_str());
  }
  std::printf("%s\n", token.c_str());
  return 0;
}
