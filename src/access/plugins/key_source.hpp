// Sources of the keys of JSON Web Tokens: a file, or an address that is requested from time to
// time.
#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "access/login/file_watch.hpp"
#include "access/plugins/http.hpp"
#include "access/plugins/jwt_keys.hpp"

namespace connect_bridge {

// All calls come from one thread, that of the login method.
class KeySource {
 public:
  virtual ~KeySource() = default;
  // The source's name in sentences: "auth.jwt_keys '/etc/keys.json'".
  [[nodiscard]] virtual std::string name() const = 0;
  // The keys, if they have changed. Adds each problem once. Does not wait for the network.
  [[nodiscard]] virtual std::optional<std::vector<JwtKey>> changed(
      std::vector<std::string>& problems) = 0;
  // A token names an unknown key, which may be a new one: the keys are requested soon.
  virtual void wanted() {}
};

class KeyFile : public KeySource {
 public:
  // The file's present content counts as new.
  explicit KeyFile(std::string file, bool strict_modes = true)
      : watch_(std::move(file)), strict_modes_(strict_modes) {}
  [[nodiscard]] std::string name() const override;
  [[nodiscard]] std::optional<std::vector<JwtKey>> changed(
      std::vector<std::string>& problems) override;

 private:
  FileWatch watch_;
  const bool strict_modes_;
  bool first_ = true;
};

// Requests the keys as often as the answer's Cache-Control says, within kPeriodMin and kPeriodMax.
// After a failure it retries soon, then less and less often. Known keys stay valid while there is
// no answer.
class KeyAddress : public KeySource {
 public:
  static constexpr std::chrono::seconds kPeriodMin{60};  // also for requests of wanted()
  static constexpr std::chrono::seconds kPeriodUsual{600};
  static constexpr std::chrono::seconds kPeriodMax{86400};
  static constexpr std::chrono::seconds kRetryMin{5};
  static constexpr std::size_t kBytesMax = 1 << 20;

  // The constructor waits for the first answer, up to the time limit of one request: then most
  // servers know the keys at their first login. `period_min`: for tests.
  KeyAddress(Url address, HttpFetch fetch, std::chrono::milliseconds period_min = kPeriodMin);
  ~KeyAddress() override;
  [[nodiscard]] std::string name() const override;
  [[nodiscard]] std::optional<std::vector<JwtKey>> changed(
      std::vector<std::string>& problems) override;
  void wanted() override;

 private:
  using Clock = std::chrono::steady_clock;
  void ask_for_ever();
  void take(const HttpAnswer& answer);

  const Url address_;
  const HttpFetch fetch_;
  const std::chrono::milliseconds period_min_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool ending_ = false;
  bool wanted_ = false;
  bool answered_ = false;                    // the first request has succeeded or failed
  std::optional<std::vector<JwtKey>> keys_;  // not yet reported
  std::vector<std::string> problems_;        // not yet reported
  std::string text_;                         // of the last answer
  std::string reported_;                     // the last problem reported
  std::chrono::seconds wait_{0};             // until the next request
  std::chrono::seconds retry_ = kRetryMin;
  std::thread thread_;
};

}  // namespace connect_bridge
