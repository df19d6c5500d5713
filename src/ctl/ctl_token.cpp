#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "access/login/file_trust.hpp"
#include "access/login/names.hpp"
#include "access/login/secret.hpp"
#include "access/login/token_file.hpp"
#include "access/login/token_table.hpp"
#include "ctl/ctl_commands.hpp"
#include "net/tcp/system_now.hpp"

namespace {

using namespace connect_bridge;

struct TokenRequest {
  std::string identity;
  std::vector<std::string> groups;
  std::string expires;  // a date in UTC; empty: never, or `days`
  int days = 0;         // from now on; 0: no limit
  std::string comment;
  std::string file;     // the server's token file; empty: the entry is only printed
  bool remove = false;  // the identity's entries are removed from the file instead
};

constexpr Stamp kDay = 86'400'000'000'000;

std::string date_after(int days) {
  return date_text(system_now() + days * kDay);
}

int refuse(const std::string& text) {
  return complain(text, 2);
}

// The server refuses its token file while others may change it. A file of the server's own user
// looks like one of somebody else to root.
void tell_if_distrusted(const std::string& file) {
  struct stat facts {};
  if (::geteuid() == 0 && ::stat(file.c_str(), &facts) == 0 && facts.st_uid != 0) return;
  if (const std::string others = who_else_may_change(file); !others.empty())
    std::fprintf(stderr,
                 "The server refuses the file as it is, unless auth.strict_modes is false: %s\n",
                 others.c_str());
}

TokenEntry entry_of(const TokenRequest& request, const std::string& token) {
  const std::string expires = request.days > 0 ? date_after(request.days) : request.expires;
  return {request.identity, request.groups, expires, request.comment, sha256(view_of(token))};
}

// The token goes to standard output alone, so that it can be redirected into a file. The entry is
// appended to the server's file, or written to standard error.
int make_token(const TokenRequest& request) {
  std::vector<std::string> names = request.groups;
  names.push_back(request.identity);
  if (!request.comment.empty()) names.push_back(request.comment);
  for (const auto& name : names) {
    const auto wrong = name_problem(name);
    if (!wrong.empty()) return refuse("a name, group or comment " + wrong);
  }
  const auto expires =
      request.expires.empty() ? Stamp{0} : parse_date(request.expires).value_or(-1);
  if (expires < 0)
    return refuse("--expires: expected a date in UTC, 2027-01-31 or 2027-01-31T12:00:00Z");
  if (!request.expires.empty() && expires <= system_now())
    return refuse("--expires: this date has passed");
  const std::string token = random_token();
  if (token.empty()) return refuse("no random numbers are available");
  const TokenEntry entry = entry_of(request, token);
  const std::string text = to_text(entry);
  const auto problem = token_entries_problem(text, "entry");
  if (!problem.empty()) return refuse(problem);
  if (request.file.empty()) {
    std::fprintf(stderr, "The entry for the server's token file:\n%s", text.c_str());
  } else {
    const auto wrong = append_token_entry(request.file, entry);
    if (!wrong.empty()) return refuse(wrong);
    std::fprintf(stderr,
                 "%s: one more entry, of %s. Its token goes to standard output, this once.\n",
                 request.file.c_str(), request.identity.c_str());
    tell_if_distrusted(request.file);
  }
  std::printf("%s\n", token.c_str());
  if (std::fflush(stdout) == 0) return 0;
  return refuse("the token could not be written (" + std::string(std::strerror(errno)) +
                "): remove its entry, and make another one");
}

int remove_token(const TokenRequest& request) {
  std::size_t removed = 0;
  const auto wrong = remove_token_entries(request.file, request.identity, removed);
  if (!wrong.empty()) return refuse(wrong);
  std::fprintf(
      stderr, "%s: %zu %s of %s removed; a running server ends its links within two seconds\n",
      request.file.c_str(), removed, removed == 1 ? "entry" : "entries", request.identity.c_str());
  return 0;
}

}  // namespace

void add_token_command(CLI::App& app, int& exit_code) {
  const auto request = std::make_shared<TokenRequest>();
  auto* token = app.add_subcommand("token",
                                   "Make a token for a client and its entry for the server, or "
                                   "remove a client's entries");
  token->footer("Exit code: 0, or 2 if something is wrong; then nothing is changed.");
  token->add_option("identity", request->identity, "Who has the token, as rules call them")
      ->required();
  auto* remove =
      token->add_flag("--remove", request->remove, "Remove its entries from the file, make none");
  token->add_option("--group", request->groups, "A group that rules can ask for; several times")
      ->excludes(remove);
  auto* expires = token
                      ->add_option("--expires", request->expires,
                                   "When it ends: 2027-01-31 or 2027-01-31T12:00:00Z")
                      ->excludes(remove);
  token->add_option("--days", request->days, "When it ends: after so many days")
      ->check(CLI::Range(1, 36500))
      ->excludes(expires)
      ->excludes(remove);
  token->add_option("--comment", request->comment, "For people")->excludes(remove);
  auto* file = token->add_option("--file", request->file,
                                 "The server's token file, which gets the entry; a running server "
                                 "reads it within two seconds");
  remove->needs(file);
  token->callback([request, &exit_code] {
    exit_code = request->remove ? remove_token(*request) : make_token(*request);
  });
}
