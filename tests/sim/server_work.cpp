#include "sim/server_work.hpp"

#include <algorithm>
#include <utility>

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kServerDepth = 10;
// What others did goes on to have effect for as long as an exporter is patient.
constexpr Duration kAfterEffect = 6s;

}  // namespace

void ServerWork::on_request(const Servant& servant, RequestKey key, const Payload& payload) {
  Desk& desk = desks_.at(servant.id);
  desk.queue.push_back({key, payload});
  if (desk.queue.size() > kServerDepth) lose_oldest(servant, desk);
  if (desk.queue.size() == kServerDepth && !is_shared(desk, key.caller)) {
    check_.on_full_queue(services_.caller(key.caller));
  }
  look(servant.id);
}

bool ServerWork::is_shared(const Desk& desk, int caller) const {
  const bool waits = std::any_of(desk.queue.begin(), desk.queue.end(), [&](const Request& request) {
    return request.key.caller != caller;
  });
  return waits || std::any_of(desk.left.begin(), desk.left.end(), [&](const auto& entry) {
           return entry.first != caller && entry.second + kAfterEffect > schedule_.now();
         });
}

bool ServerWork::has_double(const Servant& servant) const {
  return services_.servants().any([&](const Servant& other) {
    return other.id != servant.id && other.spec.host < 0 &&
           other.spec.graph == servant.spec.graph && other.spec.topic == servant.spec.topic &&
           (other.alive || other.destroyed + kAfterEffect > schedule_.now());
  });
}

void ServerWork::lose_oldest(const Servant& servant, Desk& desk) {
  const Request& lost = desk.queue.front();
  check_.on_lost(services_.caller(lost.key.caller), servant, lost.key,
                 is_shared(desk, lost.key.caller) || has_double(servant));
  desk.left[lost.key.caller] = schedule_.now();
  desk.queue.pop_front();
}

// It is not read for less than the exporter's patience, and not again before it was empty.
void ServerWork::look(int servant) {
  Desk& desk = desks_.at(servant);
  if (!services_.servant(servant).alive) return;
  while (!desk.queue.empty()) {
    if (!calm_ && (desk.working || schedule_.now() < desk.away_until)) return;
    if (!calm_ && desk.rested && rng_.chance(desk.plan->away_permille)) {
      desk.rested = false;
      desk.away_until = schedule_.now() + rng_.between(1ms, desk.plan->away_max);
      schedule_.at(desk.away_until, [this, servant] { look(servant); });
      return;
    }
    take(servant, desk);
  }
  desk.rested = true;
}

void ServerWork::take(int servant, Desk& desk) {
  const Request request = desk.queue.front();
  desk.queue.pop_front();
  desk.left[request.key.caller] = schedule_.now();
  const ServicePlan& plan = *desk.plan;
  const Servant& who = services_.servant(servant);
  const std::uint64_t number = ++last_work_;
  working_[number] = {servant, request.key,
                      check_.on_executed(services_, who, request.key, request.payload),
                      static_cast<std::size_t>(rng_.between(32, plan.bytes_max)), schedule_.now()};
  if (!calm_ && rng_.chance(plan.never_permille)) return;
  Duration work = calm_work_;
  if (!calm_) {
    work = rng_.between(Duration{10us}, plan.work_max);
    if (plan.one_by_one) work /= 4;
    desk.working = plan.one_by_one;
  }
  schedule_.after(work, [this, number] { give(number); });
}

void ServerWork::give(std::uint64_t work) {
  const auto found = working_.extract(work);
  if (found.empty()) return;
  const Answer& answer = found.mapped();
  const Servant& servant = services_.servant(answer.servant);
  if (!servant.alive) return;
  Desk& desk = desks_.at(servant.id);
  auto payload = Payload::adopt(make_message(answer.label, answer.bytes, desk.plan->compressible));
  check_.on_answered(servant, answer.label, payload);
  services_.answer(servant.id, answer.key, payload);
  desk.working = false;
  look(servant.id);
}

void ServerWork::forget(TimePoint before) {
  std::erase_if(working_, [&](const auto& work) { return work.second.taken < before; });
  std::erase_if(desks_, [&](const auto& desk) {
    const Servant& servant = services_.servant(desk.first);
    return !servant.alive && servant.destroyed < before;
  });
  for (auto& [servant, desk] : desks_)
    std::erase_if(desk.left, [&](const auto& entry) { return entry.second < before; });
}

void ServerWork::calm() {
  calm_ = true;
  while (!working_.empty()) give(working_.begin()->first);
  for (const auto& [servant, desk] : desks_) look(servant);
}

}  // namespace connect_bridge::sim
