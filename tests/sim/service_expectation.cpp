#include "sim/service_expectation.hpp"

#include <algorithm>

namespace connect_bridge::sim {

bool ServiceExpectation::is_local(const Key& key) const {
  const std::vector<int> servants = crowd_.servants();
  return std::any_of(servants.begin(), servants.end(), [&](int id) {
    const EndpointSpec& spec = services_.servant(id).spec;
    return spec.graph == key.first && spec.topic == key.second.first &&
           spec.type == key.second.second;
  });
}

bool ServiceExpectation::can_be_taken(const EndpointSpec& spec) const {
  if (!middleware_.knows_type(spec.graph, spec.type)) return false;
  if (!is_of_action(spec.topic)) return true;
  const std::string action = spec.topic.substr(0, spec.topic.rfind("/_action/"));
  const std::vector<int> servants = crowd_.servants();
  return std::none_of(servants.begin(), servants.end(), [&](int id) {
    const EndpointSpec& part = services_.servant(id).spec;
    return part.graph == spec.graph && part.topic.starts_with(action + "/_action/") &&
           !middleware_.knows_type(part.graph, part.type);
  });
}

void ServiceExpectation::expect(const EndpointSpec& spec, bool service, const Host& importer,
                                std::map<Key, int>& into) const {
  if (importer.graph() == spec.graph || !importer.running()) return;
  if (!middleware_.knows_type(importer.graph(), spec.type)) return;
  if (!can_be_taken(spec)) return;
  for (const auto& peer : checker_.ledger().peers_of(importer)) {
    const Host& exporter = *peer.host;
    if (exporter.graph() != spec.graph || !exporter.running()) continue;
    const auto wire = exporter.plan().names.to_wire(spec.topic);
    if (!wire) continue;
    const auto treatment = service ? service_treatment_of : treatment_of;
    if (!treatment(exporter.policy(), Direction::kExport, *wire, spec.type, peer.sees_us) ||
        !treatment(importer.policy(), Direction::kImport, *wire, spec.type, peer.seen_as)) {
      continue;
    }
    const Key key{importer.graph(), {importer.plan().names.to_local(*wire), spec.type}};
    if (!service || !is_local(key)) into[key] += 1;
  }
}

std::map<ServiceExpectation::Key, int> ServiceExpectation::expected() const {
  std::map<Key, int> result;
  for (const int id : crowd_.servants()) {
    for (const auto& host : hosts_) expect(services_.servant(id).spec, true, *host, result);
  }
  for (auto& [key, count] : result) count = 1;  // however many servers and ways there are
  return result;
}

void ServiceExpectation::check_action_topics() const {
  std::map<Key, int> should, found;
  for (const int id : crowd_.action_writers()) {
    for (const auto& host : hosts_) expect(middleware_.writer(id).spec, false, *host, should);
  }
  for (const auto& host : hosts_) {
    for (const auto& [id, mirror] : host->mirrors()) {
      if (is_of_action(mirror.made.topic)) {
        ++found[{host->graph(), {mirror.made.topic, mirror.made.type}}];
      }
    }
  }
  for (const auto& [key, count] : should) found.try_emplace(key, 0);
  for (const auto& [key, count] : found) {
    checker_.ledger().coverage().count(Judged::kTruths);
    if ((count > 0) == should.contains(key)) continue;
    violated("graph " + std::to_string(key.first) + " has " + std::to_string(count) +
             " mirrors of " + key.second.first + ", expected " +
             (should.contains(key) ? "some" : "none"));
  }
}

void ServiceExpectation::check_mirrors() const {
  const auto should = expected();
  std::map<Key, int> found;
  for (const auto& host : hosts_) {
    for (const auto& [id, mirror] : host->service_mirrors()) {
      if (is_hostile(mirror.made.service)) continue;
      ++found[{host->graph(), {mirror.made.service, mirror.made.type}}];
    }
  }
  for (const auto& [key, count] : should) found.try_emplace(key, 0);
  for (const auto& [key, count] : found) {
    const auto it = should.find(key);
    const int wanted = it == should.end() ? 0 : it->second;
    checker_.ledger().coverage().count(Judged::kTruths);
    if (count == wanted) continue;
    violated("graph " + std::to_string(key.first) + " has " + std::to_string(count) +
             " mirrors of service " + key.second.first + ", expected " + std::to_string(wanted));
  }
}

void ServiceExpectation::check_nothing_pending() const {
  checker_.calls().check_nothing_pending(services_);
}

void ServiceExpectation::begin_calls() {
  called_before_.clear();
  for (const int id : crowd_.callers()) called_before_[id] = checker_.calls().called(id);
}

// Every call through a mirror reaches each server behind it once, and is answered once.
void ServiceExpectation::check_calls() const {
  const auto should = expected();
  CallCheck& calls = checker_.calls();
  if (calls.has_lost(services_)) return;  // others may wait behind them, for ever
  std::int64_t message_bytes_max = INT64_MAX;
  for (const auto& host : hosts_) {
    message_bytes_max = std::min<std::int64_t>(message_bytes_max,
                                               host->plan().options.reassembly.message_bytes_max);
  }
  for (const auto& [id, before] : called_before_) {
    const EndpointSpec& spec = services_.caller(id).spec;
    if (!should.contains({spec.graph, {spec.topic, spec.type}})) continue;
    if (crowd_.plan_of_caller(id).bytes_max > message_bytes_max) continue;  // refused
    for (std::uint32_t n = before + 1; n <= calls.called(id); ++n) {
      checker_.ledger().coverage().count(Judged::kQuietCalls);
      const int answers = calls.answers(id, n);
      if (answers == 1 && calls.executions(id, n) == 1) continue;
      violated("call " + std::to_string(n) + " of client " + std::to_string(id) + " to " +
               spec.topic + ", made when all was quiet, was executed " +
               std::to_string(calls.executions(id, n)) + " times and answered " +
               std::to_string(answers) + " times");
    }
  }
}

}  // namespace connect_bridge::sim
