#include "access/plugins/key_source.hpp"

#include <algorithm>
#include <utility>

#include "access/login/secret.hpp"

namespace connect_bridge {
namespace {

std::vector<JwtKey> read_key_file(const std::string& file, bool strict_modes,
                                  std::vector<std::string>& problems) {
  Failure problem;
  auto text = read_login_file(file, strict_modes, problem);
  if (!text) {
    problems.push_back("auth.jwt_keys " + problem.text);
    return {};
  }
  auto keys = read_jwt_keys(*text, file, problems);
  wipe(*text);
  const bool secret = std::any_of(keys.begin(), keys.end(),
                                  [](const JwtKey& key) { return key.algorithm() == "HS256"; });
  if (const std::string readers = who_else_may_read(file); secret && !readers.empty())
    problems.push_back("auth.jwt_keys " + readers);  // mutant: jwt_keys_open
  return keys;
}

}  // namespace

std::string KeyFile::name() const {
  return "auth.jwt_keys '" + watch_.file() + "'";
}

std::optional<std::vector<JwtKey>> KeyFile::changed(std::vector<std::string>& problems) {
  if (!std::exchange(first_, false) && !watch_.settled_change()) return std::nullopt;
  std::vector<std::string> found;
  auto keys = read_key_file(watch_.file(), strict_modes_, found);
  if (found.empty()) return keys;
  if (watch_.failed(found.front())) problems.insert(problems.end(), found.begin(), found.end());
  return std::nullopt;
}

KeyAddress::KeyAddress(Url address, HttpFetch fetch, std::chrono::milliseconds period_min)
    : address_(std::move(address)),
      fetch_(std::move(fetch)),
      period_min_(period_min),
      thread_([this] { ask_for_ever(); }) {
  std::unique_lock lock(mutex_);
  wake_.wait(lock, [this] { return answered_; });
}

KeyAddress::~KeyAddress() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

std::string KeyAddress::name() const {
  return "auth.jwt_keys " + address_.text("http");
}

std::optional<std::vector<JwtKey>> KeyAddress::changed(std::vector<std::string>& problems) {
  const std::lock_guard lock(mutex_);
  std::move(problems_.begin(), problems_.end(), std::back_inserter(problems));
  problems_.clear();
  return std::exchange(keys_, std::nullopt);
}

void KeyAddress::wanted() {
  {
    const std::lock_guard lock(mutex_);
    wanted_ = true;
  }
  wake_.notify_all();
}

void KeyAddress::ask_for_ever() {
  HttpRequest request;
  request.url = address_;
  request.answer_bytes_max = kBytesMax;
  for (;;) {
    const HttpAnswer answer = fetch_(request);
    const auto asked_at = Clock::now();
    std::unique_lock lock(mutex_);
    take(answer);
    answered_ = true;
    wanted_ = false;
    wake_.notify_all();
    const auto next = asked_at + wait_;
    const auto soonest = asked_at + std::min<Clock::duration>(wait_, period_min_);
    wake_.wait_until(lock, soonest, [this] { return ending_; });
    wake_.wait_until(lock, next, [this] { return ending_ || wanted_; });
    if (ending_) return;
  }
}

// The caller holds the mutex.
void KeyAddress::take(const HttpAnswer& answer) {
  constexpr int kOk = 200;
  std::vector<std::string> problems;
  std::vector<JwtKey> keys;
  if (!answer.problem.empty()) {
    problems.push_back(name() + ": " + answer.problem);
  } else if (answer.status != kOk) {
    problems.push_back(name() + " answers " + std::to_string(answer.status));
  } else if (answer.body.empty() || answer.body != text_) {
    keys = read_jwt_keys(answer.body, name(), problems);
    const bool secret = std::any_of(keys.begin(), keys.end(),
                                    [](const JwtKey& key) { return key.algorithm() == "HS256"; });
    if (secret) problems.push_back(name() + " gives a secret key (HS256) to everybody");
  }
  if (!problems.empty()) {
    text_.clear();  // the next answer is news, and ends the report
    wait_ = retry_;
    retry_ = std::min(2 * retry_, kPeriodUsual);
    if (problems.front() != std::exchange(reported_, problems.front()))
      problems_ = std::move(problems);
    return;
  }
  retry_ = kRetryMin;
  reported_.clear();
  wait_ = std::clamp(answer.max_age.value_or(kPeriodUsual), kPeriodMin, kPeriodMax);
  if (keys.empty()) return;  // the same text
  text_ = answer.body;
  keys_ = std::move(keys);
}

}  // namespace connect_bridge
