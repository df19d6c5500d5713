/* A login method for ROS2 Connect: a client that shows "NAME:PASSWORD" of the options is NAME, in the group "plugin", for an hour.
 *
 *   cc -shared -fPIC -Iinclude -o auth_plugin.so examples/auth_plugin.c
 *   server: auth: {method: plugin, plugin: /path/auth_plugin.so, plugin_options: "anna:a-password-of-anna"}
 *   client: auth: {method: plugin, token: "anna:a-password-of-anna"}
 *
 * Not for real use: a password in the options can be read by everybody who can read the parameters.
 */
#include <connect_bridge/auth_plugin.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const int64_t kHour = 3600LL * 1000000000LL;

static void* open_plugin(const char* options, char* problem, size_t problem_size) {
  if (strchr(options, ':') == NULL) {
    snprintf(problem, problem_size, "expected NAME:PASSWORD as the options");
    return NULL;
  }
  return strdup(options);
}

/* In a time that does not depend on where they differ. */
static int equal(const uint8_t* a, const char* b, size_t size) {
  unsigned different = 0;
  for (size_t i = 0; i < size; ++i) different |= a[i] ^ (uint8_t)b[i];
  return different == 0;
}

static int judge(void* self, const struct connect_bridge_auth_attempt* attempt,
                 struct connect_bridge_auth_answer* answer) {
  const char* expected = self;
  const size_t size = strlen(expected);
  const size_t name_size = (size_t)(strchr(expected, ':') - expected);
  if (attempt->credential_size != size || !equal(attempt->credential, expected, size) ||
      name_size >= sizeof answer->identity) {
    snprintf(answer->reason, sizeof answer->reason, "wrong name or password");
    return 0;
  }
  memcpy(answer->identity, expected, name_size);
  snprintf(answer->groups[0], sizeof answer->groups[0], "plugin");
  answer->expires = attempt->now + kHour;
  return 1;
}

static void close_plugin(void* self) { free(self); }

const struct connect_bridge_auth_functions* connect_bridge_auth_plugin(void) {
  static const struct connect_bridge_auth_functions plugin = {CONNECT_BRIDGE_AUTH_ABI, open_plugin, judge, close_plugin};
  return &plugin;
}
