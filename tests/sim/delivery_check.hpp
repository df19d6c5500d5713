// Checks what mirrors publish: only messages that were published, with a right, in order, once.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "sim/label.hpp"
#include "sim/ledger.hpp"

namespace connect_bridge::sim {

class DeliveryCheck {
 public:
  // `overlaps`: two bridges may mirror the same origin for a moment.
  DeliveryCheck(const Ledger& ledger, bool overlaps) : ledger_(ledger), overlaps_(overlaps) {}

  void on_publish(const Host& host, const Host::MirrorInfo& mirror, ByteView message);
  void on_delivery(const Reader& reader, const Writer& mirror, const Sample& sample);

  // Which origin a mirror has published for; nullopt: none yet.
  [[nodiscard]] std::optional<int> origin_of(int mirror_writer) const;
  // The counters of `origin` that reached `reader`, as they came.
  [[nodiscard]] const std::vector<std::uint64_t>& received(int reader, int origin) const;
  // Of those between the first and the last of them that did not reach it.
  struct Missing {
    std::uint64_t published = 0;    // by a mirror in its graph all the same
    std::uint64_t unpublished = 0;  // the others
  };
  [[nodiscard]] Missing missing(int reader, int origin) const;
  // What the ledger and the middleware have forgotten.
  void forget();
  [[nodiscard]] std::uint64_t published() const { return published_; }
  [[nodiscard]] std::uint64_t delivered() const { return delivered_; }

 private:
  struct Last {
    int origin = 0;
    std::uint64_t counter = 0;
  };
  void check_source(const Host& host, const Host::MirrorInfo& mirror, const Label& label) const;
  void check_late(const Host& host, const Host::MirrorInfo& mirror, const Label& label) const;
  [[nodiscard]] bool is_young(const Host& host, const Label& label,
                              const Treatment& treatment) const;

  const Ledger& ledger_;
  bool overlaps_;
  std::unordered_map<int, Last> by_mirror_;                             // at publication
  std::map<std::pair<int, int>, std::uint64_t> by_match_;               // (reader, mirror)
  std::map<std::pair<int, int>, std::vector<std::uint64_t>> received_;  // (reader, origin)
  std::map<std::pair<int, int>, std::uint64_t> newest_;                 // (reader, origin)
  std::map<std::pair<int, int>, std::set<std::uint64_t>> by_mirrors_;   // (graph, origin)
  std::uint64_t published_ = 0;
  std::uint64_t delivered_ = 0;
};

}  // namespace connect_bridge::sim
