#include "access/login/token_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <thread>

#include "access/login/token_file.hpp"
#include "core/base/hex.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr char kAnna[] = "anna-0123456789abcdef";
constexpr char kBert[] = "bert-0123456789abcdef";

struct Reading {
  explicit Reading(const std::string& text, Stamp now = 0) {
    table.read(text, "f.yaml", now, problems, warnings);
  }
  [[nodiscard]] Judgement find(const std::string& token, Stamp now = 0) const {
    return table.find({reinterpret_cast<const std::uint8_t*>(token.data()), token.size()}, now);
  }
  TokenTable table;
  std::vector<std::string> problems;
  std::vector<std::string> warnings;
};

Digest digest_of_token(const std::string& token) {
  return sha256({reinterpret_cast<const std::uint8_t*>(token.data()), token.size()});
}

// An entry of the list, with `more` members ("groups: [ops]").
std::string entry(const std::string& name, const std::string& token, const std::string& more = {}) {
  return "- {identity: " + name + ", token_sha256: " + to_hex(digest_of_token(token)) +
         (more.empty() ? "" : ", " + more) + "}\n";
}

TEST(TokenTable, ReadsAList) {
  const Reading file(entry("anna", kAnna, "groups: [ops, night], comment: 'her laptop: the old'") +
                     "- identity: bert\n  token_sha256: "  // printf '' | sha256sum
                     "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855\n"
                     "  expires: 2027-01-31T12:00:00Z\n");
  EXPECT_THAT(file.problems, IsEmpty());
  EXPECT_FALSE(file.table.has_plain());
  const auto anna = file.find(kAnna);
  ASSERT_TRUE(anna.identity.has_value());
  EXPECT_EQ(anna.identity->name, "anna");
  EXPECT_THAT(anna.identity->groups, ElementsAre("ops", "night"));
  EXPECT_EQ(anna.identity->expires, 0);
  const auto bert = file.find("");  // the digest above is that of nothing
  ASSERT_TRUE(bert.identity.has_value());
  EXPECT_EQ(bert.identity->expires, 1801396800LL * 1'000'000'000);
  EXPECT_EQ(file.find(kBert).reason, "unknown token");
}

TEST(TokenTable, ReadsOneWordAsTheOnlyToken) {
  const Reading file(std::string(kAnna) + "\n");
  EXPECT_THAT(file.problems, IsEmpty());
  EXPECT_EQ(file.find(kAnna).identity.value().name, "token");
  EXPECT_TRUE(file.table.has_plain());
}

// A program may write the list as JSON without a blank.
TEST(TokenTable, AListIsNoToken) {
  const std::string list =
      R"([{"identity":"anna","token_sha256":")" + to_hex(digest_of_token(kAnna)) + R"("}])";
  const Reading file(list);
  EXPECT_FALSE(file.table.has_plain());
  EXPECT_FALSE(file.find(list).identity.has_value());
  EXPECT_EQ(file.find(kAnna).identity.has_value(), file.problems.empty());
}

TEST(TokenTable, ReportsAllProblemsWithTheirLines) {
  const Reading file(
      "- {identity: anna, token: 0123456789abcdef-ghij}\n"
      "- {identity: bert}\n" +
      entry("''", kAnna) +
      "- {identity: carl, token_sha256: 12, expires: 2027-02-30}\n"
      "- {identity: dora, tokn: x, groups: {a: b}}\n"
      "- word\n");
  EXPECT_THAT(
      file.problems,
      ElementsAre(StartsWith("f.yaml:1: a token does not stand here in plain text"),
                  "f.yaml:2: 'token_sha256' is missing", "f.yaml:3: identity: the name is empty",
                  HasSubstr("f.yaml:4: token_sha256"), HasSubstr("f.yaml:4: expires"),
                  HasSubstr("f.yaml:5: unknown key 'tokn'"), HasSubstr("f.yaml:5: groups"),
                  HasSubstr("f.yaml:6: an entry is a map")));
  for (const auto& problem : file.problems)
    EXPECT_THAT(problem, testing::Not(HasSubstr("0123456789abcdef")));
  EXPECT_EQ(file.table.size(), 0U);
}

TEST(TokenTable, ReportsWhatIsNoYamlWithoutShowingIt) {
  const Reading file(std::string("- {identity: anna, token: ") + kAnna + "\n- [");
  ASSERT_EQ(file.problems.size(), 1U);
  EXPECT_THAT(file.problems[0], HasSubstr("f.yaml:"));
  EXPECT_THAT(file.problems[0], testing::Not(HasSubstr("anna")));
}

TEST(TokenTable, RefusesTheSameTokenTwiceAndWeakOnes) {
  const Reading twice(entry("anna", kAnna) + entry("bert", kAnna));
  EXPECT_THAT(twice.problems, ElementsAre("f.yaml:2: the token of 'bert' is there twice"));
  EXPECT_THAT(Reading("").problems, ElementsAre("f.yaml: the token is empty"));
  EXPECT_THAT(Reading("fifteen-charact").problems, ElementsAre(HasSubstr("15 characters")));
}

TEST(TokenTable, RefusesAnExpiredToken) {
  const std::string text = entry("anna", kAnna, "expires: 2027-01-31");
  const Stamp end = parse_date("2027-01-31").value();
  const Reading early(text, end - 1);
  EXPECT_THAT(early.warnings, IsEmpty());
  EXPECT_TRUE(early.find(kAnna, end - 1).identity.has_value());
  EXPECT_EQ(early.find(kAnna, end).reason, "the token of 'anna' has expired");
  const Reading late(text, end);
  EXPECT_THAT(late.warnings, ElementsAre("f.yaml:1: the token of 'anna' has expired"));
  EXPECT_THAT(late.problems, IsEmpty());
}

TEST(TokenTable, TellsWhatAnotherTableChanges) {
  const std::string cora = "cora-0123456789abcdef";
  const Reading before(entry("anna", kAnna) + entry("bert", kBert) + entry("cora", cora));
  EXPECT_THAT(before.table.changes_to(before.table), IsEmpty());
  // Anna has a group, Bert's token is Ben's, Cora's is gone.
  const Reading after(entry("ben", kBert) + entry("anna", kAnna, "groups: [ops]"));
  const auto changes = before.table.changes_to(after.table);
  ASSERT_EQ(changes.size(), 3U);
  EXPECT_EQ(changes[0].credential, before.find(kAnna).identity->credential);
  EXPECT_THAT(changes[0].identity.value().groups, ElementsAre("ops"));
  EXPECT_EQ(changes[1].credential, before.find(kBert).identity->credential);
  EXPECT_FALSE(changes[1].identity.has_value());
  EXPECT_EQ(changes[2].credential, before.find(cora).identity->credential);
  EXPECT_FALSE(changes[2].identity.has_value());
  const Reading sooner(entry("anna", kAnna, "expires: 2027-01-31"));
  EXPECT_EQ(before.table.changes_to(sooner.table)[0].identity.value().expires,
            parse_date("2027-01-31"));
}

TEST(TokenTable, SurvivesStrangeYaml) {
  for (const char* text : {"{[a]: b, c: d}", "a: b: c", "&a [*a, *a]", "? x\n: - y\n",
                           "tokens: ~\nother: 1", "[[[[ ]]]] x", "!!binary | x y"}) {
    const Reading file(text);
    EXPECT_THAT(file.problems, testing::Not(IsEmpty())) << text;
  }
}

TEST(TokenTable, CommentsAloneAreNoEntryAndNoProblem) {
  const Reading file("# nobody yet\n");
  EXPECT_THAT(file.problems, IsEmpty());
  EXPECT_EQ(file.table.size(), 0U);
}

TEST(Date, KnowsTheCalendar) {
  EXPECT_EQ(parse_date("1970-01-02"), 86400LL * 1'000'000'000);
  EXPECT_TRUE(parse_date("2028-02-29").has_value());
  for (const char* wrong :
       {"", "2027", "2027-02-29", "2027-13-01", "2027-1-1", "27-01-01", "2027-01-31T24:00:00Z",
        "2027-01-31T12:00:00", "2027-01--1", "2027-01-31 12:00:00Z", "2027-01-31T12:00:00+"}) {
    EXPECT_FALSE(parse_date(wrong).has_value()) << wrong;
  }
}

// Root adds an entry to the file of a server that runs as another user.
TEST(TokenFile, StaysItsOwners) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can give a file away";
  const std::string file = test::scratch_folder() + "owned.yaml";
  ASSERT_EQ(write_secret_file(file, entry("anna", kAnna)), "");
  ASSERT_EQ(::chown(file.c_str(), 12345, 12346), 0);
  ASSERT_EQ(::chmod(file.c_str(), 0640), 0);
  EXPECT_EQ(append_token_entry(file, {"bert", {}, {}, {}, {}}), "");
  struct stat found {};
  ASSERT_EQ(::stat(file.c_str(), &found), 0);
  EXPECT_EQ(found.st_uid, 12345U);
  EXPECT_EQ(found.st_gid, 12346U);
  EXPECT_EQ(found.st_mode & 0777U, 0640U);
}

TEST(TokenFile, IsItsOwnersAloneWhenItIsNew) {
  const std::string file = test::scratch_folder() + "new.yaml";
  ASSERT_EQ(append_token_entry(file, {"anna", {}, {}, {}, digest_of_token(kAnna)}), "");
  struct stat found {};
  ASSERT_EQ(::stat(file.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777U, 0600U);
}

TEST(SecretToPrint, ReplacesALinkAndNotItsTarget) {
  const std::string target = test::scratch_folder() + "others.txt";
  const std::string file = test::scratch_folder() + "printed";
  std::ofstream{target} << "theirs";
  ASSERT_EQ(::chmod(target.c_str(), 0666), 0);
  std::filesystem::create_symlink(target, file);
  std::string problem;
  EXPECT_THAT(secret_to_print("secret", "The line", false, file, problem), HasSubstr(file));
  EXPECT_EQ(problem, "");
  EXPECT_EQ(test::content(target), "theirs");
  EXPECT_EQ(test::content(file), "secret");
  struct stat found {};
  ASSERT_EQ(::lstat(file.c_str(), &found), 0);
  EXPECT_TRUE(S_ISREG(found.st_mode));
  EXPECT_EQ(found.st_mode & 0777U, 0600U);
}

// Root may remove everything, so that a process without its rights tries.
TEST(SecretToPrint, IsWrittenNowhereWhereALinkStays) {
  const auto base = std::filesystem::temp_directory_path() /
                    ("connect_secret_to_print_" + std::to_string(::getpid()));
  const std::string closed = base / "closed", open = base / "open", target = open + "/target";
  std::filesystem::create_directories(closed);
  std::filesystem::create_directories(open);
  std::ofstream{target} << "theirs";
  std::filesystem::create_symlink(target, closed + "/printed");
  ASSERT_EQ(::chmod(target.c_str(), 0666), 0);
  ASSERT_EQ(::chmod(open.c_str(), 0777), 0);
  ASSERT_EQ(::chmod(closed.c_str(), 0555), 0);
  const auto write = [&] {
    if (::getuid() == 0 && ::setuid(65534) != 0) std::exit(1);
    std::string problem;
    const std::string text =
        secret_to_print("secret", "The line", false, closed + "/printed", problem);
    std::exit(text.empty() && !problem.empty() ? 0 : 1);
  };
  EXPECT_EXIT(write(), testing::ExitedWithCode(0), "");
  EXPECT_EQ(test::content(target), "theirs");
  ASSERT_EQ(::chmod(closed.c_str(), 0755), 0);
  std::filesystem::remove_all(base);
}

// Whoever chooses it: it gives no group, and ends no text.
TEST(TokenFile, ANameIsItselfAndNothingElse) {
  const std::vector<std::string> groups{R"(see", "ops)", R"(\)", R"(")"};
  const std::string name = R"(anna", groups: [ops], comment: ")";
  const Reading file(to_text({name, groups, {}, R"(hers" # \)", digest_of_token(kAnna)}));
  EXPECT_THAT(file.problems, IsEmpty());
  const Identity anna = file.find(kAnna).identity.value();
  EXPECT_EQ(anna.name, name);
  EXPECT_EQ(anna.groups, groups);
}

TEST(TokenFile, StaysAsItWasWhenAnEntryWouldMakeItWrong) {
  const std::string file = test::scratch_folder() + "kept.yaml";
  const std::string before = entry("anna", kAnna);
  ASSERT_EQ(write_secret_file(file, before), "");
  EXPECT_THAT(append_token_entry(file, {"bert", {}, {}, {}, digest_of_token(kAnna)}),
              HasSubstr("is there twice"));
  EXPECT_EQ(test::content(file), before);
}

// Any user who may open the folder can. A revocation that waits without a word is none.
TEST(TokenFile, WhoHoldsItsFolderLockedHoldsUpAWriterNotForLong) {
  const std::string folder = test::scratch_folder() + "held";
  const std::string file = folder + "/tokens.yaml";
  std::filesystem::create_directory(folder);
  const Digest anna = digest_of_token(kAnna);
  const TokenEntry entry{"anna", {}, {}, {}, anna};
  const auto replace = [&] { return replace_token_entries(file, entry, anna); };
  const auto append = [&] { return append_token_entry(file, entry); };
  const auto remove = [&] {
    std::size_t removed = 0;
    return remove_token_entries(file, "anna", removed);
  };
  const int held = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  ASSERT_EQ(::flock(held, LOCK_EX), 0);
  const std::string who = "(process " + std::to_string(::getpid()) + ") holds its folder locked";
  testing::internal::CaptureStderr();
  std::thread appends([&] { EXPECT_THAT(append(), HasSubstr(who)); });
  EXPECT_THAT(remove(), HasSubstr(who));
  appends.join();
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("waiting: another program " + who));
  EXPECT_THAT(replace(), HasSubstr(who));
  ::close(held);
  EXPECT_EQ(append(), "");
  EXPECT_EQ(replace(), "");
  EXPECT_EQ(remove(), "");
}

// `ctl token` and a server that pairs.
TEST(TokenFile, HasTheEntriesOfAllItsWriters) {
  constexpr int kWriters = 4;
  constexpr int kEntries = 25;
  const std::string file = test::scratch_folder() + "shared.yaml";
  const auto name = [](int writer, int i) { return std::to_string(100 * writer + i); };
  std::vector<std::thread> writers;
  for (int writer = 0; writer < kWriters; ++writer) {
    writers.emplace_back([&, writer] {
      for (int i = 0; i < kEntries; ++i) {
        const std::string mine = name(writer, i);
        EXPECT_EQ(append_token_entry(file, {mine, {}, {}, {}, digest_of_token(mine)}), "");
      }
    });
  }
  for (std::thread& writer : writers) writer.join();
  const Reading all(test::content(file));
  EXPECT_THAT(all.problems, IsEmpty());
  EXPECT_EQ(all.table.size(), std::size_t{kWriters * kEntries});
}

struct Removing {
  explicit Removing(const std::string& text) { std::ofstream{file} << text; }
  std::string remove(const std::string& identity) {
    return remove_token_entries(file, identity, removed);
  }
  [[nodiscard]] std::string content() const {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::string file = test::scratch_folder() + "to_remove.yaml";
  std::size_t removed = 0;
};

TEST(TokenFile, AnIdentitysEntriesAreRemovedAndCommentsStay) {
  const std::string bert = "# of bert\n" + entry("bert", kBert) + "\n# the end\n";
  const std::string anna = to_text({"anna", {"ops"}, "", "her laptop", digest_of_token(kAnna)});
  Removing file("# all\n" + anna + "# new\n" + entry("anna", "anna-fedcba9876543210") + bert);
  EXPECT_EQ(file.remove("anna"), "");
  EXPECT_EQ(file.removed, 2U);
  EXPECT_EQ(file.content(), "# all\n# new\n" + bert);
  EXPECT_THAT(file.remove("anna"), HasSubstr("has no entry of anna"));
  EXPECT_EQ(file.remove("bert"), "");
  EXPECT_THAT(Reading(file.content()).problems, IsEmpty());
}

TEST(TokenFile, TheLastEntryLeavesAFileThatIsReadStill) {
  Removing file(to_text({"anna", {}, "", "", digest_of_token(kAnna)}));
  EXPECT_EQ(file.remove("anna"), "");
  const Reading rest(file.content());
  EXPECT_THAT(rest.problems, IsEmpty());
  EXPECT_EQ(rest.table.size(), 0U);
}

TEST(TokenFile, WhatCannotBeRemovedByLinesStays) {
  const std::string digest = to_hex(digest_of_token(kAnna));
  const std::string one_line =
      "[{identity: anna, token_sha256: " + digest +
      "}, {identity: bert, token_sha256: " + to_hex(digest_of_token(kBert)) + "}]\n";
  for (const std::string& text :
       {one_line, "-\n  identity: anna\n  token_sha256: " + digest + "\n"}) {
    Removing file(text);
    EXPECT_THAT(file.remove("anna"), HasSubstr("by hand"));
    EXPECT_EQ(file.content(), text);
  }
  Removing wrong("- {identity: anna}\n");
  EXPECT_THAT(wrong.remove("anna"), HasSubstr("'token_sha256' is missing"));
  Removing single(std::string(kAnna) + "\n");
  EXPECT_THAT(single.remove(TokenTable::kSingleIdentity), HasSubstr("has no entry"));
}

}  // namespace
}  // namespace connect_bridge
