#include "run/loop.hpp"

#include <boost/asio/post.hpp>
#include <ctime>

namespace connect_bridge {
namespace {

// Limits of a stall: a deadline that is noticed so late shows that the loop stood still; the time
// to read the sockets after it; the shortest time between two such readings, for a loop that is
// always late.
constexpr Duration kLate = std::chrono::milliseconds(100);
constexpr Duration kReadTime = std::chrono::milliseconds(20);
constexpr Duration kReadPause = std::chrono::seconds(1);

// After a step longer than this, the loop polls the sockets so many times before the next packet
// has its turn. A packet needs some polls to leave its socket, and long steps between them would
// add up.
constexpr Duration kLongStep = std::chrono::microseconds(200);
constexpr int kLooks = 8;

Stamp read_clock(clockid_t id) {
  timespec t{};
  clock_gettime(id, &t);
  return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
}

}  // namespace

Now Loop::now() const {
  return at(TimePoint(Duration(read_clock(CLOCK_MONOTONIC))));
}

Now Loop::at(TimePoint steady) const {
  return {steady, read_clock(CLOCK_REALTIME), ports_.ros_now()};
}

void Loop::feed(Input&& input) {
  if (stepping_) return waiting_.push_back(std::move(input));
  begin_step();
  handle(std::move(input));
  end_step();
}

void Loop::begin_step() {
  cost_.begin(ports_.alone());
  began_ = cost_.now();
  stepping_ = true;
  handled_ = false;
}

std::optional<Packet> Loop::next_packet(ConnectionId connection, const Repairs& repairs) {
  if (sending_) {
    cost_.skip();
  } else {
    cost_.begin(ports_.alone());
  }
  auto packet = side_.next_packet(connection, at(cost_.now()), repairs);
  side_.spent(cost_.own(), cost_.now());
  if (!sending_ && (!packet || !packet->more)) set_timer();
  return packet;
}

void Loop::handle(Input&& input) {
  handled_ = true;
  cost_.skip();
  side_.handle(std::move(input), at(cost_.now()));
  side_.spent(cost_.own(), cost_.now());
  while (auto action = side_.next_action()) {
    cost_.enter();
    if (ports_.carry_out(std::move(*action))) {
      side_.spent(cost_.inside(), cost_.now());
    } else {
      cost_.skip();
    }
  }
}

// One connection has nobody to wait for.
void Loop::arrived(PacketReceived&& packet) {
  if (ports_.alone()) return take(std::move(packet));
  side_.on_arrival(std::move(packet), now());
  plan_turn();
}

void Loop::take(PacketReceived&& packet) {
  const ConnectionId connection = packet.connection;
  feed(std::move(packet));
  ports_.read_on(connection);
}

void Loop::plan_turn() {
  if (std::exchange(turn_planned_, true)) return;
  look(step_took_ < kLongStep ? 1 : kLooks);
}

void Loop::look(int times) {
  boost::asio::post(io_, [this, times] {
    if (times > 1) return look(times - 1);
    turn_planned_ = false;
    auto next = side_.take_turn(now());
    if (!next) return;
    take(std::move(*next));
    if (side_.packets_wait()) plan_turn();
  });
}

// A step without input has nothing new to send: the middleware woke the loop for events that an
// earlier step has handled.
void Loop::end_step() {
  while (!waiting_.empty()) {
    Input input = std::move(waiting_.front());
    waiting_.pop_front();
    handle(std::move(input));
  }
  stepping_ = false;
  const auto began = began_;  // a failed write may start another step
  if (handled_) {
    sending_ = true;
    ports_.send();
    sending_ = false;
    set_timer();
  }
  cost_.skip();
  const Duration took = cost_.now() - began;
  longest_ = std::max(longest_, took);
  step_took_ = took - cost_.taken();
}

// A timer that fires too early is left as it is. Deadlines move with every packet, and setting the
// timer costs more than the few times that it fires without effect.
void Loop::set_timer() {
  if (timer_at_ && *timer_at_ == reads_until_) return;
  const auto deadline = side_.next_deadline();
  if (!deadline || (timer_at_ && *timer_at_ <= *deadline)) return;
  wait_until(*deadline);
}

void Loop::wait_until(TimePoint when) {
  timer_at_ = when;
  timer_.expires_at(std::chrono::steady_clock::time_point(when.time_since_epoch()));
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (error) return;
    timer_at_.reset();
    const auto due = side_.next_deadline();
    // The sockets are read first after a stall; otherwise peers would wrongly count as silent.
    const TimePoint at = now().steady;
    if (due && at - *due > kLate && at - reads_until_ > kReadPause) {
      reads_until_ = at + kReadTime;
      return wait_until(reads_until_);
    }
    if (due && *due <= now().steady) return feed(TimePassed{});
    set_timer();
  });
}

}  // namespace connect_bridge
