// A login plugin with faults; the first letter of the credential selects the fault of a login, the
// option that of the rest.
#include <connect_bridge/auth_plugin.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>

#ifndef ODD_ABI
#define ODD_ABI CONNECT_BRIDGE_AUTH_ABI
#endif
#ifndef ODD_THREADS
#define ODD_THREADS 2
#endif

namespace {

char self[32];

#ifdef ODD_MARKS
// Makes the file of this variable: what a library does when it is loaded.
[[gnu::constructor]] void mark() {
  const char* const name = std::getenv("ODD_MARK");
  if (std::FILE* const file = name ? std::fopen(name, "w") : nullptr) std::fclose(file);
}
#endif

void say_much(const connect_bridge_auth_report* report, connect_bridge_auth_level level) {
  char text[4096];
  std::memset(text, '\033', sizeof text);
  text[sizeof text - 1] = '\0';
  report->say(report->server, level, text);
}

void* open_plugin(const connect_bridge_auth_option* options, size_t count,
                  const connect_bridge_auth_report* report) noexcept {
  std::snprintf(self, sizeof self, "%s", count > 0 ? options[0].value : "");
  report->withdraw(report->server, "nobody yet");
  if (std::strcmp(self, "silent") == 0) return nullptr;
  if (std::strcmp(self, "long") == 0) say_much(report, CONNECT_BRIDGE_AUTH_ERROR);
  return std::strcmp(self, "long") == 0 ? nullptr : self;
}

int judge(void*, const connect_bridge_auth_attempt* attempt,
          connect_bridge_auth_answer* answer) noexcept {
  const char what = attempt->credential_size > 0 ? static_cast<char>(attempt->credential[0]) : '\0';
  std::snprintf(answer->identity, sizeof answer->identity, "odd");
  std::snprintf(answer->proof, sizeof answer->proof, "key 1");
  if (what == 'n') answer->identity[0] = 0;
  if (what == 'c') answer->identity[0] = '\n';
  if (what == 'l') std::memset(answer->identity, 'x', sizeof answer->identity);
  if (what == 'e') answer->expires = -1;
  if (what == 'g') std::memset(answer->groups, 'y', sizeof answer->groups);
  if (what == 'p') std::memset(answer->proof, '\n', sizeof answer->proof - 1);
  if (what == 'r') std::memset(answer->reason, '\033', sizeof answer->reason);
  if (what == '7') return 7;
  if (what == 'u') return CONNECT_BRIDGE_AUTH_UNJUDGED;
  return what == 'r' ? CONNECT_BRIDGE_AUTH_REFUSED : CONNECT_BRIDGE_AUTH_ACCEPTED;
}

void refresh(void*, int64_t, const connect_bridge_auth_report* report) noexcept {
  report->say(report->server, CONNECT_BRIDGE_AUTH_INFO, "one key left");
  say_much(report, static_cast<connect_bridge_auth_level>(1));
  report->withdraw(report->server, "");
  report->withdraw(report->server, "key 1");
}

void close_plugin(void*) noexcept {}

}  // namespace

const connect_bridge_auth_functions* connect_bridge_auth_plugin(void) noexcept {
  static const connect_bridge_auth_functions plugin = {
      ODD_ABI, ODD_THREADS, "plugin", open_plugin, judge, refresh, close_plugin};
  return &plugin;
}
