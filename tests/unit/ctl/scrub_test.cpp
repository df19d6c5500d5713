#include "ctl/scrub.hpp"

#include <gmock/gmock.h>

#include <chrono>

#include "config/key_table.hpp"

namespace connect_bridge {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string scrubbed(std::string_view text, const ParameterMap& parameters = {}) {
  Scrubber scrubber;
  scrubber.learn(parameters);
  return scrubber.scrubbed(text);
}

TEST(Scrub, TheValueOfEverySecretKeyGoesWhereverItStands) {
  std::size_t found = 0;
  for (const KeySpec& spec : key_table()) {
    if (!spec.secret) continue;
    ++found;
    const std::string secret = "user" + std::to_string(found) + ":a password/" + spec.key;
    const ParameterMap given{{spec.key, secret}};
    const std::string text = scrubbed("the log says '" + secret + "'; again: " + secret, given);
    EXPECT_EQ(text, "the log says '(hidden)'; again: (hidden)");
    EXPECT_THAT(scrubbed("alone: " + secret.substr(secret.find(':') + 1), given),
                Not(HasSubstr("password")));
    EXPECT_EQ(parameters_to_show(given), spec.key + ": (hidden)\n");
  }
  EXPECT_EQ(found, 3U) << "of the table of keys";
}

TEST(Scrub, AMisspelledKeyHidesItsValueToo) {
  const ParameterMap given{{"auth.tokn", "correct-horse"}, {"use_sim_time", true}};
  EXPECT_EQ(parameters_to_show(given), "auth.tokn: (hidden)\nuse_sim_time: true\n");
  EXPECT_EQ(scrubbed("it was correct-horse", given), "it was (hidden)");
}

TEST(Scrub, EachWordOfASecretIsOne) {
  const ParameterMap given{
      {"auth.plugin_options", "user=anna password=hunter-two; key: 'abc-def'"}};
  EXPECT_EQ(scrubbed("hunter-two, abc-def, anna", given), "(hidden), (hidden), anna");
  EXPECT_EQ(scrubbed("correct or horses", {{"auth.token", "correct horses"}}),
            "(hidden) or (hidden)");
}

TEST(Scrub, ThePasswordAndTheQueryOfAnAddressGoToo) {
  const ParameterMap given{{"url", "wss://anna:hunter-two@robot.example/?key=of-the-query&n=1"}};
  EXPECT_EQ(scrubbed("hunter-two, of-the-query, anna, robot.example, n", given),
            "(hidden), (hidden), anna, robot.example, n");
}

TEST(Scrub, WhatLooksLikeASecret) {
  EXPECT_EQ(scrubbed("wss://anna:p@ss@robot.example:9090/?key=abc, then"),
            "wss://(hidden)@robot.example:9090/?(hidden), then");
  EXPECT_EQ(scrubbed("https://a.example/b?k=the-secret&more=x", {{"auth.token", "the-secret"}}),
            "https://a.example/b?(hidden)");
  EXPECT_EQ(scrubbed("'wss+pair://robot.example:9090#0123.abcd' and wss+relay://r#s"),
            "'wss+pair://robot.example:9090#(hidden)' and wss+relay://r#(hidden)");
  EXPECT_EQ(scrubbed("Authorization: Bearer abc.def\nnext"),
            "Authorization: Bearer (hidden)\nnext");
  EXPECT_EQ(scrubbed("token eyJhbGciOiJIUzI1NiJ9.eyJzdWIiOiJhIn0.c2ln-_x!"), "token (hidden)!");
  EXPECT_EQ(scrubbed("a\n-----BEGIN EC PRIVATE KEY-----\nMHcCAQ\n-----END EC PRIVATE KEY-----\nb"),
            "a\n(hidden)\nb");
  EXPECT_EQ(scrubbed("-----BEGIN PRIVATE KEY-----\nMHcCAQ cut"), "(hidden)");
  EXPECT_EQ(scrubbed("CONNECT_BRIDGE_TOKEN=abc run"), "CONNECT_BRIDGE_TOKEN=(hidden) run");
  EXPECT_EQ(scrubbed("-p auth.token:=abc -p listen.port:=1"),
            "-p auth.token:=(hidden) -p listen.port:=1");
}

TEST(Scrub, APasswordMayHaveSignsThatEndAWord) {
  EXPECT_EQ(scrubbed("by http://user:pa,s)s}@proxy:3128, then anna@desk"),
            "by http://(hidden)@proxy:3128, then anna@desk");
}

TEST(Scrub, KeysOfRosAreNoMistakes) {
  EXPECT_EQ(scrubbed("the depth is keep_last", {{"qos_overrides./t.history", "keep_last"}}),
            "the depth is keep_last");
}

// A log may be one line of addresses.
TEST(Scrub, ALongTextTakesNoLongerForEachOfItsAddresses) {
  std::string text;
  while (text.size() < 4'000'000) text += "ws://h ";
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(scrubbed(text), text);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
}

TEST(Scrub, WhatIsNoSecretStays) {
  const std::string text =
      "tls.pin: [\"47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU= desk ops\"], anna@desk, "
      "RIHS01_5a8a36efb05fb250, -----BEGIN CERTIFICATE-----\nMII\n-----END CERTIFICATE-----, "
      "ws://127.0.0.1:9090/, http://[::1]:1/a";
  EXPECT_EQ(scrubbed(text), text);
}

TEST(Scrub, AShortSecretTakesNothingElse) {
  EXPECT_EQ(scrubbed("a port", {{"auth.token", "a"}}), "a port");
}

}  // namespace
}  // namespace connect_bridge
