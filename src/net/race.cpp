#include "net/race.hpp"

#include <algorithm>

namespace connect_bridge {

struct Race::Attempt {
  Attempt(asio::io_context& io, Waiting whose)
      : of(std::move(whose)), socket(io.get_executor()), limit(io) {}

  void end() {
    ErrorCode ignored;
    socket.close(ignored);
    limit.cancel();
  }

  Waiting of;
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
  for (const Endpoint& address : in_turns(addresses)) waiting_.push_back({address, kFirstAttempt});
  begin_next();
}

void Race::begin_next() {
  if (waiting_.empty()) return;
  const auto attempt = std::make_shared<Attempt>(io_, waiting_.front());
  waiting_.pop_front();
  running_.insert(attempt);
  attempt->limit.expires_after(attempt->of.time);
  attempt->limit.async_wait([attempt](ErrorCode error) {
    if (!error) attempt->end();
  });
  attempt->socket.async_connect(
      attempt->of.address,
      [self = shared_from_this(), attempt](ErrorCode error) { self->on_end(attempt, error); });
  pace_.expires_after(kAttemptDelay);
  pace_.async_wait([weak = weak_from_this()](ErrorCode error) {
    const auto self = weak.lock();
    if (self && !error) self->begin_next();
  });
}

void Race::on_end(const std::shared_ptr<Attempt>& attempt, ErrorCode error) {
  if (!done_) return;
  running_.erase(attempt);
  // It may have connected at the moment when its time was over.
  if (!error && !attempt->socket.is_open()) error = asio::error::operation_aborted;
  if (!error) {
    attempt->limit.cancel();
    return finish(std::move(attempt->socket), {});
  }
  if (error == asio::error::operation_aborted)
    waiting_.push_back({attempt->of.address, attempt->of.time + kFirstAttempt});
  attempt->end();
  if (!waiting_.empty()) return begin_next();
  if (running_.empty()) finish(std::nullopt, error);
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
