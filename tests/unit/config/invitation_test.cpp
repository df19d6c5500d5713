#include "config/invitation.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

using testing::HasSubstr;

constexpr char kOneLine[] =
    "wss+pair://robot.local:9090/"
    "#00112233445566778899aabbccddeeff.47DEQpj8HBSa-_TImW-5JCeuQeRkm5NMpJWZG3hSuFU";

TEST(Invitation, IsReadAsItWasWritten) {
  std::string problem;
  const Invitation read = parse_invitation(kOneLine, problem);
  EXPECT_EQ(problem, "");
  EXPECT_EQ(read.url, "wss://robot.local:9090/");
  EXPECT_EQ(read.code, "00112233445566778899aabbccddeeff");
  EXPECT_EQ(read.pin, "47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU=");
  EXPECT_EQ(to_text(read), kOneLine);
  EXPECT_FALSE(read.invites_robot);
  const std::string of_operator = kOneLine + std::string{".robot"};
  EXPECT_TRUE(parse_invitation(of_operator, problem).invites_robot);
  EXPECT_EQ(to_text(parse_invitation(of_operator, problem)), of_operator);
}

TEST(Invitation, APartOfOneIsRefusedWithoutTheCode) {
  const std::string line = kOneLine;
  for (const std::string& wrong :
       {std::string{}, std::string{"wss"}, std::string{"wss+pair://"},
        std::string{"wss+pair://robot.local:9090/"}, line.substr(0, line.size() - 1), line + "A",
        std::string{"wss+pair://a b/"} + line.substr(28),
        std::string{"wss+pair://user:word@robot/"} + line.substr(28)}) {
    std::string problem;
    static_cast<void>(parse_invitation(wrong, problem));
    EXPECT_THAT(problem, HasSubstr("the invitation is not complete")) << wrong;
    EXPECT_THAT(problem, testing::Not(HasSubstr("0011"))) << wrong;
  }
}

TEST(Invitation, ARelaysLineIsReadAsItWasWritten) {
  const std::string line = "wss+relay://robot7@relay.example:443/#" + std::string(64, 'a') +
                           ".47DEQpj8HBSa-_TImW-5JCeuQeRkm5NMpJWZG3hSuFU";
  std::string problem;
  const Invitation read = parse_relay_line(line, problem);
  EXPECT_EQ(problem, "");
  EXPECT_EQ(read.url, "wss://robot7@relay.example:443/");
  EXPECT_EQ(to_relay_line(read), line);
  std::string nobody = line;
  for (const std::string& wrong : {line + "A", nobody.replace(12, 7, ""), std::string{kOneLine}}) {
    problem.clear();
    static_cast<void>(parse_relay_line(wrong, problem));
    EXPECT_THAT(problem, HasSubstr("the registration command is not complete")) << wrong;
  }
}

}  // namespace
}  // namespace connect_bridge
