#include "access/login/token_login.hpp"

#include <new>
#include <utility>

#include "access/login/secret.hpp"
#include "core/base/hex.hpp"

namespace connect_bridge {

TokenTable read_token_file(const std::string& file, bool strict_modes, Stamp now,
                           std::vector<Failure>& problems, std::vector<std::string>& warnings) {
  TokenTable table;
  Failure problem;
  auto text = read_login_file(file, strict_modes, problem);
  if (!text) {
    problems.push_back({problem.cause, "auth.token_file " + problem.text});
    return table;
  }
  std::vector<std::string> wrong;
  table.read(*text, file, now, wrong, warnings);
  for (std::string& line : wrong) problems.push_back({Cause::kTokenMissing, std::move(line)});
  wipe(*text);
  if (const std::string readers = who_else_may_read(file); !readers.empty() && table.has_plain())
    warnings.push_back("auth.token_file " + readers);
  return table;
}

Judgement TokenLogin::judge(const Attempt& attempt, Stamp now) {
  if (attempt.method != "token")
    return {std::nullopt, "login method '" + attempt.method + "' instead of 'token'"};
  Judgement judged = find(sha256(attempt.credential), now);
  // An entry is copied for its token now and then.
  Digest hash{};
  const std::string text(attempt.credential.begin(), attempt.credential.end());
  if (!judged.identity && from_hex(text, hash))
    if (const Judgement owner = table_.find(hash, now); owner.identity)
      judged.reason = "it is the token_sha256 of the entry of " + owner.identity->name +
                      ", not the token. Only `ctl token` prints a token: make another one";
  return judged;
}

Judgement TokenLogin::find(const Digest& token, Stamp now) const {
  const Stamp counted = at_least(now);
  Judgement judged = table_.find(token, counted);
  if (!judged.identity && counted > now && table_.find(token, now).identity)
    judged.reason += ", as its file was written at " + date_text(counted) +
                     ", and this machine's clock is behind that";
  return judged;
}

Refreshed TokenLogin::refresh(Stamp now) {
  if (!file_) return {};
  Refreshed refreshed;
  if (file_->settled_change())
    refreshed = read_again(now);
  else if (lacks_means_ && file_->is_missing())  // nothing reads it before it appears
    lacks_means_ = lacks_means_to_open(file_->file());
  if (auto line = ends_.take_line(table_, "auth.token_file '" + file_->file() + "'", now))
    refreshed.warnings.push_back(std::move(*line));
  refreshed.lacks_means = lacks_means_;
  return refreshed;
}

Refreshed TokenLogin::read_again(Stamp now) {
  Refreshed refreshed;
  if (!file_) return refreshed;
  try {
    refreshed = read(now);
  } catch (const std::bad_alloc&) {
    lacks_means_ = true;
    refreshed.problems = {"auth.token_file '" + file_->file() + "': no memory"};
  }
  if (!refreshed.problems.empty() && !file_->failed(refreshed.problems.front())) return {};
  return refreshed;
}

Refreshed TokenLogin::read(Stamp now) {
  Refreshed refreshed;
  file_->read_now();
  std::vector<Failure> problems;
  TokenTable next =
      read_token_file(file_->file(), strict_modes_, now, problems, refreshed.warnings);
  refreshed.problems = texts_of(problems);
  lacks_means_ = !refreshed.problems.empty() && lacks_means_to_open(file_->file());
  if (!refreshed.problems.empty()) return refreshed;  // mutant: token_file_whole
  refreshed.changes = table_.changes_to(next);
  table_ = std::move(next);
  ends_.tell_again();
  std::size_t withdrawn = 0;
  for (const auto& change : refreshed.changes) withdrawn += change.identity ? 0 : 1;
  refreshed.news.push_back(
      "auth.token_file '" + file_->file() + "' was read again: " + std::to_string(table_.size()) +
      " tokens, " + std::to_string(withdrawn) + " withdrawn, " +
      std::to_string(refreshed.changes.size() - withdrawn) + " with changed rights or expiry");
  return refreshed;
}

}  // namespace connect_bridge
