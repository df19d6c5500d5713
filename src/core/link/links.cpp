#include "core/link/links.hpp"

#include <algorithm>
#include <utility>

#include "core/base/random.hpp"
#include "core/link/link_audit.hpp"
#include "core/link/standing.hpp"
#include "core/wire/text.hpp"

namespace connect_bridge {
namespace {

constexpr std::uint32_t kIdentityLinksMin = 8;
// A link that lives this long counts as a success: the back-off starts again after it.
constexpr Duration kSteadyLink = std::chrono::seconds(5);
// The rest of a link's end comes at once after this time.
constexpr Duration kEndsWithin = std::chrono::seconds(2);
// A connection with packets is read at least this often within dead_after. So neither side takes
// the other for silent while packets wait for those of other peers.
constexpr int kReadsToDead = 6;

}  // namespace

Links::Links(const LinkOptions& options, Token128 side, Random& random, Outputs& outputs,
             LinkUser& user)
    : options_(options),
      side_(side),
      random_(random),
      outputs_(outputs),
      user_(user),
      accounts_(options.account),
      turns_(options.dead_after / kReadsToDead),
      side_cap_(options.bytes_per_second_max),
      strangers_(options, outputs),
      dialer_({options.retry_min, options.retry_max}),
      last_failure_(outputs),
      renewal_(options.login_method, options.credential, outputs) {}

ConnectionOptions Links::connection_options() const {
  ConnectionOptions o;
  o.server = options_.role == Role::kServer;
  o.side = side_;
  o.node = options_.node;
  o.login_method = renewal_.method();
  o.credential = renewal_.credential();
  o.login_timeout = options_.login_timeout;
  o.dead_after = options_.dead_after;
  o.time_period = options_.time_period;
  o.outbox = options_.outbox;
  o.reassembly = options_.reassembly;
  if (!o.server && !links_.empty()) o.session = links_.begin()->second.login.session();
  return o;
}

Link& Links::make_link(const std::string& identity, NameMap names) {
  const LinkId id{++last_link_};
  auto own = accounts_.of(identity);
  Link& link =
      links_.try_emplace(id, id, user_, std::move(own), options_.resume_for, &due_).first->second;
  link.names = std::move(names);
  return link;
}

// ---- before the login

void Links::on(ConnectionOpened& input, const Now& now) {
  strangers_.add(connection_options(), input, now);
  renewal_.on_dialed();
  if (options_.role == Role::kClient) due_.ready(input.connection);  // its hello and login
}

void Links::on(DialFailed& input, const Now& now) {
  if (input.connection != dialing_) return;
  const Cause cause = input.why.cause;
  Failure why{cause, to_text(input.why.text, kReasonBytesMax)};
  const char* const hint =
      cause == Cause::kOtherKey ? "; trying again every few minutes" : "; trying again";
  last_failure_.tell({LogLevel::kWarn, "cannot connect: ", std::move(why), hint}, now);
  dial_later(wait_after(cause), now);
}

void Links::look_at(Connection& stranger, const Now& now) {
  const ConnectionId id = stranger.id();
  if (auto login = stranger.take_login())
    outputs_.push(Authenticate{id, stranger.peer().address, std::move(login->method),
                               std::move(login->credential), strangers_.customer_of(id)});
  if (stranger.failure()) return refuse(id, Error(*stranger.failure()), now);
  if (!stranger.open()) return;
  auto welcomed = strangers_.take(id);  // we are a client
  Link& link =
      links_.empty() ? make_link({}, options_.names.of({}).value()) : links_.begin()->second;
  end_rest(link, now);
  if (link.login.take_server(welcomed->peer().identity)) user_.on_identity_changed(link, now);
  carry(link, std::move(welcomed), now);
}

void Links::refuse(ConnectionId stranger, const Error& why, const Now& now,
                   const std::string& sent) {
  strangers_.refuse(stranger, why, now, sent);
  if (options_.role == Role::kServer) return;
  const Cause cause = cause_of(why.code);
  const std::string hint = " (" + std::string(name_of(why.code)) + ")" + advice(cause);
  last_failure_.tell({LogLevel::kWarn, "closing the connection: ", {cause, why.message}, hint},
                     now);
  dial_later(wait_after(cause), now);
}

void Links::on(Authenticated& input, const Now& now) {
  const Connection* const stranger = strangers_.find(input.connection);
  if (!stranger) {
    Link* const link = link_of(input.connection);
    if (link && link->login.end_renewal() && take_renewal(*link, input, outputs_, now))
      user_.on_identity_changed(*link, now);
    return;
  }
  if (stranger->state() != Connection::State::kAuthenticating) return;
  const TimePoint not_before =
      input.identity
          ? may_log_in_at(*input.identity, continued_by(*stranger, *input.identity), accounts_)
          : now.steady;
  if (!strangers_.puts_off(input, not_before, now)) answer_login(input, now);
}

void Links::answer_login(Authenticated& answer, const Now& now) {
  const ConnectionId id = answer.connection;
  if (!answer.judged)
    return refuse(id, {CloseCode::kLoginNotJudged, "login not judged: " + answer.reason}, now,
                  "the login could not be judged, try again later");
  if (const std::string why = refusal(answer, now); !why.empty())
    return refuse(id, {CloseCode::kLoginRefused, "login refused: " + why}, now, "login refused");
  const Identity& identity = *answer.identity;
  const Connection& stranger = *strangers_.find(id);
  if (may_log_in_at(identity, continued_by(stranger, identity), accounts_) > now.steady)
    return refuse(id, {CloseCode::kTooManyConnections, "too many links were ended for offences"},
                  now);
  auto names = options_.names.of(identity.name);
  if (!names)
    return refuse(id, names.error(), now, "login refused: the server has no prefix for this name");
  Link* link = link_for_login(stranger, identity, std::move(names).value(), now);
  if (!link) return refuse(id, {CloseCode::kTooManyConnections, "too many links"}, now);
  const Outputs::Paying paying(outputs_, link->account->time);
  auto connection = strangers_.take(id);
  end_rest(*link, now);  // before its rights change
  link->login.set_identity(identity);
  connection->on_authenticated(identity, link->login.session(), now);
  carry(*link, std::move(connection), now);
}

void Links::on(IdentitiesChanged& input, const Now& now) {
  strangers_.take_changes(input);
  for (auto& [id, link] : links_) {
    if (change_of(link, input)) end_rest(link, now);  // before its rights change
    if (take_change(link, input, outputs_, now)) user_.on_identity_changed(link, now);
    link.mark();
  }
}

void Links::on(CredentialChanged& input, const Now& now) {
  renewal_.change(std::move(input), links_.empty() ? nullptr : &links_.begin()->second);
  dialer_.forget_refusal(now.steady);
  dial_if_due(now);
}

Link* Links::continued_by(const Connection& connection, const Identity& identity) {
  for (auto& [id, link] : links_)
    if (link.login.is_continued_by(connection.peer().session, identity)) return &link;
  return nullptr;
}

// A login that continues no link needs two places: one among the links of its identity, so that one
// token cannot take all, and one among all links. The oldest lost link gives way, because a peer
// that is here counts for more than one that may return.
Link* Links::link_for_login(const Connection& connection, const Identity& identity, NameMap names,
                            const Now& now) {
  if (Link* const own = continued_by(connection, identity)) return own;
  const auto own = [&](const Link& link) { return link.login.identity().name == identity.name; };
  const std::uint32_t own_max = options_.identity_links_max > 0
                                    ? options_.identity_links_max
                                    : std::max(options_.links_max / 2, kIdentityLinksMin);
  if (!identity.name.empty() && !make_room(own_max, now, own)) return nullptr;
  if (!make_room(options_.links_max, now, [](const Link&) { return true; })) return nullptr;
  Link& link = make_link(identity.name, std::move(names));
  link.login.set_session(make_token(random_, options_.secret_random));
  return &link;
}

template <class Counts>
bool Links::make_room(std::size_t links_max, const Now& now, Counts counts) {
  std::size_t counted = 0;
  auto lost = links_.end();
  for (auto it = links_.begin(); it != links_.end(); ++it) {
    if (!counts(it->second)) continue;
    ++counted;
    if (it->second.life.waits() && lost == links_.end()) lost = it;
  }
  if (counted < links_max) return true;
  if (lost == links_.end()) return false;
  Link& link = lost->second;
  end_rest(link, now);
  if (link.life.waits_alive()) {
    begin_end(link, true, now);
    end_rest(link, now);
  }
  user_.on_link_forgotten(link, now);
  links_.erase(lost);
  return true;
}

// ---- while a connection carries a link

void Links::carry(Link& link, std::unique_ptr<Connection> connection, const Now& now) {
  end_rest(link, now);  // mutant: rest_of_the_end
  if (link.connection()) {
    const std::string why = "a newer connection of this session took over";
    audit(outputs_, link, AuditEvent::kLinkLost, why, name_of(CloseCode::kReplaced));
    close(link.connection()->id(), CloseCode::kReplaced, why);
    link.note_break({Cause::kReplaced, why}, false, now);
    lose(link, Loss::kBreak, now);
    end_rest(link, now);
  }
  const Peer& peer = connection->peer();
  if (is_replaced(link, peer)) user_.on_peer_replaced(link, now);
  const std::string before = past_of(link, peer, user_.resumes(link));
  // A server that forgot the session does not know what the session had delivered.
  if (link.life.connects() > 0 && link.login.session() != peer.session)
    user_.on_session_forgotten(link, now);
  carrying_.emplace(connection->id(), &link);
  link.opened(std::move(connection), now);
  // The limit may have changed during the login.
  if (side_cap_.limits())
    divide_cap(now);
  else
    cap(link, 0, now);
  last_failure_.clear();
  outputs_.push(OpenGate{link.connection()->id(), static_cast<std::uint32_t>(kPacketBytesMax)});
  const std::string& name = link.login.identity().name;
  // At a client the identity is the server's: nobody may read it as the client's own login.
  const bool is_server = options_.role == Role::kServer;
  const std::string identity =
      name.empty() ? "" : (is_server ? ", logged in as " : ", which rules call ") + name;
  log(link, LogLevel::kInfo, "connected to " + link.label() + identity + before, now);
  audit_login(outputs_, link, AuditEvent::kLogin);
  check_expiry(link, now);
  user_.on_link_open(link, now);
  if (options_.role == Role::kClient) renewal_.on_open(link);
}

void Links::on_arrival(PacketReceived packet, const Now& now) {
  Link* const link = link_of(packet.connection);
  turns_.wait(std::move(packet), link ? link->account->time : of_strangers_, now.steady);
  if (link) link->connection()->has_come();
}

void Links::on(PacketReceived& input, const Now& now) {
  if (Link* const link = link_of(input.connection)) {
    const Outputs::Paying paying(outputs_, link->account->time);
    link->mark();
    return link->connection()->on_packet(input.text, input.payload, now);
  }
  Connection* const stranger = strangers_.find(input.connection);
  if (!stranger) return;
  const Outputs::Paying paying(outputs_, of_strangers_);
  stranger->on_packet(input.text, input.payload, now);
  look_at(*stranger, now);
}

void Links::on(ConnectionClosed& input, const Now& now) {
  turns_.forget(input.connection);
  const Failure why = failure_of(input);
  const bool client = options_.role == Role::kClient;
  const auto how = client ? wait_after(why.cause) : DialFailure::kGone;
  const std::string hint = client ? advice(why.cause) : "";
  const bool orderly = is_orderly(input);
  const auto level = orderly ? LogLevel::kInfo : LogLevel::kWarn;
  if (strangers_.take(input.connection)) {
    if (!client) return;
    last_failure_.tell({level, "the server closed the connection: ", why, hint}, now);
    return dial_later(how, now);
  }
  Link* link = link_of(input.connection);
  if (!link) return;
  const Outputs::Paying paying(outputs_, link->account->time);
  const std::string end = orderly ? "the link with " + link->label() + " was closed: "
                                  : "lost the link with " + link->label() + ": ";
  log(*link, level, end + why.text + hint, now);
  audit(outputs_, *link, AuditEvent::kLinkLost, why.text, word_of(why.cause));
  note_failure(why, orderly, now);
  link->note_break(why, input.code.has_value(), now);
  lose(*link, loss_by(input.code, options_.role), now, how);
}

// The peers of a server connect again by themselves.
void Links::on(NetworkChanged& changed, const Now& now) {
  if (options_.role != Role::kClient || stopped_ || !changed.route) return;
  for (auto& [id, link] : links_) {
    if (link.connection()) link.connection()->probe(now);
    link.mark();
  }
  dialer_.hurry(now.steady);
  dial_if_due(now);
}

bool Links::settle(const Now& now) {
  bool any = false;
  due_.look_again(packets_wait(), now.steady);
  while (const auto id = due_.take_marked()) {
    const auto found = links_.find(*id);
    if (found == links_.end()) continue;  // the link was forgotten
    Link& link = found->second;
    Connection* const connection = link.connection();
    if (connection && connection->failure() && !link.loses()) {
      close_failed(link, now);
      any = true;
      continue;  // the link has marked itself
    }
    wait(link);
    if (connection && connection->may_have_packet()) due_.ready(connection->id());
  }
  return any;
}

void Links::close_failed(Link& link, const Now& now) {
  const Outputs::Paying paying(outputs_, link.account->time);
  const Error error = *link.connection()->failure();
  log(link, LogLevel::kWarn,
      "closing the link with " + link.label() + ": " + error.message + " (" +
          std::string(name_of(error.code)) + ")",
      now);
  audit(outputs_, link, AuditEvent::kLinkLost, error.message, name_of(error.code));
  note_failure({cause_of(error.code), error.message}, false, now);
  close(link.connection()->id(), error.code, error.message);
  note_offence(link, error.code, now);  // mutant: offences
  link.note_break({cause_of(error.code), error.message}, false, now);
  lose(link, loss_by(error, link, now), now);
}

// A server whose other links are open, or whose peer left in order, has no failure.
void Links::note_failure(const Failure& why, bool orderly, const Now& now) {
  const bool is_server = options_.role == Role::kServer;
  if (!is_server || (!orderly && carrying_.size() == 1)) last_failure_.set(why, now);
}

void Links::lose(Link& link, Loss loss, const Now& now, DialFailure failure) {
  link.lose(loss, now);
  carrying_.erase(link.connection()->id());
  due_.gone(link.connection()->id());
  begin_end(link, is_dead(loss) || link.life.is_to_die(now), now);
  if (options_.role == Role::kServer || stopped_) return;
  // The back-off stays for a peer that accepts the login and then closes the link.
  if (link.life.open_for(now) >= kSteadyLink) dialer_.opened();
  dial_later(failure, now);
}

void Links::begin_end(Link& link, bool dies, const Now& now) {
  link.end = {};
  link.end.late_at = now.steady + kEndsWithin;
  link.end.dies = dies;
  end_some(link, options_.ends_at_once, now);
}

void Links::end_some(Link& link, std::size_t entries, const Now& now) {
  link.mark();
  link.end.goes_on_at = now.steady;
  link.end.left = entries;
  if (link.loses()) {
    if (!user_.on_link_lost(link, now)) return;
    link.drop_connection();
    link.end.parts = 0;
  }
  if (link.end.dies) {
    if (!user_.on_link_dead(link, now)) return;
    link.life.died(user_.resumes(link), now);
  }
  link.end = {};
}

// ---- what the side may send

void Links::on(const LimitsChanged& input, const Now& now) {
  for (auto& [id, link] : links_) link.life.set_resume_for(input.resume_for);
  // Bytes that were sent without a limit are not owed.
  if (!side_cap_.limits())
    for (auto& [connection, link] : carrying_) (void)link->sending().take_sent();
  side_cap_.set(input.bytes_per_second_max);
  divide_cap(now);
}

void Links::cap(Link& link, double share, const Now& now) {
  const double rate = LinkCap(options_.outbox.bytes_per_second_max).within(share);
  if (rate == link.sending().cap()) return;
  link.sending().set_cap(rate, now);
  link.mark();
}

void Links::divide_cap(const Now& now) {
  std::vector<Link*> open;
  std::vector<SideCap::Use> uses;
  for (auto& [connection, link] : carrying_) {
    open.push_back(link);
    uses.push_back(
        {link->account.get(), link->sending().take_sent(), link->sending().waits_for_cap(now)});
  }
  const auto shares = side_cap_.divide(uses, now.steady);
  for (std::size_t i = 0; i < open.size(); ++i)
    cap(*open[i], side_cap_.limits() ? shares[i] : 0, now);
}

// ---- time

void Links::dial_later(DialFailure failure, const Now& now) {
  dialing_ = {};
  dialer_.failed(now.steady, failure, random_);
}

void Links::dial_if_due(const Now& now) {
  if (options_.role != Role::kClient || stopped_ || !dialer_.take_due(now.steady)) return;
  dialing_ = {++last_connection_};
  outputs_.push(Dial{dialing_});
}

void Links::log(const Link& link, LogLevel level, std::string text, const Now& now) {
  if (const auto count = link.account->lines.count(now))
    outputs_.log(level, std::move(text) + left_out(*count));
}

bool Links::on_time(const Now& now) {
  accounts_.on_time(now);
  while (auto answer = strangers_.take_due(now)) answer_login(*answer, now);
  strangers_.on_time(now);
  while (const auto failed = strangers_.failed()) look_at(*strangers_.find(*failed), now);
  // The end of a link may take milliseconds: other work runs between two of them.
  bool ended = false;
  while (!ended) {
    const auto due = due_.take_due(now.steady);
    if (!due) break;
    ended = on_time(links_.at(*due), now);
  }
  accounts_.appearing().on_time(turns_, now);
  const auto period_ends = side_cap_.deadline();
  if (period_ends && *period_ends <= now.steady) divide_cap(now);
  return ended;
}

bool Links::on_time(Link& link, const Now& now) {
  const Outputs::Paying paying(outputs_, link.account->time);
  link.timer.cancel();
  link.mark();
  if (link.end.goes_on_at) {
    const bool late =
        link.end.late_at <= now.steady || (!link.end.dies && link.life.is_to_die(now));
    end_some(link, late ? LinkEnd::kAll : options_.ends_at_once, now);
    return true;
  }
  link.on_time(now);
  check_expiry(link, now);
  bool ends = link.life.take_offers_end(now);
  if (ends) user_.on_offers_over(link, now);
  if (link.life.is_to_die(now)) {
    begin_end(link, true, now);
    if (link.end.goes_on_at) return true;
    ends = true;
  }
  if (!link.life.is_to_be_forgotten(now)) return ends;
  link.life.forgotten(user_.resumes(link));
  user_.on_link_forgotten(link, now);
  if (options_.role == Role::kServer) links_.erase(link.id);
  return true;
}

void Links::stop(const Now& now) {
  stopped_ = true;
  dialer_.stop();
  strangers_.close_all(CloseCode::kGoingAway, kPeerStops);
  for (auto& [id, link] : links_) {
    end_rest(link, now);
    if (!link.connection()) continue;
    audit(outputs_, link, AuditEvent::kLinkLost, "this side is stopping",
          name_of(CloseCode::kGoingAway));
    close(link.connection()->id(), CloseCode::kGoingAway, kPeerStops);
    lose(link, Loss::kEnd, now);
    end_rest(link, now);
  }
}

std::optional<Packet> Links::next_packet(ConnectionId id, const Now& now, const Repairs& repairs) {
  if (Link* const link = link_of(id)) {
    const Outputs::Paying paying(outputs_, link->account->time);
    if (sends_later(*link->connection(), *link->account->time, now)) return std::nullopt;
    auto packet = link->connection()->next_packet(now, repairs);
    link->report_left(now);
    if (packet) side_cap_.sent(now.steady, LinkCap::cost(packet->size()));
    wait(*link);  // packets that are held back leave at their time
    return packet;
  }
  Connection* const stranger = strangers_.find(id);
  return stranger ? stranger->next_packet(now) : std::nullopt;
}

}  // namespace connect_bridge
