#include "net/websocket/listener.hpp"

#include <sys/socket.h>

#include <algorithm>

#include "core/wire/control.hpp"
#include "core/wire/text.hpp"
#include "net/tcp/socket_tuning.hpp"
#include "net/tcp/steady_now.hpp"
#include "net/websocket/accept.hpp"

namespace connect_bridge {
namespace {

constexpr int kProxyShare = ListenOptions::kLoopbackShare;
// The limit of a customer with many addresses, as a multiple of the limit of one address.
constexpr int kCustomerShare = 2;
// Places of an address from which somebody has logged in lately, in times of what others have.
constexpr int kKnownShare = 4;
// A connection by the relay has the address that the relay reports. Its limits are apart, and all
// such connections together have one share: half of the places and handshakes.
constexpr char kRelayed[] = "relay ";
constexpr int kRelayedPart = 2;

// Limits count by network: an IPv6 customer has at least a /64 of addresses, and mostly a /56.
void set_source(ConnectionOpened& from, const Source& source) {
  const std::string host = source.address.to_string();
  from.peer = source.port == 0 ? bracketed(host) : host_and_port(host, source.port);
  from.address = network_of(source.address, 8);
  from.customer = network_of(source.address, 7);
  from.share = source.address.is_loopback() ? kProxyShare : 1;
}

}  // namespace

Listener::Listener(asio::io_context& io, SocketOptions sockets, Events events)
    : io_(io), sockets_(std::move(sockets)), events_(std::move(events)), next_turn_(io) {}

Listener::~Listener() {
  close();
}

std::string Listener::open(const ListenOptions& options) {
  options_ = options;
  for (const std::string& text : options.trusted_proxies) {
    const auto range = AddressRange::parse(text);
    if (!range) return "trusted proxy '" + text + "': it is no IP address and no range of them";
    proxies_.push_back(*range);
  }
  std::string problem;
  if (options.tls && !tls_.emplace(*options.tls, Role::kServer).get(problem)) return problem;
  admission_.emplace(Admission::Options{options.connections_max, options.pending_max,
                                        options.pending_per_address_max,
                                        [this](Admission::Limit limit) { on_gave_way(limit); }});
  relayed_.emplace(Admission::Options{
      0, std::max<std::size_t>(options.pending_max / kRelayedPart, 1),
      options.pending_per_address_max, [this](Admission::Limit limit) { on_gave_way(limit); }});

  doors_ = std::make_shared<TcpDoors>(
      io_, TcpDoors::Events{if_alive(this, &Listener::on_arrived), if_alive(this, &Listener::log)});
  problem = options.sockets.empty() ? doors_->open(options.addresses, options.port)
                                    : doors_->take(options.sockets);
  if (!problem.empty()) return problem;
  for (auto* const paces : {&paces_, &relayed_paces_})
    paces->emplace(
        HandshakePaces{{options.address_handshakes_at_once, options.address_handshake_period},
                       {kCustomerShare * options.address_handshakes_at_once,
                        options.address_handshake_period / kCustomerShare}});
  kept_paces_.emplace(options.address_handshakes_at_once, options.address_handshake_period);
  word_paces_.emplace(options.address_handshakes_at_once, options.address_handshake_period);
  pace_ = Pace(options.handshakes_at_once, options.handshake_period);
  relayed_pace_ = Pace(std::max(options.handshakes_at_once / kRelayedPart, 1),
                       kRelayedPart * options.handshake_period);
  // Fewer than all places, so that those who wait give way by turns, not the oldest first.
  const std::size_t line_max = std::max<std::size_t>(options.pending_max / 2, 1);
  line_ = decltype(line_)({line_max, line_max});
  doors_->accept();
  if (!options.relay) return {};
  relay_ = std::make_shared<RelayDoor>(
      io_, *options.relay, sockets_,
      RelayDoor::Events{if_alive(this, &Listener::on_relayed), if_alive(this, &Listener::log),
                        [this] { return own_pin(); }});
  problem = relay_->open();
  return problem.empty() ? "" : "listen.relay: " + problem;
}

std::uint16_t Listener::port() const {
  return doors_ ? doors_->port() : std::uint16_t{0};
}

std::vector<std::string> Listener::addresses() const {
  return doors_ ? doors_->addresses() : std::vector<std::string>{};
}

void Listener::check_files() {
  if (relay_) relay_->check_token();
  const auto news = tls_ ? tls_->check() : std::nullopt;
  if (!news) return;
  log(news->used ? LogLevel::kInfo : LogLevel::kWarn, news->text);
  if (relay_) relay_->tell_word();
}

std::string Listener::own_pin() const {
  const X509* const shown = SSL_CTX_get0_certificate(tls_->context()->native_handle());
  return shown == nullptr ? "" : pin_of_certificate(shown);
}

Traffic Listener::traffic() const {
  Traffic all = refused_traffic_;
  if (relay_) all += relay_->traffic();
  return all;
}

void Listener::close() {
  if (relay_) relay_->close();
  if (doors_) doors_->close();
  events_ = {};
  next_turn_.cancel();
  line_.clear();
  for (const auto& visitor : std::exchange(visitors_, {})) visitor->abandon();
}

// A TLS handshake costs the loop a signature, a millisecond or ten. Those of one address are
// limited first, so that it cannot use up what its customer has, nor a customer what all have.
bool Listener::take_handshake(const Visitor& visitor) {
  const TimePoint now = steady_now();
  const ConnectionOpened& from = visitor.from;
  const bool relayed = visitor.by == By::kRelay;
  HandshakePaces& paces = relayed ? *relayed_paces_ : *paces_;
  if (paces.address.take(from.address, from.share, now)) {
    if (paces.customer.take(from.customer, from.share, now)) {
      if (!relayed || relayed_pace_.take(now)) return true;
      paces.customer.give_back(from.customer);
    }
    paces.address.give_back(from.address);
  }
  // Others of its address, as behind the NAT of a network provider, leave it this.
  if (logins_.has(from.address, now) && kept_paces_->take(from.address, from.share, now)) {
    if (!relayed || relayed_pace_.take(now)) return true;  // mutant: kept_handshakes
    kept_paces_->give_back(from.address);
  }
  // Nor can those who log in from there take this of who has logged in before.
  if (shows_word(visitor, now) && word_paces_->take(from.address, from.share, now)) {
    if (!relayed || relayed_pace_.take(now)) return true;  // mutant: words_of_logins
    word_paces_->give_back(from.address);
  }
  ++counts_.handshakes_dropped;
  log_limit(dropped_,
            from.peer + ": dropped, its address or its network begins too many TLS handshakes");
  return false;
}

bool Listener::shows_word(const Visitor& visitor, TimePoint now) {
  if (words_.empty()) return false;
  const std::vector<std::string> offers = visitor.offered();
  return std::any_of(offers.begin(), offers.end(),
                     [&](const std::string& offer) { return words_.take(offer, now); });
}

// Not in the kernel's queue: there who comes first is served first, whoever fills it.
void Listener::line_up(const VisitorPtr& visitor) {
  if (!tls_ || (line_.empty() && pace_.take(steady_now()))) return visitor->begin();
  ++counts_.handshakes_waited;
  log_limit(waited_, "TLS handshakes wait for their turn");
  const std::string line = visitor->by == By::kRelay ? kRelayed : visitor->from.customer;
  if (const auto left_out = line_.add(line, visitor)) {
    ++counts_.handshakes_dropped;
    abandon(*left_out);
  }
  begin_handshakes();
}

void Listener::begin_handshakes() {
  while (!line_.empty() && pace_.take(steady_now())) (*line_.take())->begin();
  if (line_.empty()) return;
  call_after(next_turn_, pace_.free_at() - steady_now(),
             if_alive(this, &Listener::begin_handshakes));
}

void Listener::drop(TcpSocket& socket, const ConnectionOpened& from, const std::string& why) {
  refused_traffic_ += traffic_of(socket.native_handle());
  reset(socket);
  note_refused(from, why);
}

// The reason may quote any bytes of an unauthenticated connection: the log gets its first line, as
// text. Further lines are for the peer.
void Listener::note_refused(const ConnectionOpened& from, const std::string& why) {
  ++counts_.refused;
  const std::string text = to_text(why.substr(0, why.find('\n')), kReasonBytesMax);
  log(LogLevel::kDebug, from.peer + ": " + text);
  counts_.last_refused = host_of(from.peer) + ": " + text;
  refusals_.add(from.peer, text);
}

void Listener::on_arrived(TcpSocket socket) {
  ++counts_.accepted;
  ErrorCode error;
  const auto remote = socket.remote_endpoint(error);
  if (error) return;  // gone already
  const Source source{plain_address(remote.address()), remote.port()};
  const bool proxy = contain(proxies_, source.address);
  admit(std::move(socket), source, proxy ? By::kProxy : By::kItself);
}

// A relayed connection has its TLS between the client and us, so it is a client like any other.
void Listener::on_relayed(TcpSocket socket, const Source& source) {
  admit(std::move(socket), source, By::kRelay);
}

void Listener::admit(TcpSocket socket, const Source& source, By by) {
  ConnectionOpened from;
  set_source(from, source);
  const bool proxy = by == By::kProxy;
  if (options_.proxies_only && by == By::kItself)
    return drop(socket, from, "dropped, it is no trusted proxy");  // mutant: proxies_only
  if (proxy) from.share = kProxyShare;
  if (by == By::kRelay) {
    from.address = kRelayed + from.address;
    from.customer = kRelayed + from.customer;
    from.share = 1;
  }
  std::shared_ptr<Admission::Pending> relay_slot;
  if (by == By::kRelay) relay_slot = relayed_->take_pending(from.address);
  auto slot = by == By::kRelay ? admission_->take_pending(kRelayed, relayed_share())
              : proxy          ? admission_->take_pending({}, 0)
                               : admission_->take_pending(from.address, share_of(from));
  tune_socket(socket.native_handle(), sockets_);
  const auto visitor = std::make_shared<Visitor>(*this, std::move(socket), std::move(from), by);
  visitors_.insert(visitor);
  slot->give_way = [this, weak = std::weak_ptr{visitor}] {
    if (const auto oldest = weak.lock()) abandon(oldest);
  };
  if (relay_slot) relay_slot->give_way = slot->give_way;
  visitor->slot = std::move(slot);
  visitor->relay_slot = std::move(relay_slot);
  visitor->start();
}

bool Listener::on_hello(Visitor& visitor) {
  visitor.slot->silent = false;
  if (visitor.relay_slot) visitor.relay_slot->silent = false;
  const bool known = visitor.by != By::kProxy || options_.named_by == NamedBy::kProxyProtocol;
  return !known || take_handshake(visitor);  // mutant: handshakes_of_address
}

void Listener::note_login(const std::string& address, const std::string& word) {
  logins_.add(address, steady_now());
  words_.add(word, address, steady_now());
}

int Listener::share_of(const ConnectionOpened& from) const {
  return from.share * (logins_.has(from.address, steady_now()) ? kKnownShare : 1);
}

int Listener::relayed_share() const {
  const std::size_t of_address = std::max<std::size_t>(options_.pending_per_address_max, 1);
  return static_cast<int>(
      std::max<std::size_t>(options_.pending_max / kRelayedPart / of_address, 1));
}

bool Listener::forget(const VisitorPtr& visitor) {
  line_.erase_if([&](const VisitorPtr& waiting) { return waiting == visitor; });
  return visitors_.erase(visitor) != 0;
}

void Listener::abandon(const VisitorPtr& visitor) {
  if (!forget(visitor)) return;
  ++counts_.refused;
  visitor->abandon();
  refused_traffic_ += visitor->traffic();
}

void Listener::identify(Visitor& visitor, const std::optional<Source>& source) {
  ConnectionOpened& from = visitor.from;
  if (source) set_source(from, *source);  // without one it counts as the proxy itself
  admission_->move_pending(*visitor.slot, from.address, share_of(from));
}

void Listener::on_refused(const VisitorPtr& visitor, const std::string& problem) {
  forget(visitor);
  refused_traffic_ += visitor->traffic();
  log_notice(*visitor);
  note_refused(visitor->from, problem);
}

void Listener::on_open(const VisitorPtr& visitor) {
  forget(visitor);
  const auto slot = std::move(visitor->slot);
  visitor->relay_slot.reset();
  log_notice(*visitor);
  if (!events_.arrived) return;
  std::shared_ptr<void> place = std::move(visitor->place);
  if (visitor->by == By::kRelay)  // it lasts as long as the connection
    place = {place.get(),
             [of = place, relay = std::weak_ptr{relay_}, stranger = std::weak_ptr{slot}](void*) {
               const auto door = relay.lock();
               if (door && stranger.expired()) door->look();  // a stranger may end as it likes
             }};
  events_.arrived({std::move(visitor->socket), std::move(visitor->from), slot, std::move(place)});
}

void Listener::log_notice(const Visitor& visitor) {
  if (!visitor.notice.empty() && notices_.take(steady_now()))
    log(LogLevel::kWarn, visitor.from.peer + ": " + visitor.notice);
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

void Listener::log(LogLevel level, std::string text) {
  if (events_.log) events_.log(level, std::move(text));
}

}  // namespace connect_bridge
