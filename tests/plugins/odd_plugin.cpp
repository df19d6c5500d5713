// A login plugin with faults; the first letter of the credential selects the fault.
#include <connect_bridge/auth_plugin.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>

#ifndef ODD_ABI
#define ODD_ABI CONNECT_BRIDGE_AUTH_ABI
#endif

namespace {

int self;

#ifdef ODD_MARKS
// Makes the file of this variable: what a library does when it is loaded.
[[gnu::constructor]] void mark() {
  const char* const name = std::getenv("ODD_MARK");
  if (std::FILE* const file = name ? std::fopen(name, "w") : nullptr) std::fclose(file);
}
#endif

void* open_plugin(const char* options, char* problem, size_t problem_size) {
  if (std::strcmp(options, "full") == 0) std::memset(problem, 'x', problem_size);
  return std::strcmp(options, "full") == 0 ? nullptr : &self;
}

int judge(void*, const connect_bridge_auth_attempt* attempt,
          struct connect_bridge_auth_answer* answer) {
  const char what = attempt->credential_size > 0 ? static_cast<char>(attempt->credential[0]) : '\0';
  std::snprintf(answer->identity, sizeof answer->identity, "odd");
  if (what == 'n') answer->identity[0] = 0;
  if (what == 'c') answer->identity[0] = '\n';
  if (what == 'l') std::memset(answer->identity, 'x', sizeof answer->identity);
  if (what == 'e') answer->expires = -1;
  if (what == 'g') std::memset(answer->groups, 'y', sizeof answer->groups);
  if (what == 'r') std::memset(answer->reason, '\033', sizeof answer->reason);
  if (what == '2') return 2;
  return what != 'r';
}

void close_plugin(void*) {}

}  // namespace

const connect_bridge_auth_functions* connect_bridge_auth_plugin(void) {
  static const connect_bridge_auth_functions plugin = {ODD_ABI, open_plugin, judge, close_plugin};
  return &plugin;
}
