#include "net/tcp/race.hpp"

#include <algorithm>

namespace connect_bridge {

struct Race::Attempt {
  Attempt(asio::io_context& io, const Waiting& next)
      : address(next.address), time(next.time), socket(io.get_executor()), limit(io) {}

  void end() {
    ErrorCode ignored;
    socket.close(ignored);
    limit.cancel();
  }

  Endpoint address;
  Clock::duration time;
  TcpSocket socket;
  asio::steady_timer limit;
};

std::vector<Race::Endpoint> Race::in_turns(const std::vector<Endpoint>& addresses) {
  std::vector<Endpoint> ordered = addresses;
  if (ordered.empty()) return ordered;
  const auto others = std::stable_partition(
      ordered.begin(), ordered.end(), [first = addresses.front().protocol()](const Endpoint& one) {
        return one.protocol() == first;
      });
  std::vector<Endpoint> mixed;
  for (auto same = ordered.begin(), other = others;
       (same != others || other != ordered.end()) && mixed.size() < kAddressesMax;) {
    if (same != others) mixed.push_back(*same++);
    if (other != ordered.end() && mixed.size() < kAddressesMax) mixed.push_back(*other++);
  }
  return mixed;
}

void Race::start(const std::vector<Endpoint>& addresses, Done done) {
  done_ = std::move(done);
  for (const Endpoint& address : in_turns(addresses))
    waiting_.push_back({address, {}, kAttemptTime});
  begin_next();
}

// Begins one attempt now, if an address is due, and the next after the delay.
void Race::begin_next() {
  if (!done_) return;
  const auto now = Clock::now();
  const auto next = std::find_if(waiting_.begin(), waiting_.end(),
                                 [now](const Waiting& one) { return one.due <= now; });
  if (next != waiting_.end()) {
    const Waiting one = *next;
    waiting_.erase(next);
    const bool waits = slow_ || one.time == kAttemptTime;
    waiting_.push_back({one.address, waits ? now + kPatience : now, kPatience});
    begin(one);
  }
  call_after(pace_, kAttemptDelay, if_alive(this, &Race::begin_next));
}

void Race::begin(const Waiting& next) {
  const auto attempt = std::make_shared<Attempt>(io_, next);
  running_.insert(attempt);
  call_after(attempt->limit, next.time, [attempt] { attempt->end(); });
  attempt->socket.async_connect(
      next.address,
      [self = shared_from_this(), attempt](ErrorCode error) { self->on_end(attempt, error); });
}

void Race::on_end(const std::shared_ptr<Attempt>& attempt, ErrorCode error) {
  if (!done_ || running_.erase(attempt) == 0) return;
  // The attempt may have connected at the moment when its time was over.
  if (!error && !attempt->socket.is_open()) error = asio::error::operation_aborted;
  attempt->limit.cancel();
  if (!error) return finish(std::move(attempt->socket), {});
  attempt->end();
  if (error == asio::error::operation_aborted) {  // its time is over
    for (Waiting& one : waiting_)
      if (one.address == attempt->address) one.time = std::max(one.time, attempt->time);
    return;
  }
  forget(attempt->address);
  if (waiting_.empty()) return finish(std::nullopt, error);
  begin_next();
}

// The address refuses: other attempts to it would be refused as well.
void Race::forget(const Endpoint& address) {
  std::erase_if(waiting_, [&](const Waiting& one) { return one.address == address; });
  std::erase_if(running_, [&](const std::shared_ptr<Attempt>& attempt) {
    if (attempt->address != address) return false;
    attempt->end();
    return true;
  });
}

void Race::finish(std::optional<TcpSocket> winner, const ErrorCode& error) {
  const Done done = std::move(done_);
  stop();
  done(std::move(winner), error);
}

void Race::stop() {
  done_ = nullptr;
  pace_.cancel();
  waiting_.clear();
  for (const auto& attempt : running_) attempt->end();
  running_.clear();
}

}  // namespace connect_bridge
