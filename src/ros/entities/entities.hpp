// The entities of one kind, by the ids that the core chose for them.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>

#include "core/base/check.hpp"
#include "ros/entities/shared.hpp"

namespace connect_bridge::ros {

// T is constructed from Shared and T::Create, the action of the core. T::open() returns a refusal
// if the entity cannot exist; this is reported as an EntityFailed. Thread: the loop's.
template <class T>
class Entities {
 public:
  using Id = decltype(T::Create::id);

  explicit Entities(Shared& shared) : shared_(shared) {}

  // True if the entity exists now.
  bool create(const typename T::Create& action) {
    auto made = std::make_unique<T>(shared_, action);
    auto refusal = made->open();
    // An ended entity may be in its way: a process of Fast DDS can have only one type for a topic.
    if (refusal && shared_.ended.free(name_of(action))) {
      made.reset();
      made = std::make_unique<T>(shared_, action);
      refusal = made->open();
    }
    made->set_name(name_of(action));
    if (refusal) {
      shared_.report(EntityFailed<Id>{action.id, std::move(refusal->code),
                                      std::move(refusal->reason), std::move(refusal->hash_here)});
      return false;
    }
    const bool is_new = entities_.emplace(action.id, std::move(made)).second;
    CONNECT_CHECK(is_new);
    return true;
  }
  // Ends the entity: it is silent at once, and leaves the graph when its turn comes (Ended). False:
  // there was none.
  bool destroy(Id id) {
    auto found = entities_.extract(id);
    if (!found) return false;
    shared_.ended.add(std::move(found.mapped()));
    shared_.ready.wake();
    return true;
  }
  // nullptr: there is no entity with this id.
  [[nodiscard]] T* find(Id id) const {
    const auto found = entities_.find(id);
    return found == entities_.end() ? nullptr : found->second.get();
  }

  [[nodiscard]] std::size_t size() const { return entities_.size(); }
  [[nodiscard]] auto begin() const { return entities_.begin(); }
  [[nodiscard]] auto end() const { return entities_.end(); }

 private:
  static const std::string& name_of(const typename T::Create& action) {
    if constexpr (requires { action.topic; }) {
      return action.topic;
    } else {
      return action.service;
    }
  }

  Shared& shared_;
  std::unordered_map<Id, std::unique_ptr<T>> entities_;
};

}  // namespace connect_bridge::ros
