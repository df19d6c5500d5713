#include "net/relay/relay_door.hpp"

#include <openssl/err.h>
#include <openssl/ssl.h>

#include <algorithm>
#include <boost/asio/write.hpp>
#include <charconv>
#include <random>

#include "core/base/hex.hpp"
#include "core/base/sha256.hpp"
#include "net/relay/client_word.hpp"
#include "net/relay/relay_wire.hpp"
#include "net/tcp/route.hpp"
#include "net/tcp/route_watch.hpp"
#include "net/tcp/socket_tuning.hpp"
#include "net/tcp/steady_now.hpp"
#include "net/tcp/system_now.hpp"
#include "net/tls/openssl_owned.hpp"

namespace connect_bridge {
namespace {

// The robot dials its relay again as a client dials its server (docs/protocol.md section 7.11).
constexpr std::chrono::milliseconds kFirstRetry{200};
constexpr std::chrono::milliseconds kLastRetry{500};
// A place that lasted so long was one. An end before counts as the answer of something that is no
// relay: a balancer whose relay is away may welcome and close for ever, and each try costs a TLS
// handshake.
constexpr std::chrono::seconds kSteadyPlace{5};
constexpr std::chrono::milliseconds kLookTime{1000};
constexpr std::chrono::milliseconds kLoginTime{10000};
constexpr std::size_t kTicketsMax = 32;

bool offer(SSL* tls, const std::string& protocols) {
  const ByteView list = view_of(protocols);
  return SSL_set_alpn_protos(tls, list.data(), static_cast<unsigned>(list.size())) == 0;
}

bool selected(SSL* tls, std::string_view protocol) {
  const unsigned char* name = nullptr;
  unsigned size = 0;
  SSL_get0_alpn_selected(tls, &name, &size);
  return protocol == std::string_view(reinterpret_cast<const char*>(name), size);
}

std::string_view next_word(std::string_view& rest) {
  const std::size_t space = std::min(rest.find(' '), rest.size());
  const std::string_view word = rest.substr(0, space);
  rest.remove_prefix(std::min(space + 1, rest.size()));
  return word;
}

}  // namespace

TicketHellos::TicketHellos() : context_(SSL_CTX_new(TLS_client_method()), &SSL_CTX_free) {}

std::string TicketHellos::make(const std::string& robot, const std::string& ticket) const {
  const std::unique_ptr<SSL, decltype(&SSL_free)> tls(context_ ? SSL_new(context_.get()) : nullptr,
                                                      &SSL_free);
  if (!tls || SSL_set_tlsext_host_name(tls.get(), robot.c_str()) != 1 ||
      !offer(tls.get(), protocol_list({kTicketProtocol, ticket})))
    return {};
  BIO* const out = BIO_new(BIO_s_mem());
  SSL_set_bio(tls.get(), BIO_new(BIO_s_mem()), out);  // they are its own from now on
  SSL_connect(tls.get());                             // has written, and waits for the answer
  std::string hello = written_to(out);
  ERR_clear_error();
  return hello;
}

RelayDoor::RelayDoor(asio::io_context& io, RelayOptions options, SocketOptions sockets,
                     Events events)
    : io_(io),
      options_(std::move(options)),
      sockets_(std::move(sockets)),
      events_(std::move(events)),
      tls_(options_.tls, Role::kClient),
      limit_(io),
      next_(io),
      dialer_({kFirstRetry, kLastRetry}),
      random_(std::random_device{}()),
      process_(to_hex(make_token(random_).bytes)),
      visitors_(kVisitorsAtOnce, kVisitorPeriod) {
  place_.relay = options_.url.text("ws");
}

RelayDoor::~RelayDoor() = default;

std::string RelayDoor::open() {
  std::string problem;
  if (!tls_.get(problem)) return problem;
  routes_ = std::make_shared<RouteWatch>(io_, if_alive(this, &RelayDoor::on_routes_changed));
  static_cast<void>(routes_->open());  // without it a lost address is noticed by the next ping
  dial();
  return {};
}

void RelayDoor::close() {
  events_ = {};
  routes_.reset();
  limit_.cancel();
  next_.cancel();
  if (way_) way_->stop();
  if (lines_) lines_->end();
  while (!tickets_.empty()) forget(*tickets_.begin());
}

void RelayDoor::after(asio::steady_timer& timer, Duration time, void (RelayDoor::*then)()) {
  call_after(timer, time, [weak = weak_from_this(), then] {
    const auto self = weak.lock();
    if (self && self->events_.log) (self.get()->*then)();
  });
}

// ---- the control connection

void RelayDoor::dial() {
  static_cast<void>(dialer_.take_due(steady_now()));  // its timer has come
  after(limit_, kLoginTime, &RelayDoor::on_silence);
  way_ = std::make_shared<Way>(io_, options_.url.host, options_.url.port, std::nullopt);
  way_->start(if_alive(this, &RelayDoor::on_connected));
}

void RelayDoor::on_connected(std::optional<TcpSocket> socket, const Failure& why) {
  if (!socket) return fail({Cause::kRelayUnreachable, why.text}, DialFailure::kGone);
  std::string problem;
  TlsContext context = tls_.get_fresh(problem);
  if (!context) return fail({Cause::kCertificateFiles, problem}, DialFailure::kPutOff);
  tune_socket(socket->native_handle(), sockets_);
  lines_ = std::make_shared<TlsLines>(std::move(*socket), std::move(context));
  expect_server(lines_->tls(), options_.url.host);
  // The certificate is the relay's; the name in the handshake is the robot's, so that what
  // distributes connections over several relays sees one name for all of a robot's.
  if (SSL_set_tlsext_host_name(lines_->tls(), options_.url.robot.c_str()) != 1 ||
      !offer(lines_->tls(), protocol_list({kRelayProtocol, process_})))
    return fail({Cause::kTlsFails, "TLS cannot start"}, DialFailure::kPutOff);
  lines_->shake_hands(false, {}, if_alive(this, &RelayDoor::on_tls));
}

void RelayDoor::on_tls(const ErrorCode& error) {
  SSL* const tls = lines_->tls();
  if (error) {
    const Failure why = failure_of(error, tls, options_.url.host);
    return fail({why.cause, "TLS: " + why.text}, DialFailure::kAnswered);
  }
  const Failure other_key = pin_failure(tls, options_.tls.pins);
  if (other_key)  // mutant: pin_of_relay
    return fail({other_key.cause, "TLS: " + other_key.text}, DialFailure::kOtherKey);
  if (!selected(tls, kRelayProtocol))
    return fail({Cause::kNotThisProgram, "what answers there is no relay"}, DialFailure::kAnswered);
  token_ = options_.token ? options_.token() : "";
  if (token_.empty())
    return fail({Cause::kTokenMissing, "listen.relay.token_file has no token now"},
                DialFailure::kPutOff);
  lines_pace_ = Pace(kRelayLinesAtOnce, kRelayLinePeriod);
  lines_->open(kRelayLineMax,
               {if_alive(this, &RelayDoor::on_line), if_alive(this, &RelayDoor::on_ended)});
  lines_->say("login " + token_ + (options_.code.empty() ? "" : " " + options_.code));
}

void RelayDoor::on_line(std::string_view line) {
  if (!lines_pace_.take(steady_now()))  // mutant: lines_of_a_relay
    return fail({Cause::kMalformed, "it sent more lines than allowed"},
                leaves_.take(steady_now()) ? DialFailure::kGone : DialFailure::kPutOff);
  const std::string_view word = next_word(line);
  if (word == "refused" && line == "twin" && !welcome_) {
    fail({Cause::kRobotTwice,
          "another machine has the same token and is connected there (a copied disk?): that one "
          "stays, this one waits a minute. Give this one a name, a token and keys of its own: "
          "end its pairing, then 'relay --robot' there and 'server --pair --via' here"},
         DialFailure::kPutOff);
    return after(next_, kTwinWait, &RelayDoor::dial);
  }
  if (word == "refused" && !welcome_) {
    return fail(
        {Cause::kRelayRefuses,
         std::string{
             "it refuses the token of listen.relay.token_file for this name, or the registration "
             "command was used already or is too old: 'relay --robot' prints another one there"} +
             (options_.code.empty() ? "" : "; a start without --pair uses its former place")},
        DialFailure::kRefused);
  }
  if (word == "welcome" && !welcome_) {
    welcome_ = true;
    welcome_at_ = steady_now();
    takes_words_ = line == "clients";
    word_.clear();
    tell_word();
    logged_.clear();
    place_.connected_since = system_now();
    limit_.cancel();
    ErrorCode ignored;
    tried_ = lines_->socket().remote_endpoint(ignored).address();
    route_ = route_to(*tried_);
    events_.log(LogLevel::kInfo, "connected to the relay " + options_.url.text("ws") +
                                     ": clients can connect there");
    if (!std::exchange(was_welcome_, true) && options_.keep)
      if (const std::string wrong = options_.keep(); !wrong.empty())
        events_.log(LogLevel::kError, "the relay is not stored for the next start: " + wrong);
    return after(next_, kRelayPing, &RelayDoor::ping);
  }
  if (word == "pong" && welcome_) {
    asked_ = false;
    return static_cast<void>(limit_.cancel());
  }
  // Somebody else has come with this token: whether this one is still there decides who stays.
  if (word == "ping" && welcome_) return lines_->say("pong");
  if (word == "visitor" && welcome_) return on_visitor(line);
  fail({Cause::kMalformed, "it sent a line that is not allowed"}, DialFailure::kPutOff);
}

void RelayDoor::tell_word() {
  if (!welcome_ || !takes_words_ || !events_.own_pin) return;
  const std::string word = client_word(events_.own_pin(), options_.url.robot);
  if (word.empty() || word == word_) return;
  word_ = word;
  lines_->say("clients " + word);
}

Traffic RelayDoor::traffic() {
  Traffic all = past_;
  if (lines_) all += lines_->traffic();
  return all;
}

void RelayDoor::ping() {
  if (!welcome_) return;  // its timer had come before fail() could cancel it
  asked_ = true;
  lines_->say("ping");
  after(limit_, kRelayPong, &RelayDoor::on_silence);
  after(next_, kRelayPing, &RelayDoor::ping);
}

// A NAT that has forgotten the connection, or has another address, says nothing.
void RelayDoor::look() {
  if (!welcome_ || !events_.log || asked_ || !looks_.take(steady_now())) return;
  asked_ = true;
  lines_->say("ping");
  after(limit_, kLookTime, &RelayDoor::on_silence);
}

void RelayDoor::on_silence() {
  if (welcome_ && !asked_) return;  // the answer came when this was queued already
  fail({Cause::kRelayUnreachable, "no answer in time"}, DialFailure::kGone);
}

void RelayDoor::on_routes_changed() {
  if (!events_.log) return;
  if (welcome_) {
    const std::string address = lost_address(lines_->socket());
    if (!address.empty())
      return fail({Cause::kAddressGone, "the address " + address + " of this machine is gone"},
                  DialFailure::kGone);
    // From Wi-Fi to LTE, say, while the interface of the Wi-Fi keeps its address for a while.
    if (takes_another_route()) look();
  } else if (dialer_.deadline() && tried_ && takes_another_route()) {
    dialer_.hurry(steady_now());
    wait();
  }
}

bool RelayDoor::takes_another_route() {
  const std::string before = std::exchange(route_, route_to(*tried_));
  return before != route_;
}

bool RelayDoor::is_steady() const {
  return welcome_ && steady_now() - welcome_at_ >= kSteadyPlace;
}

void RelayDoor::on_ended(const Failure& why) {
  fail(why, is_steady() ? DialFailure::kGone : DialFailure::kAnswered);  // mutant: short_places
}

void RelayDoor::check_token() {
  const bool waits = events_.log && dialer_.deadline();
  if (!waits || !token_refused_ || !options_.token || options_.token() == token_) return;
  dialer_.forget_refusal(steady_now());
  wait();
}

void RelayDoor::fail(const Failure& why, DialFailure failure) {
  if (!events_.log) return;
  if (way_) {
    if (way_->tried()) tried_ = way_->tried();
    way_->stop();
  }
  past_ = traffic();
  if (lines_) lines_->end();
  lines_.reset();
  limit_.cancel();
  asked_ = false;
  if (is_steady()) dialer_.opened();
  const bool was_welcome = std::exchange(welcome_, false);
  place_.connected_since = 0;
  place_.failure = why;
  token_refused_ = why.cause == Cause::kRelayRefuses || why.cause == Cause::kRobotTwice ||
                   why.cause == Cause::kTokenMissing;
  const std::string text = "the relay " + options_.url.text("ws") + ": " + why.text;
  if (was_welcome || text != logged_) events_.log(LogLevel::kWarn, text + "; trying again");
  logged_ = text;
  if (tried_) route_ = route_to(*tried_);
  dialer_.failed(steady_now(), failure, random_);
  wait();
}

void RelayDoor::wait() {
  after(next_, std::max(Duration::zero(), *dialer_.deadline() - steady_now()), &RelayDoor::dial);
}

// ---- visitors

// "TICKET ADDRESS PORT"
void RelayDoor::on_visitor(std::string_view words) {
  const std::string ticket{next_word(words)};
  const std::string address{next_word(words)};
  const auto made = std::make_shared<Ticket>(io_);
  Digest digits{};
  ErrorCode wrong;
  made->source.address = plain_address(asio::ip::make_address(address, wrong));
  const char* const end = words.data() + words.size();
  const auto number = std::from_chars(words.data(), end, made->source.port);
  if (!from_hex(ticket, digits) || wrong || number.ec != std::errc{} || number.ptr != end)
    return fail({Cause::kMalformed, "it sent a line that is not allowed"}, DialFailure::kPutOff);
  if (tickets_.size() >= kTicketsMax || !visitors_.take(steady_now()))
    return events_.log(LogLevel::kDebug, "a visitor at the relay is left out: there are too many");
  made->hello = hellos_.make(options_.url.robot, ticket);
  dial_with(made);
}

void RelayDoor::dial_with(const TicketPtr& ticket) {
  ErrorCode error;
  // The control connection's own address leads to the same relay, where several have one name.
  const auto relay = lines_->socket().remote_endpoint(error);
  if (error || ticket->hello.empty()) return;
  tickets_.insert(ticket);
  const auto weak = weak_from_this();
  call_after(ticket->limit, kTicketTime, [weak, ticket] {
    if (const auto self = weak.lock()) self->forget(ticket);
  });
  ticket->way = std::make_shared<Way>(io_, relay.address().to_string(), relay.port(), std::nullopt);
  ticket->way->start([weak, ticket](auto socket, const Failure&) {
    const auto self = weak.lock();
    if (!self) return;
    if (!socket) return self->forget(ticket);
    ticket->socket = std::make_unique<TcpSocket>(std::move(*socket));
    asio::async_write(*ticket->socket, asio::buffer(ticket->hello),
                      [weak, ticket](ErrorCode wrong, std::size_t) {
                        const auto door = weak.lock();
                        if (!door || door->tickets_.count(ticket) == 0) return;
                        const auto whole = std::move(ticket->socket);
                        door->forget(ticket);
                        if (!wrong) door->events_.arrived(std::move(*whole), ticket->source);
                      });
  });
}

void RelayDoor::forget(TicketPtr ticket) {
  ticket->limit.cancel();
  ticket->way->stop();
  ErrorCode ignored;
  if (ticket->socket) {
    past_ += traffic_of(ticket->socket->native_handle());
    ticket->socket->close(ignored);
  }
  tickets_.erase(ticket);
}

}  // namespace connect_bridge
