#include "run/signals.hpp"

#include <fcntl.h>
#include <sys/time.h>
#include <unistd.h>

#include <csignal>
#include <utility>

namespace connect_bridge {
namespace {

constexpr auto kStopTime = std::chrono::milliseconds(800);
constexpr auto kLastStepsTime = kEndTime - kStopTime;

}  // namespace

void end_within(std::chrono::milliseconds time) {
  itimerval timer{};
  getitimer(ITIMER_REAL, &timer);
  if (timer.it_value.tv_sec != 0 || timer.it_value.tv_usec != 0) return;
  const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
  timer.it_value.tv_sec = seconds.count();
  timer.it_value.tv_usec = std::chrono::microseconds(time - seconds).count();
  setitimer(ITIMER_REAL, &timer, nullptr);
}

Stop::Stop(boost::asio::io_context& io, std::function<void()> begin)
    : io_(io), signals_(io, SIGINT, SIGTERM), deadline_(io), begin_(std::move(begin)) {}

void Stop::wait_for_signal() {
  signals_.async_wait([this](const boost::system::error_code& error, int) {
    if (error) return;
    begun_ = true;
    deadline_.expires_after(kStopTime);
    deadline_.async_wait([this](const boost::system::error_code&) { io_.stop(); });
    begin_();
  });
}

namespace {

// Checks the terminal, which sends SIGHUP when it is closed. The standard input may be a pipe
// (under `ros2 launch`); only a process with a terminal can open /dev/tty.
bool has_terminal() {
  const int terminal = ::open("/dev/tty", O_RDONLY | O_NOCTTY | O_CLOEXEC);
  if (terminal >= 0) ::close(terminal);
  return terminal >= 0;
}

}  // namespace

void ignore_early_hangup() {
  if (!has_terminal()) std::signal(SIGHUP, SIG_IGN);
}

Hangup::Hangup(boost::asio::io_context& io, std::function<void()> reload)
    : signals_(io, SIGHUP), reload_(std::move(reload)), in_terminal_(has_terminal()) {}

void Hangup::wait_for_signal() {
  signals_.async_wait([this](const boost::system::error_code& error, int) {
    if (error) return;
    if (in_terminal_ && !has_terminal()) {
      std::raise(SIGTERM);
    } else {
      reload_();
    }
    wait_for_signal();
  });
}

void LastSteps::begin() {
  boost::system::error_code ignored;  // the deadline matters more
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) signals_.add(number, ignored);
  end_within(kLastStepsTime);
}

// Only destructors of libraries follow. For a moment no handler exists, so the only remaining
// thread blocks the signals.
LastSteps::~LastSteps() {
  sigset_t stops;
  sigemptyset(&stops);
  sigaddset(&stops, SIGINT);
  sigaddset(&stops, SIGTERM);
  sigaddset(&stops, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &stops, nullptr);
  boost::system::error_code ignored;
  signals_.clear(ignored);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) std::signal(number, SIG_IGN);
}

}  // namespace connect_bridge
