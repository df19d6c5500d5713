#include "core/types/description_service.hpp"

#include <limits>
#include <utility>

#include "core/base/cdr.hpp"
#include "core/types/type_description.hpp"
#include "core/wire/control.hpp"
#include "core/wire/text.hpp"

namespace connect_bridge {
namespace {

// The first read that fails ends all others.
class Response {
 public:
  explicit Response(ByteView bytes) : reader_(bytes) {}

  std::optional<TypeDescription> description() {
    const bool known = number<std::uint8_t>(reader_.u8()) == 1;
    static_cast<void>(text());  // why it is not
    if (!known) return std::nullopt;
    TypeDescription read;
    read.type = type();
    const auto count = number<std::uint32_t>(reader_.u32());
    if (count > kDescribedTypesMax) return std::nullopt;
    for (std::uint32_t i = 0; i < count && good_; ++i) read.nested.push_back(type());
    return good_ ? std::optional{std::move(read)} : std::nullopt;
  }

 private:
  template <class To, class From>
  To number(std::optional<From> value) {
    good_ = good_ && value && *value <= std::numeric_limits<To>::max();
    return good_ ? static_cast<To>(*value) : To{};
  }

  std::string text() {
    const auto value = reader_.string();
    good_ = good_ && value;
    return good_ ? std::string{*value} : std::string{};
  }

  DescribedType type() {
    DescribedType read{text(), {}};
    const auto count = number<std::uint32_t>(reader_.u32());
    fields_ += count;
    // Before the loop: the number is a node's word, of which each one costs memory.
    good_ = good_ && count <= kDescribedFieldsMax && fields_ <= kDescribedFieldsMax;
    for (std::uint32_t i = 0; i < count && good_; ++i) read.fields.push_back(field());
    return read;
  }

  DescribedField field() {
    DescribedField read{text()};
    const auto id = number<std::uint8_t>(reader_.u8());
    // A number that is no kind is not refused here: the text that is made of it has not the hash
    // that was asked for, or parse_description() refuses it.
    read.kind = static_cast<FieldKind>(id % kFieldShapeStep);
    read.shape = static_cast<FieldShape>(id / kFieldShapeStep);
    read.capacity = number<std::uint32_t>(reader_.u64());
    read.string_capacity = number<std::uint32_t>(reader_.u64());
    read.nested = text();
    static_cast<void>(text());  // the default value
    return read;
  }

  CdrReader reader_;
  std::size_t fields_ = 0;
  bool good_ = true;
};

void write(CdrWriter& to, const DescribedType& type) {
  to.string(type.name).u32(static_cast<std::uint32_t>(type.fields.size()));
  for (const auto& field : type.fields) {
    const auto shape = kFieldShapeStep * static_cast<unsigned>(field.shape);
    to.string(field.name).u8(static_cast<std::uint8_t>(static_cast<unsigned>(field.kind) + shape));
    to.u64(field.capacity).u64(field.string_capacity).string(field.nested);
    to.string("");  // the default value
  }
}

void write_source(CdrWriter& to, const DescribedType& type) {
  to.string(type.name).string("dynamic").string("");
}

}  // namespace

Payload description_request(std::string_view type, std::string_view hash) {
  return CdrWriter{}.string(type).string(hash).u8(0).take();
}

std::optional<std::string> text_of_response(ByteView response) {
  const auto read = Response(response).description();
  if (!read) return std::nullopt;
  std::string text = canonical_text(*read);
  if (text.size() > kDescriptionBytesMax || !is_text(text)) return std::nullopt;
  return text;
}

std::optional<DescriptionRequest> read_description_request(ByteView request) {
  CdrReader reader(request);
  const auto type = reader.string();
  const auto hash = reader.string();
  const auto with_sources = reader.u8();
  if (!with_sources) return std::nullopt;
  return DescriptionRequest{std::string{*type}, std::string{*hash}, *with_sources != 0};
}

Payload description_response(const TypeDescription& description, bool with_sources) {
  CdrWriter to;
  to.u8(1).string("");
  write(to, description.type);
  to.u32(static_cast<std::uint32_t>(description.nested.size()));
  for (const auto& nested : description.nested) write(to, nested);
  to.u32(with_sources ? static_cast<std::uint32_t>(1 + description.nested.size()) : 0);
  if (with_sources) {
    write_source(to, description.type);
    for (const auto& nested : description.nested) write_source(to, nested);
  }
  return to.u32(0).take();  // nothing else
}

Payload description_refusal(std::string_view why) {
  CdrWriter to;
  to.u8(0).string(why);
  write(to, {});
  return to.u32(0).u32(0).u32(0).take();
}

}  // namespace connect_bridge
