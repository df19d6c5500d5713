// The given parameters, each checked against its row of the table.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "config/key_table.hpp"
#include "config/parameter.hpp"

namespace connect_bridge {

// Reading never fails: a key that is missing or wrong yields its default (or the zero of its type),
// so that the checks between keys can go on and find the other problems, too.
class CheckedValues {
 public:
  // Adds a problem for each key that is unknown, of the other role or wrong.
  CheckedValues(const ParameterMap& given, Role role, std::vector<Problem>& problems);

  // Given at all, right or wrong.
  [[nodiscard]] bool given(std::string_view key) const { return keys_.contains(key); }
  // Given and right.
  [[nodiscard]] bool valid(std::string_view key) const { return values_.contains(key); }

  [[nodiscard]] bool flag(std::string_view key) const;
  [[nodiscard]] std::int64_t whole(std::string_view key) const;
  [[nodiscard]] std::string text(std::string_view key) const;
  [[nodiscard]] std::vector<std::string> list(std::string_view key) const;

  // Writes each value, or its default, to the field of its row.
  void store(Config& config) const;
  void store(Rule& rule) const;  // by its name

  // The right ones, in the type of their row.
  [[nodiscard]] const ParameterMap& values() const { return values_; }
  // Names of the rules for which there is a key, right or wrong.
  [[nodiscard]] const std::set<std::string, std::less<>>& rules() const { return rules_; }

 private:
  template <class T>
  T read(std::string_view key) const;
  template <class Target>
  void store_in(Target& target, const std::string& rule) const;
  void check(const std::string& key, const ParameterValue& value, Role role,
             std::vector<Problem>& problems);

  ParameterMap values_;
  std::set<std::string, std::less<>> keys_;
  std::set<std::string, std::less<>> rules_;
};

// The value of a key without what may be secret; of a key that is not known, nothing.
[[nodiscard]] std::string shown_to_others(std::string_view key, const ParameterValue& value);

}  // namespace connect_bridge
