#include "core/link/strangers.hpp"

#include <algorithm>
#include <utility>

#include "core/base/timers.hpp"
#include "core/link/standing.hpp"
#include "core/wire/text.hpp"

namespace connect_bridge {
namespace {

// Time for the login when half of the places are taken: a client sends its login within a round
// trip.
constexpr Duration kShortLogin = std::chrono::seconds(1);
// The client gives up after the same time as we do, by default: it must learn the reason before.
constexpr Duration kLateAnswer = std::chrono::seconds(3);

}  // namespace

Strangers::Strangers(const LinkOptions& options, Outputs& outputs)
    : options_(options),
      outputs_(outputs),
      address_wrong_logins_(options.address_wrong_logins_at_once,
                            options.address_wrong_login_period),
      wrong_logins_(options.wrong_logins_at_once, options.wrong_login_period) {}

void Strangers::add(ConnectionOptions options, const ConnectionOpened& opened, const Now& now) {
  // The oldest gives way: a client that means to log in has done so before this many others came.
  if (places_.size() >= options_.strangers_max) {
    ++counts_.gave_way;
    end(places_.begin()->first,
        {CloseCode::kTooManyConnections, "too many connections without login"}, now);
  }
  if (places_.size() >= options_.strangers_max / 2)
    options.login_within = std::min(options.login_timeout, kShortLogin);
  options.expires = opened.expires;
  options.server_is = opened.server;
  Place& place = places_[opened.connection];
  place.connection =
      std::make_unique<Connection>(std::move(options), opened.connection, opened.peer, now);
  place.address = opened.address;
  place.share = opened.share;
  place.customer = opened.customer;
}

Connection* Strangers::find(ConnectionId connection) const {
  const auto place = places_.find(connection);
  return place == places_.end() ? nullptr : place->second.connection.get();
}

std::unique_ptr<Connection> Strangers::take(ConnectionId connection) {
  auto place = places_.extract(connection);
  return place ? std::move(place.mapped().connection) : nullptr;
}

void Strangers::refuse(ConnectionId connection, const Error& why, const Now& now,
                       const std::string& sent) {
  if (why.code == CloseCode::kLoginTimeout) ++counts_.login_timeouts;
  if (why.code == CloseCode::kTooManyConnections) ++counts_.logins_without_place;
  if (why.code == CloseCode::kLoginNotJudged) ++counts_.logins_not_judged;
  end(connection, why, now, sent);
}

void Strangers::end(ConnectionId connection, const Error& why, const Now& now,
                    const std::string& sent) {
  const auto refused = take(connection);
  if (options_.role == Role::kServer) note_refusal(*refused, why, refusals_, outputs_, now);
  outputs_.push(CloseConnection{connection, why.code, sent.empty() ? why.message : sent});
}

void Strangers::close_all(CloseCode code, const std::string& reason) {
  for (const auto& [connection, place] : places_)
    outputs_.push(CloseConnection{connection, code, reason});
  places_.clear();
}

// ---- late answers

// A right login is never counted here: it is accepted, whatever others of its address try.
bool Strangers::puts_off(Authenticated& answer, TimePoint not_before, const Now& now) {
  Place& place = places_.at(answer.connection);
  const TimePoint end = place.connection->deadline().value_or(now.steady);
  place.due = std::min(not_before, end);
  if (const std::string why = refusal(answer, now); !why.empty()) {
    if (!answer.judged) return false;
    ++counts_.wrong_logins;
    counts_.last_wrong_login = to_text(why, LinkBreak::kReasonBytesMax);
    if (!is_one_too_many(place, now)) return false;  // mutant: wrong_logins
    ++counts_.wrong_logins_late;
    place.due = std::min(end, now.steady + kLateAnswer);
    answer.identity.reset();
    answer.reason = why + "; answered late, as there are too many wrong logins";
  }
  if (place.due <= now.steady) return false;
  if (answer.identity) ++counts_.shut_out;
  place.answer = std::move(answer);
  return true;
}

bool Strangers::is_one_too_many(const Place& wrong, const Now& now) {
  if (!wrong.address.empty() && !address_wrong_logins_.take(wrong.address, wrong.share, now.steady))
    return true;
  return !wrong_logins_.take(now.steady);
}

std::optional<Authenticated> Strangers::take_due(const Now& now) {
  for (auto& [connection, place] : places_)
    if (place.answer && place.due <= now.steady) return std::exchange(place.answer, std::nullopt);
  return std::nullopt;
}

void Strangers::take_changes(const IdentitiesChanged& changed) {
  for (auto& [connection, place] : places_) {
    if (!place.answer || !place.answer->identity) continue;
    auto& identity = place.answer->identity;
    const std::string credential = identity->credential;
    if (credential.empty()) continue;
    for (const auto& change : changed.changes)
      if (change.credential == credential) identity = change.identity;
    if (!identity) place.answer->reason = "the login method withdrew it";
  }
}

// ---- time

void Strangers::on_time(const Now& now) {
  for (auto& [connection, place] : places_) place.connection->on_time(now);
}

std::optional<ConnectionId> Strangers::failed() const {
  for (const auto& [connection, place] : places_)
    if (place.connection->failure()) return connection;
  return std::nullopt;
}

std::optional<TimePoint> Strangers::deadline() const {
  std::optional<TimePoint> first;
  for (const auto& [connection, place] : places_) {
    first = earliest(first, place.connection->deadline());
    if (place.answer) first = earliest(first, place.due);
  }
  return first;
}

StrangersStatus Strangers::status() const {
  StrangersStatus status = counts_;
  status.waiting = places_.size();
  return status;
}

}  // namespace connect_bridge
