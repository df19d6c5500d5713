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

static void* open_plugin(const struct connect_bridge_auth_option* options, size_t count,
                         const struct connect_bridge_auth_report* report) {
  const char* login = "";
  for (size_t i = 0; i < count; ++i)
    if (strcmp(options[i].key, "plugin_options") == 0) login = options[i].value;
  if (strchr(login, ':') != NULL) return strdup(login);
  report->say(report->server, CONNECT_BRIDGE_AUTH_ERROR, "expected NAME:PASSWORD as the options");
  return NULL;
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
    return CONNECT_BRIDGE_AUTH_REFUSED;
  }
  memcpy(answer->identity, expected, name_size);
  snprintf(answer->groups[0], sizeof answer->groups[0], "plugin");
  answer->expires = attempt->now + kHour;
  return CONNECT_BRIDGE_AUTH_ACCEPTED;
}

static void close_plugin(void* self) { free(self); }

const struct connect_bridge_auth_functions* connect_bridge_auth_plugin(void) {
  static const struct connect_bridge_auth_functions plugin = {
      CONNECT_BRIDGE_AUTH_ABI, 4, "plugin", open_plugin, judge, NULL, close_plugin};
  return &plugin;
}
