// How the core reports input from a peer that is malformed or forbidden: by value, never by
// throwing.
#pragma once

#include <string>
#include <utility>
#include <variant>

#include "core/base/close_code.hpp"

namespace connect_bridge {

// Why a record, frame or message was refused. `code` ends the connection with that close code,
// `message` is one sentence for a person.
struct Error {
  CloseCode code = CloseCode::kMalformed;
  std::string message;
};

inline Error malformed(std::string message) {
  return {CloseCode::kMalformed, std::move(message)};
}

// A value or the reason why there is none.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}      // NOLINT: implicit
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT: implicit

  [[nodiscard]] bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  T& value() & { return std::get<0>(state_); }
  const T& value() const& { return std::get<0>(state_); }
  T&& value() && { return std::get<0>(std::move(state_)); }
  const Error& error() const { return std::get<1>(state_); }

 private:
  std::variant<T, Error> state_;
};

// Result<Nothing> is the outcome of something that can only succeed or fail.
struct Nothing {};

}  // namespace connect_bridge
