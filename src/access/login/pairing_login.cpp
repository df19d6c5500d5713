#include "access/login/pairing_login.hpp"

#include <openssl/crypto.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <sstream>
#include <utility>

#include "access/login/token_file.hpp"
#include "core/base/hex.hpp"
#include "core/policy/names.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kClientNameMax = 64;
constexpr char kIdentityPrefix[] = "paired/";

bool is_name_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
         c == '_' || c == '.';
}

// Makes "HASH GROUP GROUP".
std::string invited_line(const Digest& code, const std::vector<std::string>& groups) {
  std::string line = to_hex(code);
  for (const std::string& group : groups) line += " " + group;
  return line;
}

}  // namespace

std::optional<PairingCredential> parse_pairing_credential(ByteView credential) {
  const std::string_view text{reinterpret_cast<const char*>(credential.data()), credential.size()};
  const auto first = text.find(' ');
  const auto second = first == std::string_view::npos ? first : text.find(' ', first + 1);
  if (second == std::string_view::npos) return std::nullopt;
  const auto token = parse_digest(text.substr(first + 1, second - first - 1));
  const std::string_view name = text.substr(second + 1);
  if (!token || name.empty() || name.size() > kClientNameMax ||
      !std::all_of(name.begin(), name.end(), is_name_character))
    return std::nullopt;
  return PairingCredential{sha256(view_of(text.substr(0, first))), *token, std::string{name}};
}

std::string pairing_credential(const std::string& code, const Digest& token,
                               const std::string& name) {
  return code + " " + to_hex(token) + " " + name;
}

std::string pairing_name(const std::string& host) {
  std::string name = host.substr(0, kClientNameMax);
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !is_name_character(c); }, '-');
  return name.empty() ? "client" : name;
}

std::string write_invited(const std::string& file, const std::string& code,
                          const std::vector<std::string>& groups) {
  return write_secret_file(file, invited_line(sha256(view_of(code)), groups) + "\n");
}

PairingLogin::PairingLogin(PairingOptions options, std::string token_file,
                           std::unique_ptr<TokenLogin> tokens)
    : options_(std::move(options)), token_file_(std::move(token_file)), tokens_(std::move(tokens)) {
  ::unlink(options_.file.c_str());
  ::unlink(options_.shown.c_str());
}

void PairingLogin::take_invited() {
  if (::access(options_.file.c_str(), F_OK) != 0) return;
  Failure problem;
  const auto text = read_login_file(options_.file, options_.strict_modes, problem);
  // An invitation that stays would be taken again, with new time.
  if (::unlink(options_.file.c_str()) != 0) {
    const std::string why = std::strerror(errno);
    if (!std::exchange(stays_, true))
      unreported_.problems.push_back("the invitation is not taken, since " + options_.file +
                                     " cannot be removed: " + why);
    return;
  }
  stays_ = false;
  if (!text) return unreported_.problems.push_back(problem.text);
  std::istringstream words(*text);
  std::string word;
  words >> word;
  const auto code = parse_digest(word);
  if (!code) return unreported_.problems.push_back(options_.file + ": not an invitation");
  Invited invited;
  invited.code = *code;
  while (words >> word) invited.groups.push_back(word);
  invited.until = std::chrono::steady_clock::now() + options_.lifetime;
  invited_ = std::move(invited);
}

Judgement PairingLogin::judge(const Attempt& attempt, Stamp now) {
  return attempt.method == kPairingLogin ? pair(attempt, now) : tokens_->judge(attempt, now);
}

Judgement PairingLogin::pair(const Attempt& attempt, Stamp now) {
  const auto shown = parse_pairing_credential(attempt.credential);
  if (!shown) return {std::nullopt, "not a credential of a pairing"};
  take_invited();
  if (!invited_ || is_over()) return {std::nullopt, "no pairing is open"};  // mutant: pairing_end
  const Digest& code = invited_->code;
  // Compares digests, so that a partial match reveals nothing.
  if (CRYPTO_memcmp(code.data(), shown->code.data(), code.size()) != 0)
    return {std::nullopt, "wrong code of a pairing"};
  const auto& paired = invited_->paired;
  if (!paired) return add(shown->token, shown->name, attempt, now);  // mutant: pairing_once
  if (*paired != shown->token) return {std::nullopt, "the code of the pairing is used up"};
  return tokens_->find(*paired, now);
}

// The file decides: the client's identity is the one that the file has afterwards.
Judgement PairingLogin::add(const Digest& token, const std::string& name, const Attempt& attempt,
                            Stamp now) {
  TokenEntry entry;
  // The client chooses the name, so it must not be one that a rule was written for.
  const std::string own = options_.of_robots ? prefix_word_of(name) : kIdentityPrefix + name;
  const auto& taken = options_.taken;
  entry.identity = own;
  for (int number = 2; tokens_->knows(entry.identity) ||
                       std::find(taken.begin(), taken.end(), entry.identity) != taken.end();
       ++number)
    entry.identity = own + (options_.of_robots ? "_" : "-") + std::to_string(number);
  entry.groups = invited_->groups;
  entry.comment = "paired " + date_text(now) + " from " + attempt.peer;
  entry.digest = token;
  // The desk has one thread, and withdrawals wait for it, too.
  std::string problem = append_token_entry(token_file_, entry, kLockSoon);
  if (!problem.empty()) {
    unreported_.problems.push_back("the pairing failed: " + problem);
    return {std::nullopt, "its token cannot be stored: " + problem};
  }
  Refreshed read = tokens_->read_again(now);
  std::move(read.changes.begin(), read.changes.end(), std::back_inserter(unreported_.changes));
  std::move(read.problems.begin(), read.problems.end(), std::back_inserter(unreported_.problems));
  Judgement found = tokens_->find(token, now);
  if (found.identity) {
    invited_->paired = token;
    ::unlink(options_.shown.c_str());
    const auto removed = [this](const std::string& identity) {
      return "ctl token " + identity + " --remove --file '" + token_file_ + "'";
    };
    std::string news = "paired with '" + entry.identity + "' at " + attempt.peer +
                       "; to end its access: " + removed(entry.identity);
    if (entry.identity != own)
      news += ". '" + own +
              "', an earlier client of that name, keeps its access; if it is the same machine: " +
              removed(own);
    unreported_.news.push_back(std::move(news));
  }
  return found;
}

// The steady clock decides: on a robot without a battery-backed clock, the system time may be set
// during the pairing.
bool PairingLogin::is_over() const {
  return std::chrono::steady_clock::now() >= invited_->until;
}

void PairingLogin::end(std::string news) {
  invited_.reset();
  ::unlink(options_.shown.c_str());
  unreported_.news.push_back(std::move(news));
}

Refreshed PairingLogin::refresh(Stamp now) {
  take_invited();
  if (invited_ && is_over())
    end(invited_->paired ? "the pairing has ended"
                         : "nobody has paired in time, and the code has expired: a start with "
                           "--pair makes another");
  Refreshed refreshed = std::exchange(unreported_, {});
  Refreshed more = tokens_->refresh(now);
  std::move(more.changes.begin(), more.changes.end(), std::back_inserter(refreshed.changes));
  std::move(more.news.begin(), more.news.end(), std::back_inserter(refreshed.news));
  std::move(more.warnings.begin(), more.warnings.end(), std::back_inserter(refreshed.warnings));
  std::move(more.problems.begin(), more.problems.end(), std::back_inserter(refreshed.problems));
  refreshed.lacks_means = more.lacks_means;
  return refreshed;
}

}  // namespace connect_bridge
