#include "auth/pairing_login.hpp"

#include <openssl/crypto.h>

#include <algorithm>
#include <utility>

#include "auth/token_file.hpp"
#include "core/base/hex.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kClientNameMax = 64;
constexpr char kIdentityPrefix[] = "paired/";

bool is_name_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
         c == '_' || c == '.';
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

PairingLogin::PairingLogin(PairingOptions options, std::string token_file,
                           std::unique_ptr<TokenLogin> tokens)
    : token_file_(std::move(token_file)),
      tokens_(std::move(tokens)),
      code_(sha256(view_of(options.code))),
      groups_(std::move(options.groups)),
      until_(options.until) {
  wipe(options.code);
}

Judgement PairingLogin::judge(const Attempt& attempt, Stamp now) {
  return attempt.method == kPairingLogin ? pair(attempt, now) : tokens_->judge(attempt, now);
}

Judgement PairingLogin::pair(const Attempt& attempt, Stamp now) {
  const auto shown = parse_pairing_credential(attempt.credential);
  if (!shown) return {std::nullopt, "not a credential of a pairing"};
  if (!open_ || is_over()) return {std::nullopt, "the pairing has ended"};  // mutant: pairing_end
  // Compares digests, so that a partial match reveals nothing.
  if (CRYPTO_memcmp(code_.data(), shown->code.data(), code_.size()) != 0) {
    if (++tries_ >= kTriesMax)  // mutant: pairing_tries
      end("the pairing has ended after " + std::to_string(kTriesMax) +
          " wrong codes: start with --pair again");
    return {std::nullopt, "wrong code of a pairing"};
  }
  if (!paired_) return add(shown->token, shown->name, attempt, now);  // mutant: pairing_once
  if (*paired_ != shown->token) return {std::nullopt, "the code of the pairing is used up"};
  return tokens_->find(*paired_, now);
}

// The file decides: the client's identity is what the file says afterwards.
Judgement PairingLogin::add(const Digest& token, const std::string& name, const Attempt& attempt,
                            Stamp now) {
  TokenEntry entry;
  // The client chooses the name: it must not be one that a rule was written for.
  const std::string own = kIdentityPrefix + name;
  entry.identity = own;
  for (int number = 2; tokens_->knows(entry.identity); ++number)
    entry.identity = own + "-" + std::to_string(number);
  entry.groups = groups_;
  entry.comment = "paired " + date_text(now) + " from " + attempt.peer;
  entry.digest = token;
  std::string problem = append_token_entry(token_file_, entry);
  if (!problem.empty()) {
    untold_.problems.push_back("the pairing failed: " + problem);
    return {std::nullopt, "its token cannot be stored: " + problem};
  }
  Refreshed read = tokens_->read_again(now);
  std::move(read.changes.begin(), read.changes.end(), std::back_inserter(untold_.changes));
  std::move(read.problems.begin(), read.problems.end(), std::back_inserter(untold_.problems));
  Judgement found = tokens_->find(token, now);
  if (found.identity) {
    paired_ = token;
    untold_.news.push_back(
        "paired with '" + entry.identity + "' at " + attempt.peer + ": its token is in " +
        token_file_ + "; remove that entry to end its access" +
        (entry.identity == own ? ""
                               : ". The entry '" + own +
                                     "' of an earlier client of that name "
                                     "stays: remove it if that was the same one"));
  }
  return found;
}

// By the steady clock: on a robot without a battery-backed clock the system time may be set during
// the pairing.
bool PairingLogin::is_over() const {
  return std::chrono::steady_clock::now() >= until_;
}

void PairingLogin::end(std::string news) {
  open_ = false;
  untold_.news.push_back(std::move(news));
}

Refreshed PairingLogin::refresh(Stamp now) {
  if (open_ && is_over())
    end(paired_ ? "the pairing has ended"
                : "no client has paired in time and the code has expired: start with --pair again");
  Refreshed refreshed = std::exchange(untold_, {});
  Refreshed more = tokens_->refresh(now);
  std::move(more.changes.begin(), more.changes.end(), std::back_inserter(refreshed.changes));
  std::move(more.news.begin(), more.news.end(), std::back_inserter(refreshed.news));
  std::move(more.warnings.begin(), more.warnings.end(), std::back_inserter(refreshed.warnings));
  std::move(more.problems.begin(), more.problems.end(), std::back_inserter(refreshed.problems));
  return refreshed;
}

}  // namespace connect_bridge
