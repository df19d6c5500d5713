#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "access/login/runtime_folder.hpp"
#include "config/syntax.hpp"
#include "core/base/json.hpp"
#include "ctl/ctl_asked.hpp"
#include "ctl/ctl_commands.hpp"
#include "ctl/status_text.hpp"
#include "ops/status/status_fields.hpp"
#include "ops/status/status_screen.hpp"
#include "run/exit_codes.hpp"

namespace {

using namespace connect_bridge;

struct StatusQuestion {
  std::string where;  // "127.0.0.1:9091", the file of a socket; empty: this user's programs
  bool json = false;
  bool watch = false;
};

constexpr std::size_t kLinesBesides = 12;  // of a screen: what is not in its tables
constexpr int kNobodyAnswers = 1;

// Output that goes to no terminal is not cut to a screen.
ScreenSize screen_size() {
  constexpr std::size_t kEndless = std::numeric_limits<std::size_t>::max() / 2;
  winsize size{};
  if (::isatty(STDOUT_FILENO) == 0) return {kEndless, 0, false};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0)
    return {kEndless, 0, true};
  return {size.ws_row > kLinesBesides ? size.ws_row - kLinesBesides : std::size_t{1}, size.ws_col,
          true};
}

int show_json(const std::string& where) {
  Asked asked(where, "/api/status");
  if (!asked.problem().empty()) return complain(where + ": " + asked.problem(), kNobodyAnswers);
  // The JSON is parsed and made again, so that nothing but text reaches the terminal.
  const auto shown = read_status_in_order(asked.rest());
  if (!shown.is_object()) return complain(where + ": this is no status", kNobodyAnswers);
  std::fputs((shown.dump(1) + "\n").c_str(), stdout);
  return 0;
}

// Rates need two.
int show_screen(const std::string& where, bool watch) {
  Asked asked(where, "/api/events");
  if (!asked.problem().empty()) return complain(where + ": " + asked.problem(), kNobodyAnswers);
  Json before = asked.next_event();
  do {
    const Json now = asked.next_event();
    if (!now.is_object() || !before.is_object())
      return complain(where + ": no status comes any longer", kNobodyAnswers);
    const bool clears = watch && ::isatty(STDOUT_FILENO) != 0;
    std::fputs(clears ? "\033[H\033[2J" : "", stdout);
    std::fputs(status_screen(now, before, screen_size()).c_str(), stdout);
    std::fflush(stdout);
    before = now;
  } while (watch);
  return 0;
}

int run_status(const StatusQuestion& question) {
  std::vector<std::string> all{question.where};
  if (question.where.empty()) {
    all = status_sockets();
  } else if (question.where.find('/') == std::string::npos &&
             !syntax::parse_status_address(question.where)) {
    return complain(
        question.where + ": this is no address as 127.0.0.1:9091, and no path of a socket",
        kExitConfiguration);
  }
  if (all.empty())
    return complain("no server or client of this user runs here: " + where_sockets_are() +
                        ". `ctl status FILE` reads a socket that you name",
                    kNobodyAnswers);
  if ((question.watch || question.json) && all.size() > 1) {
    std::string lines = "there are several, name one of them:\n";
    for (const auto& socket : all) lines += "  ctl status " + socket + "\n";
    return complain(lines, kExitConfiguration);
  }
  int worst = 0;
  for (const auto& where : all) {
    if (all.size() > 1) std::printf("%s---- %s\n", &where == &all[0] ? "" : "\n", where.c_str());
    worst = std::max(worst, question.json ? show_json(where) : show_screen(where, question.watch));
  }
  return worst;
}

}  // namespace

void add_status_command(CLI::App& app, int& exit_code) {
  const auto question = std::make_shared<StatusQuestion>();
  auto* status = app.add_subcommand(
      "status", "Show what a running server or client does: links, topics, rates, drops, calls");
  status->footer(
      "From another machine: ssh -L 9091:127.0.0.1:9091 ROBOT, then ctl status 127.0.0.1:9091. "
      "Exit code: 0 if it is shown, 1 if nobody answers, 2 if the address is wrong.");
  status->add_option("where", question->where,
                     "An address of status.listen, as 127.0.0.1:9091, or a socket. Without it: "
                     "this user's programs on this machine");
  auto* json = status->add_flag("--json", question->json, "As JSON (docs/status.md)");
  status->add_flag("--watch", question->watch, "Again every second, until Ctrl-C")->excludes(json);
  auto* document =
      app.add_subcommand("status-doc", "Print the tables of the status's fields (docs/status.md)");
  document->callback([] { std::fputs(status_tables().c_str(), stdout); });
  status->callback([question, &exit_code] { exit_code = run_status(*question); });
}
