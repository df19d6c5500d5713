#include "run/login_desk.hpp"

#include <openssl/crypto.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "net/tcp/system_now.hpp"

namespace connect_bridge {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kProblemsTold = 5;

std::string joined(const std::vector<std::string>& problems) {
  std::string text;
  for (std::size_t i = 0; i < std::min(problems.size(), kProblemsTold); ++i)
    text += (i == 0 ? "" : "; ") + problems[i];
  if (problems.size() > kProblemsTold)
    text += "; and " + std::to_string(problems.size() - kProblemsTold) + " more";
  return text;
}

}  // namespace

LoginDesk::LoginDesk(Options options, Ports ports)
    : options_(std::move(options)), ports_(std::move(ports)) {
  if (!options_.authenticator && !options_.credential_file) return;
  // The first thread also does the periodic refresh: with one thread, no other thread uses the
  // login method.
  threads_.emplace_back([this] { work(true); });
  const unsigned threads = options_.authenticator ? options_.authenticator->threads() : 1;
  for (unsigned i = 1; i < threads; ++i) threads_.emplace_back([this] { work(false); });
}

LoginDesk::~LoginDesk() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    renewals_.clear();
    strangers_.clear();
  }
  changed_.notify_all();
  for (auto& thread : threads_) thread.join();
}

void LoginDesk::ask(Authenticate request) {
  if (!options_.authenticator) return refuse(request.connection, "there is no login method");
  std::optional<Waiting> left_out;
  {
    const std::lock_guard lock(mutex_);
    auto& waiting = request.renewal ? renewals_ : strangers_;
    const std::string turn = request.turn;
    left_out = waiting.add(turn, {std::move(request), Clock::now()});
  }
  changed_.notify_one();
  if (left_out) refuse(left_out->request.connection, "too many logins wait for an answer");
}

void LoginDesk::cancel(ConnectionId connection) {
  const auto is_of_it = [&](const Waiting& waiting) {
    return waiting.request.connection == connection;
  };
  const std::lock_guard lock(mutex_);
  renewals_.erase_if(is_of_it);
  strangers_.erase_if(is_of_it);
}

void LoginDesk::refuse(ConnectionId connection, const std::string& why) {
  ports_.input(Authenticated{connection, std::nullopt, why, false});
}

std::optional<LoginDesk::Waiting> LoginDesk::take_next() {
  const bool renewal =
      !renewals_.empty() && (strangers_.empty() || renewals_in_a_row_ < kRenewalsInARow);
  renewals_in_a_row_ = renewal ? std::min(renewals_in_a_row_ + 1, kRenewalsInARow) : 0;
  return renewal ? renewals_.take() : strangers_.take();
}

void LoginDesk::work(bool refreshes) {
  auto due = Clock::now() + options_.refresh_period;
  const auto wanted = [this] { return ending_ || anybody_waits(); };
  for (;;) {
    std::unique_lock lock(mutex_);
    if (refreshes) {
      changed_.wait_until(lock, due, wanted);
    } else {
      changed_.wait(lock, wanted);
    }
    if (ending_) return;
    auto next = take_next();
    lock.unlock();
    if (next) judge(std::move(*next));
    if (!refreshes || Clock::now() < due) continue;
    due = Clock::now() + options_.refresh_period;
    refresh();
  }
}

void LoginDesk::refresh() {
  if (options_.authenticator) {
    Refreshed refreshed = options_.authenticator->refresh(system_now());
    const bool lacks_means = refreshed.lacks_means || others_lack_means_;
    tell(std::move(refreshed));
    if (auto line = unread_files_.count(lacks_means)) ports_.log(std::move(*line));
  }
  if (!options_.credential_file) return;
  if (auto credential = options_.credential_file->changed()) tell(std::move(*credential));
}

void LoginDesk::judge(Waiting next) {
  Authenticate& request = next.request;
  if (unread_files_.refuses_new() && !request.renewal)
    return refuse(request.connection, UnreadFiles::kReason);
  Authenticated answer{request.connection, std::nullopt, "the login method was too slow", false};
  // The connection is already closed after the time limit: later logins must not wait for this
  // answer.
  if (Clock::now() - next.since < options_.time_limit) {
    Attempt attempt{std::move(request.method), std::move(request.credential),
                    std::move(request.peer)};
    try {
      Judgement judged = options_.authenticator->judge(attempt, system_now());
      answer.identity = std::move(judged.identity);
      answer.reason = std::move(judged.reason);
      answer.judged = judged.judged;
    } catch (const std::exception& error) {  // no memory
      answer.reason = error.what();
    }
    OPENSSL_cleanse(attempt.credential.data(), attempt.credential.size());
  }
  ports_.input(std::move(answer));
}

std::vector<std::string> LoginDesk::refused_files() {
  const std::lock_guard lock(mutex_);
  return refused_.empty() ? std::vector<std::string>() : std::vector<std::string>{refused_};
}

void LoginDesk::keep_refused(std::string problem) {
  const std::lock_guard lock(mutex_);
  refused_ = std::move(problem);
}

void LoginDesk::tell(Refreshed&& refreshed) {
  // While a file stays as it is, there is nothing to tell of it.
  if (!refreshed.problems.empty() || !refreshed.news.empty())
    keep_refused(joined(refreshed.problems));
  for (auto& line : refreshed.news) ports_.log({LogLevel::kInfo, std::move(line)});
  for (auto& line : refreshed.warnings) ports_.log({LogLevel::kWarn, std::move(line)});
  if (!refreshed.problems.empty())
    ports_.log({LogLevel::kError, "the update is refused, the former state stays in use: " +
                                      joined(refreshed.problems)});
  if (!refreshed.changes.empty()) ports_.input(IdentitiesChanged{std::move(refreshed.changes)});
}

void LoginDesk::tell(Credential&& credential) {
  if (!credential.problems.empty()) {
    ports_.log({LogLevel::kError, "the new credential is refused, the former one stays in use: " +
                                      joined(credential.problems)});
    return keep_refused(joined(credential.problems));
  }
  keep_refused({});
  for (auto& line : credential.warnings) ports_.log({LogLevel::kWarn, std::move(line)});
  ports_.log({LogLevel::kInfo, "the credential was read again from " + credential.source});
  ports_.input(CredentialChanged{std::move(credential.bytes)});
}

}  // namespace connect_bridge
