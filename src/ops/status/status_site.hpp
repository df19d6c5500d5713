// The status for people and machines that ask by HTTP (docs/status.md).
#pragma once

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "access/login/authenticator.hpp"
#include "net/http/status_door.hpp"
#include "ops/status/metrics.hpp"
#include "ops/status/status_json.hpp"

namespace connect_bridge {

// Answers on a thread of its own, of less priority than the loop, from the last picture that it was
// given: the loop waits for nobody who asks.
class StatusSite {
 public:
  struct Options {
    std::string node;
    StatusOptions at;
    TlsOptions tls;     // beyond loopback
    LoginOptions auth;  // there too: whose tokens count
  };
  // Called from any thread.
  using Tell = std::function<void(LogLevel, const std::string&)>;

  StatusSite(Options options, Tell tell);
  ~StatusSite();
  StatusSite(const StatusSite&) = delete;
  StatusSite& operator=(const StatusSite&) = delete;

  // Listens, and starts the thread. Returns what is wrong with status.listen, or nothing; without
  // the socket in the runtime folder it does, with a line in the log. Once only.
  [[nodiscard]] std::string open();

  // Whether somebody may ask for the next picture; any thread.
  [[nodiscard]] bool wanted() const;
  // Once a second while it is wanted; any thread.
  void publish(std::shared_ptr<const StatusPicture> picture);

 private:
  using Clock = std::chrono::steady_clock;
  using Answered = StatusDoor::Answered;
  // Nothing while it is not known, as the link is lost.
  struct Point {
    std::optional<double> round_trip_ms;
    std::optional<double> path_queue_ms;
    std::optional<double> rate;
    std::optional<double> sent;  // bytes per second
    std::optional<double> received;
  };
  // The last minutes of a link.
  struct Past {
    std::deque<Point> points;
    Clock::time_point at{};  // of the last point
    std::uint64_t connects = 0;
    std::uint64_t sent = 0;
    std::uint64_t received = 0;

    void add(const LinkStatus& link, Clock::time_point now);
  };
  struct Waiting {
    StatusRequest request;
    Answered answered;
    Clock::time_point since;
  };

  void take(const std::shared_ptr<const StatusPicture>& picture);
  void ask(const StatusRequest& request, Answered answered);
  [[nodiscard]] StatusAnswer answer(const StatusRequest& request);
  // A text of the picture, made once however many ask.
  template <class Make>
  const SharedText& text_of(const char* what, Names names, Make make);
  const SharedText& event(Names names);
  [[nodiscard]] StatusAnswer readiness() const;
  [[nodiscard]] std::string history() const;
  [[nodiscard]] unsigned judge(const std::string& token);
  [[nodiscard]] bool is_fresh() const;
  void every_second();
  std::string open_judge();

  const Options options_;
  const Tell tell_;
  std::atomic<Clock::time_point> asked_{Clock::time_point{}};  // last
  std::atomic<bool> ended_{false};                             // the thread, for want of memory
  boost::asio::io_context io_{1};
  boost::asio::steady_timer seconds_;
  std::unique_ptr<Authenticator> authenticator_;  // null: nobody is judged
  std::shared_ptr<const StatusPicture> picture_;
  Clock::time_point picture_at_{};
  std::map<std::pair<std::string, Names>, SharedText> texts_;  // of the picture
  Metrics metrics_;
  std::map<std::uint64_t, Past> history_;  // by link
  std::vector<Waiting> waiting_;           // for a fresh picture
  std::shared_ptr<StatusDoor> door_;
  std::thread thread_;  // last: it uses what is above
};

}  // namespace connect_bridge
