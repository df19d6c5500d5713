#include "run/login_desk.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <future>
#include <map>

#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

// Answers by the credential: "slow" waits for release(), "unknown" is nobody, of "down" it cannot
// say, "memory" is too much for it, others are who they say.
class Doorman : public Authenticator {
 public:
  explicit Doorman(unsigned threads) : threads_(threads) {}
  Judgement judge(const Attempt& attempt, Stamp) override {
    const std::string who(attempt.credential.begin(), attempt.credential.end());
    {
      const std::lock_guard lock(mutex_);
      who_.push_back(who);
    }
    ++judged;
    if (who == "slow") released_.wait();
    if (who == "memory") throw std::bad_alloc();
    if (who == "unknown" || who == "down") return {std::nullopt, who, who == "unknown"};
    return {Identity{who, {}}, {}};
  }
  Refreshed refresh(Stamp) override {
    ++refreshes;
    if (lacks_means) return {{}, {}, {}, {}, true};
    if (is_wrong) return {{}, {}, {}, {"line 3"}, false};
    const bool first = !std::exchange(refreshed_, true);
    if (!first) return {};
    return {{{"token:1", std::nullopt}}, {"news"}, {"a warning"}, {}, false};
  }
  [[nodiscard]] unsigned threads() const override { return threads_; }
  void release() {
    if (!std::exchange(is_released_, true)) release_.set_value();
  }
  // The logins that it was asked about.
  std::vector<std::string> who() {
    const std::lock_guard lock(mutex_);
    return who_;
  }
  std::atomic<int> judged = 0;
  std::atomic<int> refreshes = 0;
  std::atomic<bool> lacks_means = false, is_wrong = false;

 private:
  std::mutex mutex_;
  std::vector<std::string> who_;
  const unsigned threads_;
  bool refreshed_ = false, is_released_ = false;
  std::promise<void> release_;
  std::shared_future<void> released_ = release_.get_future().share();
};

// Collects what a desk says.
class Ears {
 public:
  LoginDesk::Ports ports() {
    return {[this](Input&& input) {
              const std::lock_guard lock(mutex_);
              inputs_.push_back(std::move(input));
              changed_.notify_all();
            },
            [this](Log&& line) {
              const std::lock_guard lock(mutex_);
              logged_ += (line.level == LogLevel::kWarn ? "warn: " : "") + line.text + "\n";
              changed_.notify_all();
            }};
  }
  // The answer for a connection; empty after 20 s: none.
  std::optional<Authenticated> answer(std::uint64_t connection) {
    std::optional<Authenticated> found;
    wait([&] {
      for (const auto& input : inputs_)
        if (const auto* told = std::get_if<Authenticated>(&input))
          if (told->connection.value == connection) found = *told;
      return found.has_value();
    });
    return found;
  }
  template <class Kind>
  std::optional<Kind> heard() {
    std::optional<Kind> found;
    wait([&] {
      for (const auto& input : inputs_)
        if (const auto* told = std::get_if<Kind>(&input)) found = *told;
      return found.has_value();
    });
    return found;
  }
  bool logged(const std::string& text) {
    return wait([&] { return logged_.find(text) != std::string::npos; });
  }

 private:
  template <class Condition>
  bool wait(Condition condition) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, 20s, condition);
  }
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Input> inputs_;
  std::string logged_;
};

Authenticate login(std::uint64_t connection, const std::string& who) {
  return {{connection}, "1.1.1.1:1", "token", {who.begin(), who.end()}};
}

std::string name_of(const std::optional<Authenticated>& answer) {
  return answer && answer->identity ? answer->identity->name : "nobody";
}

TEST(LoginDesk, ASlowLoginDelaysNoOther) {
  Doorman doorman(2);
  Ears ears;
  LoginDesk desk({&doorman, std::nullopt, 60s}, ears.ports());
  desk.ask(login(1, "slow"));
  desk.ask(login(2, "anna"));
  desk.ask(login(3, "bert"));
  EXPECT_EQ(name_of(ears.answer(2)), "anna");
  EXPECT_EQ(name_of(ears.answer(3)), "bert");
  doorman.release();
  EXPECT_EQ(name_of(ears.answer(1)), "slow");
}

TEST(LoginDesk, WhoWaitedTooLongIsNotLookedAt) {
  Doorman doorman(1);
  Ears ears;
  LoginDesk desk({&doorman, std::nullopt, 50ms}, ears.ports());
  desk.ask(login(1, "slow"));
  while (doorman.judged == 0) std::this_thread::yield();
  desk.ask(login(2, "anna"));
  std::promise<void>().get_future().wait_for(100ms);
  doorman.release();
  EXPECT_EQ(ears.answer(2).value().reason, "the login method was too slow");
  EXPECT_EQ(doorman.judged, 1);
}

// One desk with one thread, which a slow login holds until the others wait.
struct Rush {
  Rush() {
    desk.ask(login(1, "slow"));
    while (doorman.judged == 0) std::this_thread::yield();
  }
  ~Rush() { doorman.release(); }
  // Asks, as the customer or identity that takes turns with itself.
  void ask(const std::string& who, const std::string& turn, bool renewal = false) {
    Authenticate request = login(++last, who);
    request.turn = turn;
    request.renewal = renewal;
    desk.ask(std::move(request));
  }
  // The logins that are judged, in that order, once the slow one is done.
  std::string order() {
    doorman.release();
    for (std::uint64_t i = 1; i <= last; ++i) ears.answer(i);
    std::string text;
    for (const auto& who : doorman.who()) text += (text.empty() ? "" : " ") + who;
    return text;
  }

  std::uint64_t last = 1;
  Doorman doorman{1};
  Ears ears;
  LoginDesk desk{{&doorman, std::nullopt, 60s}, ears.ports()};
};

// Wrong logins come faster than the method can judge them.
TEST(LoginDesk, WhoAsksWithoutEndKeepsNobodyOut) {
  Rush rush;
  for (int i = 0; i < 100; ++i) rush.ask("wrong", "10.0.0.1");
  rush.ask("anna", "10.0.0.8");
  rush.ask("carl", "carl", true);
  EXPECT_EQ(rush.order().substr(0, 27), "slow carl wrong anna wrong ");
}

TEST(LoginDesk, WhoRenewsWithoutEndKeepsNobodyOutEither) {
  Rush rush;
  for (int i = 0; i < 5; ++i) rush.ask("much", "much", true);
  rush.ask("carl", "carl", true);
  for (int i = 0; i < 3; ++i) rush.ask("anna", "10.0.0.8");
  EXPECT_EQ(rush.order(), "slow much carl much anna much much much anna anna");
}

TEST(LoginDesk, WhoIsGoneIsNotJudged) {
  Rush rush;
  rush.ask("gone", "10.0.0.9");
  rush.desk.cancel({rush.last});
  rush.ask("gone", "carl", true);
  rush.desk.cancel({rush.last});
  rush.ask("anna", "10.0.0.8");
  rush.doorman.release();
  EXPECT_EQ(name_of(rush.ears.answer(rush.last)), "anna");
  EXPECT_EQ(rush.doorman.judged, 2);
}

// A withdrawal may stand in the file. It is not known of whom, so that open links stay.
TEST(LoginDesk, WhereAFileThatDecidesCannotBeReadForLongStrangersAreRefused) {
  Doorman doorman(1);
  Ears ears;
  doorman.lacks_means = true;
  LoginDesk desk({&doorman, std::nullopt, 60s, 128, 1ms}, ears.ports());
  ASSERT_TRUE(ears.logged("new logins are refused until it is read"));
  EXPECT_GE(doorman.refreshes, UnreadFiles::kCountMax);
  desk.ask(login(1, "anna"));
  const auto refused = ears.answer(1).value();
  EXPECT_FALSE(refused.identity);
  EXPECT_FALSE(refused.judged);
  EXPECT_NE(refused.reason.find("cannot be read"), std::string::npos) << refused.reason;
  Authenticate renewal = login(2, "bert");
  renewal.renewal = true;
  desk.ask(std::move(renewal));
  EXPECT_EQ(name_of(ears.answer(2)), "bert");
  doorman.lacks_means = false;
  ASSERT_TRUE(ears.logged("new logins are judged"));
  desk.ask(login(3, "anna"));
  EXPECT_EQ(name_of(ears.answer(3)), "anna");
}

TEST(LoginDesk, ARefusedFileIsKnownUntilItIsRead) {
  Doorman doorman(1);
  Ears ears;
  doorman.is_wrong = true;
  LoginDesk desk({&doorman, std::nullopt, 60s, 128, 1ms}, ears.ports());
  ASSERT_TRUE(ears.logged("the update is refused, the former state stays in use: line 3"));
  EXPECT_EQ(desk.refused_files(), std::vector<std::string>{"line 3"});
  doorman.is_wrong = false;
  ASSERT_TRUE(ears.logged("news"));
  EXPECT_EQ(desk.refused_files(), std::vector<std::string>());
}

TEST(LoginDesk, ParameterFilesDecide) {
  Doorman doorman(1);
  Ears ears;
  LoginDesk desk({&doorman, std::nullopt, 60s, 128, 1ms}, ears.ports());
  desk.set_lacks_means(true);
  ASSERT_TRUE(ears.logged("new logins are refused until it is read"));
}

TEST(LoginDesk, AFileThatCannotBeReadForShortRefusesNobody) {
  Doorman doorman(1);
  Ears ears;
  LoginDesk desk({&doorman, std::nullopt, 60s, 128, 60s}, ears.ports());
  desk.set_lacks_means(true);
  desk.ask(login(1, "anna"));
  EXPECT_EQ(name_of(ears.answer(1)), "anna");
}

const std::size_t kOfOneMax = LoginDesk::Options().of_one_max;

TEST(LoginDesk, HowManyOfOneCustomerMayWaitIsSet) {
  Doorman doorman(1);
  Ears ears;
  LoginDesk desk({&doorman, std::nullopt, 60s, 2}, ears.ports());
  desk.ask(login(1, "slow"));
  while (doorman.judged == 0) std::this_thread::sleep_for(1ms);
  for (std::uint64_t i = 2; i <= 4; ++i) {
    Authenticate request = login(i, "bert");
    request.turn = "10.0.0.9";
    desk.ask(std::move(request));
  }
  EXPECT_EQ(ears.answer(4).value().reason, "too many logins wait for an answer");
  doorman.release();
  EXPECT_EQ(name_of(ears.answer(3)), "bert");
}

TEST(LoginDesk, OfOneCustomerNoMoreWaitThanMay) {
  Rush rush;
  for (std::size_t i = 0; i < kOfOneMax; ++i) rush.ask("bert", "10.0.0.9");
  rush.ask("late", "10.0.0.9");
  const auto answer = rush.ears.answer(rush.last).value();
  EXPECT_EQ(answer.reason, "too many logins wait for an answer");
  EXPECT_FALSE(answer.judged);
  rush.doorman.release();
}

TEST(LoginDesk, WhenAllPlacesAreTakenTheNewestOfWhoHasMostGivesWay) {
  Rush rush;
  const std::size_t kCustomers = LoginDesk::kWaitingMax / kOfOneMax;
  for (std::size_t i = 0; i < LoginDesk::kWaitingMax; ++i)
    rush.ask("bert", std::to_string(i % kCustomers));
  const std::uint64_t newest_of_first = rush.last - kCustomers + 1;
  rush.ask("anna", "10.0.0.8");
  EXPECT_EQ(rush.ears.answer(newest_of_first).value().reason, "too many logins wait for an answer");
  rush.doorman.release();
  EXPECT_EQ(name_of(rush.ears.answer(rush.last)), "anna");
}

TEST(LoginDesk, WhatTheMethodCouldNotJudgeIsToldSo) {
  Doorman doorman(1);
  Ears ears;
  LoginDesk desk({&doorman, std::nullopt, 60s}, ears.ports());
  desk.ask(login(1, "unknown"));
  desk.ask(login(2, "down"));
  desk.ask(login(3, "memory"));
  EXPECT_TRUE(ears.answer(1).value().judged);
  EXPECT_FALSE(ears.answer(2).value().judged);
  EXPECT_FALSE(ears.answer(3).value().judged);
}

TEST(LoginDesk, TellsWhatTheMethodHasLearned) {
  Doorman doorman(1);
  Ears ears;
  LoginDesk desk({&doorman, std::nullopt, 60s}, ears.ports());
  EXPECT_EQ(ears.heard<IdentitiesChanged>().value().changes.at(0).credential, "token:1");
  EXPECT_TRUE(ears.logged("news\n"));
  EXPECT_TRUE(ears.logged("warn: a warning\n"));
}

TEST(LoginDesk, TellsAClientsNewCredential) {
  const std::string file = test::scratch_folder() + "desk.token";
  std::ofstream{file} << "the-first-of-tokens\n";
  Ears ears;
  LoginDesk desk({nullptr, CredentialFile({"token", "", file}), 60s}, ears.ports());
  desk.ask(login(1, "anna"));
  EXPECT_EQ(ears.answer(1).value().reason, "there is no login method");
  std::ofstream{file} << "the-second-of-tokens\n";
  const Bytes got = ears.heard<CredentialChanged>().value().credential;
  EXPECT_EQ(std::string(got.begin(), got.end()), "the-second-of-tokens");
  std::ofstream{file} << "short\n";
  EXPECT_TRUE(
      ears.logged("the new credential is refused, the former one stays in use: auth.token_file"));
}

}  // namespace
}  // namespace connect_bridge
