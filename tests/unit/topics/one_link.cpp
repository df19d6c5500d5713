#include "unit/topics/one_link.hpp"

#include "core/compress/compress.hpp"

#include <memory>
#include <utility>
#include <variant>

#include "unit/link/script.hpp"

namespace connect_bridge::topics_test {

Now ms(std::int64_t at) {
  return flow_test::now_ms(at);
}

OneLink::OneLink(std::uint32_t n, std::shared_ptr<Account> account, Duration resume_for)
    : link({n}, *this, std::move(account), resume_for) {
  connect();
}

OneLink::~OneLink() = default;

void OneLink::connect(std::int64_t at) {
  connect(link_test::options(false), at);
}

void OneLink::connect(const ConnectionOptions& options, std::int64_t at) {
  const std::uint64_t n = link.id.value;
  auto connection =
      std::make_unique<Connection>(options, ConnectionId{n}, "10.0.0." + std::to_string(n), ms(at));
  while (connection->next_packet(ms(at))) {
  }
  const auto welcome = encode(link_test::a_welcome(static_cast<std::uint8_t>(100 + n)));
  connection->on_packet(false, Payload::copy_of(welcome), ms(at));
  link.opened(std::move(connection), ms(at));
  link.accepts.adopt(Accepts{{{{"/**"}, {}, {"/**"}, {"/**"}, {"/**"}}}, {}});
}

void OneLink::lose(std::int64_t at) {
  link.lose(Loss::kBreak, ms(at));
  link.drop_connection();
}

void OneLink::show_round_trip(std::int64_t round_trip_ms) {
  Outbox& outbox = link.sending();
  outbox.add_channel({99}, {});
  outbox.push({99}, flow_test::message(20'000), ms(50 - round_trip_ms));
  while (outbox.next(ms(50 - round_trip_ms))) {
  }
  EXPECT_TRUE(outbox.acknowledge({outbox.unacknowledged_bytes(), 1}, ms(50)));
}

std::string OneLink::said(std::int64_t at) {
  std::string lines;
  while (const auto packet = link.connection()->next_packet(ms(at)))
    if (const std::string line = line_of(*packet); !line.empty()) lines += line + "\n";
  return lines;
}

std::string Actions::did() {
  std::string lines;
  while (const auto action = outputs.next()) {
    if (const auto* log = std::get_if<Log>(&*action)) logged += log->text + "\n";
    if (const auto* job = std::get_if<CompressJob>(&*action)) last_job = job->job;
    if (const auto* job = std::get_if<DecompressJob>(&*action)) last_job = job->job;
    if (const auto* job = std::get_if<EncodePicture>(&*action)) last_job = job->job;
    if (const auto* job = std::get_if<DecodePicture>(&*action)) last_job = job->job;
    if (const std::string word = word_of(*action); !word.empty()) lines += word + "\n";
  }
  return lines;
}

void Actions::finish(std::optional<Payload> result, std::int64_t at) {
  JobDone done{last_job, std::move(result)};
  jobs.on_done(done, ms(at));
}

bool Actions::takes(FollowUp what) {
  bool found = false;
  while (const auto next = outputs.take_follow_up(FollowUp::kClaim)) found = found || next == what;
  return found;
}

InMessage call_in(const std::shared_ptr<Bytes>& packet) {
  InMessage message;
  message.channel = {1};
  message.subject = CallId{1};
  message.raw_bytes = 2000;
  message.codec = Codec::kZstd;
  *packet = compress(Bytes(message.raw_bytes), {Codec::kZstd, 3}).value();
  message.body = Payload::wrap(packet, *packet);
  return message;
}

GraphView picture(const std::vector<Topic>& topics) {
  GraphChanged graph;
  for (const auto& t : topics) graph.topics.push_back(t);
  return GraphView(std::move(graph));
}

}  // namespace connect_bridge::topics_test
