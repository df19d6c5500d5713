#include "ctl/status_text.hpp"

#include <string>

namespace connect_bridge {
namespace {

// Counts values and depth; false ends the scan. A tree is built and freed by recursion, so its
// depth must be bounded first.
class Measure final : public nlohmann::json_sax<Json> {
 public:
  bool null() override { return add(); }
  bool boolean(bool) override { return add(); }
  bool number_integer(number_integer_t) override { return add(); }
  bool number_unsigned(number_unsigned_t) override { return add(); }
  bool number_float(number_float_t, const string_t&) override { return add(); }
  bool string(string_t&) override { return add(); }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(); }
  bool start_array(std::size_t) override { return open(); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(string_t&) override { return true; }
  bool parse_error(std::size_t, const std::string&, const Json::exception&) override {
    return false;
  }

 private:
  bool add() { return ++values_ <= kStatusValuesMax; }
  bool open() { return ++depth_ <= kStatusDepthMax && add(); }
  bool close() {
    --depth_;
    return true;
  }

  std::size_t depth_ = 0;
  std::size_t values_ = 0;
};

template <class Kind>
Kind read(std::string_view text) {
  Measure measure;
  if (text.size() > kStatusBytesMax || !Json::sax_parse(text, &measure)) return nullptr;
  Kind status = Kind::parse(text, nullptr, false);
  return status.is_object() ? std::move(status) : Kind(nullptr);
}

}  // namespace

Json read_status(std::string_view text) {
  return read<Json>(text);
}

OrderedJson read_status_in_order(std::string_view text) {
  return read<OrderedJson>(text);
}

}  // namespace connect_bridge
