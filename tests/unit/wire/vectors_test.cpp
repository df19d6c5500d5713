// tests/vectors in both directions: what they say is what we read and what we write.
#include "unit/wire/vectors.hpp"

#include <gtest/gtest.h>

#include "core/compress/compress.hpp"
#include "core/media/sample_codec.hpp"
#include "core/wire/control.hpp"
#include "core/wire/frame.hpp"
#include "core/wire/login.hpp"

namespace connect_bridge {
namespace {

constexpr const char* kCodecWords[] = {"none",          "lz4",        "zstd",
                                       "zstd_base",     "zstd_delta", "picture_base",
                                       "picture_delta", "cloud",      "planes"};

Json json_of(const MessageFrame& frame) {
  return {{"type", "message"},
          {"codec", kCodecWords[static_cast<std::size_t>(frame.codec)]},
          {"channel", frame.channel.value},
          {"origin", frame.subject.value},
          {"sequence", frame.sequence},
          {"demand", frame.demand},
          {"stamp_ns", frame.stamp},
          {"number", frame.number},
          {"raw_bytes", frame.raw_bytes},
          {"body_bytes", frame.body_bytes},
          {"part", to_hex(frame.part)}};
}
Json json_of(const PartFrame& frame) {
  return {{"type", "part"},
          {"abort", frame.abort},
          {"channel", frame.channel.value},
          {"part", to_hex(frame.part)}};
}
Json json_of(const AckFrame& frame) {
  return {{"type", "ack"}, {"received_bytes", frame.received_bytes}, {"arrived", frame.arrived}};
}
Json json_of(const TextsFrame& frame) {
  return {{"type", "texts"},
          {"kept", frame.kept},
          {"raw_bytes", frame.raw_bytes},
          {"body", to_hex(frame.body)}};
}
Json json_of(const AckRequest&) {
  return {{"type", "ack_request"}};
}
Json json_of(const TimeRequest& frame) {
  return {{"type", "time_request"}, {"t1", frame.t1}};
}
Json json_of(const TimeReply& frame) {
  return {{"type", "time_reply"},
          {"t1", frame.t1},
          {"t2", frame.t2},
          {"t3", frame.t3},
          {"ros", frame.ros}};
}

ByteView part_of(const Frame& frame) {
  if (const auto* message = std::get_if<MessageFrame>(&frame)) return message->part;
  if (const auto* part = std::get_if<PartFrame>(&frame)) return part->part;
  if (const auto* texts = std::get_if<TextsFrame>(&frame)) return texts->body;
  return {};
}

TEST(Vectors, PacketsAreReadAndWrittenAsTheySay) {
  for (const auto& vector : read_vectors("packets.json")) {
    SCOPED_TRACE(vector.at("name").get<std::string>());
    const Bytes packet = from_hex(vector.at("hex").get<std::string>());
    Json frames = Json::array();
    Bytes written;
    FrameReader reader{packet};
    for (;;) {
      const auto next = reader.next();
      ASSERT_TRUE(next.ok()) << next.error().message;
      if (!next.value()) break;
      frames.push_back(std::visit([](const auto& frame) { return json_of(frame); }, *next.value()));
      append_header(*next.value(), written);
      const ByteView part = part_of(*next.value());
      written.insert(written.end(), part.begin(), part.end());
    }
    EXPECT_EQ(frames, vector.at("frames"));
    EXPECT_EQ(to_hex(written), to_hex(packet));
  }
}

Json json_of(const Hello& hello) {
  return {{"version_min", hello.version_min},
          {"version_max", hello.version_max},
          {"side", to_hex(hello.side.bytes)},
          {"session", to_hex(hello.session.bytes)},
          {"node", hello.node}};
}
Json json_of(const Login& login) {
  return {{"method", login.method}, {"credential", to_hex(login.credential)}};
}
Json json_of(const Welcome& welcome) {
  return {{"version", welcome.version},
          {"side", to_hex(welcome.side.bytes)},
          {"session", to_hex(welcome.session.bytes)},
          {"dead_after_ms", welcome.dead_after_ms},
          {"message_bytes_max", welcome.message_bytes_max},
          {"node", welcome.node},
          {"identity", welcome.identity}};
}

template <class Record>
void expect_both_directions(const Result<Record>& record, const Json& vector) {
  ASSERT_TRUE(record.ok()) << record.error().message;
  EXPECT_EQ(json_of(record.value()), vector.at("fields"));
  EXPECT_EQ(to_hex(encode(record.value())), vector.at("hex"));
}

TEST(Vectors, LoginRecordsAreReadAndWrittenAsTheySay) {
  for (const auto& vector : read_vectors("records.json")) {
    SCOPED_TRACE(vector.at("name").get<std::string>());
    const Bytes bytes = from_hex(vector.at("hex").get<std::string>());
    const auto record = vector.at("record").get<std::string>();
    if (record == "hello") expect_both_directions(decode_hello(bytes), vector);
    if (record == "login") expect_both_directions(decode_login(bytes), vector);
    if (record == "welcome") expect_both_directions(decode_welcome(bytes), vector);
  }
}

TEST(Vectors, ControlMessagesAreReadAndWrittenAsTheySay) {
  for (const auto& vector : read_vectors("control.json")) {
    SCOPED_TRACE(vector.at("name").get<std::string>());
    const auto text = vector.at("text").get<std::string>();
    const auto message = decode_control(text);
    ASSERT_TRUE(message.ok()) << message.error().message;
    EXPECT_EQ(encode(message.value()), text);
  }
}

TEST(Vectors, CompressedBodiesAreReadAsTheySay) {
  for (const auto& vector : read_vectors("compression.json")) {
    const std::string codec = vector.at("codec");
    const Bytes raw = from_hex(vector.at("raw").get<std::string>());
    const Bytes body = from_hex(vector.at("body").get<std::string>());
    const Bytes base = from_hex(vector.value("base", ""));
    const auto out = codec == "lz4"      ? decompress(body, Codec::kLz4, raw.size())
                     : codec == "zstd"   ? decompress(body, Codec::kZstd, raw.size())
                     : codec == "cloud"  ? media::decode_sample(body, Codec::kCloud, raw.size())
                     : codec == "planes" ? media::decode_sample(body, Codec::kPlanes, raw.size())
                                         : decompress_delta(body, base, raw.size());
    ASSERT_TRUE(out.ok()) << out.error().message;
    EXPECT_EQ(out.value(), raw);
  }
}

// The first error of a packet or record, or nullopt.
std::optional<Error> error_of(const std::string& kind, ByteView bytes) {
  const auto error = [](const auto& result) {
    return result.ok() ? std::nullopt : std::optional<Error>{result.error()};
  };
  if (kind == "hello") return error(decode_hello(bytes));
  if (kind == "login") return error(decode_login(bytes));
  if (kind == "welcome") return error(decode_welcome(bytes));
  FrameReader reader{bytes};
  for (;;) {
    const auto next = reader.next();
    if (!next.ok()) {
      EXPECT_FALSE(reader.next().ok()) << "an error must stay";
      return next.error();
    }
    if (!next.value()) return std::nullopt;
  }
}

TEST(Vectors, MalformedBytesAreRefusedWithTheCodeTheySay) {
  for (const auto& vector : read_vectors("malformed.json")) {
    const auto kind = vector.at("kind").get<std::string>();
    SCOPED_TRACE(kind + ": " + vector.at("name").get<std::string>());
    const auto error = error_of(kind, from_hex(vector.at("hex").get<std::string>()));
    ASSERT_TRUE(error.has_value());
    EXPECT_EQ(static_cast<int>(error->code), vector.at("close").get<int>()) << error->message;
    EXPECT_FALSE(error->message.empty());
  }
}

TEST(Vectors, MalformedControlMessagesAreRefusedWithTheCodeTheySay) {
  for (const auto& vector : read_vectors("malformed_control.json")) {
    SCOPED_TRACE(vector.at("name").get<std::string>());
    const auto message = decode_control(vector.at("text").get<std::string>());
    ASSERT_FALSE(message.ok());
    EXPECT_EQ(static_cast<int>(message.error().code), vector.at("close").get<int>())
        << message.error().message;
    EXPECT_FALSE(message.error().message.empty());
  }
}

}  // namespace
}  // namespace connect_bridge
