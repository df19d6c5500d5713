#include "net/listener.hpp"

#include <sys/socket.h>

#include "core/wire/control.hpp"
#include "core/wire/text.hpp"
#include "net/socket_tuning.hpp"
#include "net/steady_now.hpp"

namespace connect_bridge {
namespace {

constexpr int kProxyShare = ListenOptions::kLoopbackShare;
// What a customer with many addresses may do, in times of what one of them may.
constexpr int kCustomerShare = 2;

// Limits count by network: an IPv6 customer has at least a /64 of addresses, and mostly a /56.
void set_address(ConnectionOpened& from, const asio::ip::address& address) {
  from.address = network_of(address, 8);
  from.customer = network_of(address, 7);
  from.share = address.is_loopback() ? kProxyShare : 1;
}

}  // namespace

Listener::Listener(asio::io_context& io, SocketOptions sockets, Events events)
    : io_(io), sockets_(std::move(sockets)), events_(std::move(events)), next_turn_(io) {}

std::string Listener::open(const ListenOptions& options) {
  auto accept_options = std::make_shared<AcceptOptions>();
  accept_options->timeout = options.handshake_timeout;
  accept_options->told_by = options.told_by;
  for (const std::string& text : options.trusted_proxies) {
    const auto range = AddressRange::parse(text);
    if (!range) return "trusted proxy '" + text + "': it is no IP address and no range of them";
    accept_options->proxies.push_back(*range);
  }
  if (options.tls) {
    std::string problem;
    tls_.emplace(*options.tls, Role::kServer);
    accept_options->tls = tls_->get(problem);
    if (!accept_options->tls) return problem;
  }
  proxies_only_ = options.proxies_only;
  admission_ = std::make_shared<Admission>(Admission::Options{
      options.connections_max, options.pending_max, options.pending_per_address_max,
      [weak = weak_from_this()](Admission::Limit limit) {
        if (const auto self = weak.lock()) self->on_gave_way(limit);
      }});
  accept_options->reserve = [admission = admission_] { return admission->take_connection(); };
  options_ = std::move(accept_options);

  const std::string problem = open_doors(options);
  if (!problem.empty()) return problem;
  paces_.emplace(options.address_handshakes_at_once, options.address_handshake_period);
  customer_paces_.emplace(kCustomerShare * options.address_handshakes_at_once,
                          options.address_handshake_period / kCustomerShare);
  pace_ = Pace(options.handshakes_at_once, options.handshake_period);
  // Fewer than all places, so that those who wait give way by turns, not the oldest first.
  const std::size_t line_max = std::max<std::size_t>(options.pending_max / 2, 1);
  line_ = decltype(line_)({line_max, line_max});
  doors_->accept();
  return options.relay ? open_relay(*options.relay) : "";
}

std::string Listener::open_relay(const RelayOptions& options) {
  const auto weak = weak_from_this();
  RelayDoor::Events events{[weak](TcpSocket socket, const Source& source) {
                             if (const auto self = weak.lock())
                               self->admit_visitor(std::move(socket), source);
                           },
                           [weak](LogLevel level, const std::string& text) {
                             if (const auto self = weak.lock()) self->log(level, text);
                           }};
  relay_ = std::make_shared<RelayDoor>(io_, options, sockets_, std::move(events));
  const std::string problem = relay_->open();
  return problem.empty() ? "" : "listen.relay: " + problem;
}

std::string Listener::open_doors(const ListenOptions& options) {
  const auto weak = weak_from_this();
  doors_ = std::make_shared<TcpDoors>(
      io_, TcpDoors::Events{[weak](TcpSocket socket) {
                              const auto self = weak.lock();
                              if (!self) return;
                              ++self->counts_.accepted;
                              self->admit(std::move(socket));
                            },
                            [weak](LogLevel level, const std::string& text) {
                              if (const auto self = weak.lock()) self->log(level, text);
                            }});
  return options.sockets.empty() ? doors_->open(options.addresses, options.port)
                                 : doors_->take(options.sockets);
}

std::uint16_t Listener::port() const {
  return doors_ ? doors_->port() : std::uint16_t{0};
}

std::vector<std::string> Listener::addresses() const {
  return doors_ ? doors_->addresses() : std::vector<std::string>{};
}

void Listener::check_files() {
  const auto news = tls_ ? tls_->check() : std::nullopt;
  if (!news) return;
  if (news->used) {
    auto changed = std::make_shared<AcceptOptions>(*options_);
    std::string problem;
    changed->tls = tls_->get(problem);
    options_ = std::move(changed);
  }
  log(news->used ? LogLevel::kInfo : LogLevel::kWarn, news->text);
}

void Listener::close() {
  if (relay_) relay_->close();
  if (doors_) doors_->close();
  events_ = {};
  next_turn_.cancel();
  line_.clear();
  const auto acceptances = std::move(acceptances_);
  acceptances_.clear();
  for (const auto& acceptance : acceptances) acceptance->abandon();
}

// A TLS handshake costs the loop a signature, a millisecond or ten. Those of one address are
// limited first, so that it cannot use up what its customer has, nor a customer what all have.
bool Listener::take_handshake(const ConnectionOpened& from) {
  const TimePoint now = steady_now();
  if (paces_->take(from.address, from.share, now)) {
    if (customer_paces_->take(from.customer, from.share, now)) return true;
    paces_->give_back(from.address);
  }
  ++counts_.handshakes_dropped;
  log_limit(dropped_,
            from.peer + ": dropped, its address or its network begins too many TLS handshakes");
  return false;
}

// Not in the kernel's queue: there who comes first is served first, whoever fills it.
void Listener::line_up(const std::shared_ptr<Acceptance>& acceptance, const Visitor& visitor) {
  if (!options_->tls || (line_.empty() && pace_.take(steady_now()))) return acceptance->begin();
  ++counts_.handshakes_waited;
  log_limit(waited_, "TLS handshakes wait for their turn");
  if (const auto left_out = line_.add(visitor.from.customer, acceptance)) {
    ++counts_.handshakes_dropped;
    abandon(*left_out);
  }
  begin_handshakes();
}

void Listener::begin_handshakes() {
  while (!line_.empty() && pace_.take(steady_now())) (*line_.take())->begin();
  if (line_.empty()) return;
  next_turn_.expires_at(std::chrono::steady_clock::time_point(pace_.free_at().time_since_epoch()));
  next_turn_.async_wait([weak = weak_from_this()](ErrorCode cancelled) {
    const auto self = weak.lock();
    if (self && !cancelled) self->begin_handshakes();
  });
}

void Listener::drop(TcpSocket& socket, const ConnectionOpened& from, const std::string& why) {
  ErrorCode ignored;
  socket.set_option(TcpSocket::linger(true, 0), ignored);
  socket.close(ignored);
  note_refused(from, why);
}

// What the stranger has sent may be a part of it, and be any bytes. Further lines are for itself.
void Listener::note_refused(const ConnectionOpened& from, const std::string& why) {
  ++counts_.refused;
  const std::string text = to_text(why.substr(0, why.find('\n')), kReasonBytesMax);
  log(LogLevel::kDebug, from.peer + ": " + text);
  refusals_.add(from.peer, text);
}

void Listener::admit(TcpSocket socket) {
  ErrorCode error;
  const Endpoint remote = socket.remote_endpoint(error);
  if (error) return;  // gone already
  const auto address = plain_address(remote.address());
  const auto visitor = std::make_shared<Visitor>();
  ConnectionOpened& from = visitor->from;
  from.peer = host_and_port(address.to_string(), remote.port());
  const bool proxy = contain(options_->proxies, address);
  if (proxies_only_ && !proxy)
    return drop(socket, from, "dropped, it is no trusted proxy");  // mutant: proxies_only
  set_address(from, address);
  if (proxy) from.share = kProxyShare;
  // A client behind a proxy is limited when its address is known, if that is before TLS.
  if (options_->tls && !proxy && !take_handshake(from))  // mutant: handshakes_of_address
    return drop(socket, from, "dropped, too many handshakes");
  visitor->slot =
      proxy ? admission_->take_pending({}, 0) : admission_->take_pending(from.address, from.share);
  tune_socket(socket.native_handle(), sockets_);
  start(std::move(socket), visitor, proxy);
}

// Its TLS is between the client and us, so it is a client like any other.
void Listener::admit_visitor(TcpSocket socket, const Source& source) {
  const auto visitor = std::make_shared<Visitor>();
  ConnectionOpened& from = visitor->from;
  from.peer = host_and_port(source.address.to_string(), source.port);
  set_address(from, source.address);
  if (!take_handshake(from)) return drop(socket, from, "dropped, too many handshakes");
  visitor->slot = admission_->take_pending(from.address, from.share);
  visitor->by_relay = true;
  start(std::move(socket), visitor, false);
}

void Listener::start(TcpSocket socket, std::shared_ptr<Visitor> visitor, bool from_proxy) {
  const auto weak = weak_from_this();
  Acceptance::Identify identify;
  if (from_proxy) {
    identify = [weak, visitor](const std::optional<Source>& source) {
      const auto self = weak.lock();
      return self && self->identify(*visitor, source);
    };
  }
  const auto await_turn = [weak, visitor](const std::shared_ptr<Acceptance>& waiting) {
    if (const auto self = weak.lock()) self->line_up(waiting, *visitor);
  };
  auto acceptance =
      std::make_shared<Acceptance>(std::move(socket), options_, std::move(identify), await_turn);
  acceptances_.insert(acceptance);
  visitor->slot->give_way = [weak, handshake = std::weak_ptr{acceptance}] {
    if (const auto self = weak.lock()) self->abandon(handshake);
  };
  acceptance->start([weak, handshake = std::weak_ptr{acceptance}, visitor](Accepted accepted) {
    if (const auto self = weak.lock()) {
      self->on_done(handshake.lock(), *visitor, std::move(accepted));
    }
  });
}

void Listener::abandon(const std::weak_ptr<Acceptance>& acceptance) {
  const auto ended = acceptance.lock();
  if (!ended) return;
  ++counts_.refused;
  acceptances_.erase(ended);
  leave_line(ended);
  ended->abandon();
}

bool Listener::identify(Visitor& visitor, const std::optional<Source>& source) {
  ConnectionOpened& from = visitor.from;
  if (source) {  // without one it counts as the proxy itself
    const std::string host = source->address.to_string();
    from.peer = source->port == 0 ? bracketed(host) : host_and_port(host, source->port);
    set_address(from, source->address);
  }
  const bool before_tls = options_->tls && options_->told_by == ToldBy::kProxyProtocol;
  if (before_tls && !take_handshake(from)) return false;
  admission_->move_pending(*visitor.slot, from.address, from.share);
  return true;
}

void Listener::on_done(const std::shared_ptr<Acceptance>& acceptance, Visitor& visitor,
                       Accepted accepted) {
  acceptances_.erase(acceptance);
  leave_line(acceptance);
  const auto slot = std::move(visitor.slot);
  if (!accepted.notice.empty()) log_notice(visitor, accepted.notice);
  if (!accepted.socket) return note_refused(visitor.from, accepted.problem);
  if (!events_.arrived) return;
  std::shared_ptr<void> place = std::move(accepted.slot);
  if (place && visitor.by_relay)  // it lasts as long as the connection
    place = {place.get(),
             [of = place, relay = std::weak_ptr{relay_}, stranger = std::weak_ptr{slot}](void*) {
               const auto door = relay.lock();
               if (door && stranger.expired()) door->look();  // a stranger may end as it likes
             }};
  events_.arrived({std::move(accepted.socket), std::move(visitor.from), slot, std::move(place)});
}

void Listener::log_notice(const Visitor& visitor, const std::string& notice) {
  if (notices_.take(steady_now())) log(LogLevel::kWarn, visitor.from.peer + ": " + notice);
}

void Listener::on_gave_way(Admission::Limit limit) {
  ++counts_.gave_way;
  const bool of_address = limit == Admission::Limit::kPendingOfAddress;
  const std::string oldest = "the oldest connection without a login gave way: ";
  if (of_address) return log_limit(gave_way_of_address_, oldest + "its address has too many");
  log_limit(gave_way_, oldest + (limit == Admission::Limit::kPending
                                     ? "there are too many"
                                     : "all places for connections are taken"));
}

void Listener::log_limit(LogLimit& lines, const std::string& text) {
  const auto count = lines.count({.steady = steady_now()});
  if (!count) return;
  log(LogLevel::kWarn,
      text + (*count > 1 ? "; " + std::to_string(*count) + " since the last line" : ""));
}

void Listener::log(LogLevel level, const std::string& text) {
  if (events_.log) events_.log(level, text);
}

}  // namespace connect_bridge
