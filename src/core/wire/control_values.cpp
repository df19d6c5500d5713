#include "core/wire/control_values.hpp"

#include <array>
#include <string>
#include <utility>

#include "core/base/json.hpp"
#include "core/wire/control.hpp"

namespace connect_bridge {
namespace {

constexpr char kNoObject[] = "a control message is not a JSON object";

}  // namespace

// The parser's events, one after the other; false ends the parsing.
class ControlValues::Events final : public nlohmann::json_sax<Json> {
 public:
  explicit Events(ControlValues& into) : into_(into) {}

  [[nodiscard]] std::optional<Error>& error() { return error_; }

  bool null() override { return add({}); }
  bool boolean(bool value) override {
    return add({.type = ControlValue::Type::kBoolean, .number = value ? 1U : 0U});
  }
  bool number_unsigned(number_unsigned_t value) override {
    return add({.type = ControlValue::Type::kUnsigned, .number = value});
  }
  bool number_integer(number_integer_t) override {
    return add({.type = ControlValue::Type::kNumber});
  }
  bool number_float(number_float_t, const string_t&) override {
    return add({.type = ControlValue::Type::kNumber});
  }
  bool string(string_t& value) override {
    return add({.type = ControlValue::Type::kText, .text = keep(value)});
  }
  bool binary(binary_t&) override { return refuse(CloseCode::kMalformed, kNoObject); }

  bool start_object(std::size_t) override { return open(ControlValue::Type::kObject); }
  bool start_array(std::size_t) override { return open(ControlValue::Type::kList); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& name) override {
    if (++open_[depth_ - 1].members > kControlMembersMax)
      return refuse(CloseCode::kTooLarge, "an object of a control message has too many members");
    name_ = keep(name);
    return true;
  }

  bool parse_error(std::size_t, const std::string&, const Json::exception&) override {
    return refuse(CloseCode::kMalformed, kNoObject);
  }

 private:
  struct Open {
    std::size_t index = 0;    // in the list of values
    std::size_t members = 0;  // names that have come
  };

  bool refuse(CloseCode code, const char* why) {
    error_ = Error{code, why};
    return false;
  }

  std::string_view keep(const std::string& text) {
    const std::size_t at = into_.texts_.size();
    into_.texts_.insert(into_.texts_.end(), text.begin(), text.end());
    return {into_.texts_.data() + at, text.size()};
  }

  bool add(ControlValue value) {
    if (into_.values_.size() == kControlValuesMax)
      return refuse(CloseCode::kTooLarge, "a control message has too many values");
    value.name = std::exchange(name_, {});
    into_.values_.push_back(value);
    return true;
  }

  bool open(ControlValue::Type type) {
    if (depth_ == kControlDepthMax)
      return refuse(CloseCode::kTooLarge, "a control message is nested too deeply");
    if (!add({.type = type})) return false;
    open_[depth_++] = {into_.values_.size() - 1, 0};
    return true;
  }

  bool close() {
    const std::size_t at = open_[--depth_].index;
    into_.values_[at].size = static_cast<std::uint32_t>(into_.values_.size() - at);
    return true;
  }

  ControlValues& into_;
  std::optional<Error> error_;
  std::array<Open, kControlDepthMax> open_{};
  std::size_t depth_ = 0;
  std::string_view name_;  // of the value that comes next
};

Result<ControlValues> ControlValues::read(std::string_view text) {
  ControlValues values;
  values.texts_.reserve(text.size());  // without its escapes no text becomes longer
  Events events{values};
  Json::sax_parse(text, &events);
  if (events.error()) return *std::move(events.error());
  if (values.object().type != ControlValue::Type::kObject)
    return Error{CloseCode::kMalformed, kNoObject};
  return values;
}

}  // namespace connect_bridge
