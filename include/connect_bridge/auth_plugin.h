/* A login method of your own, as a shared library for the server of ROS2 Connect (`auth.method: plugin`, `auth.plugin: FILE`).
 *
 * The library exports one function, connect_bridge_auth_plugin(). The server asks it for the functions below at the start and calls
 * them on threads of its own, never on the one that moves messages: judge() may block for as long as a login may take
 * (`login_timeout`, 5 s). A later answer is ignored: the client was disconnected, and dials again. Four logins are judged at once; a
 * library that hangs in all four lets nobody in.
 *
 * The library is a part of the server's process: if it crashes or leaks memory, the server does. All memory belongs to the side that
 * allocated it: the server's is valid during the call. Exceptions must not leave the functions.
 */
#ifndef CONNECT_BRIDGE_AUTH_PLUGIN_H
#define CONNECT_BRIDGE_AUTH_PLUGIN_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Changes when libraries that were built for the former number cannot be used any more. */
#define CONNECT_BRIDGE_AUTH_ABI 1

#define CONNECT_BRIDGE_AUTH_NAME_BYTES 256
#define CONNECT_BRIDGE_AUTH_GROUPS_MAX 32
#define CONNECT_BRIDGE_AUTH_REASON_BYTES 256

/* What a client shows. It may come from a stranger: check everything. */
struct connect_bridge_auth_attempt {
  const uint8_t* credential; /* not terminated, any bytes */
  size_t credential_size;    /* 0 to 3900 */
  const char* peer;          /* "203.0.113.5:51234", terminated */
  int64_t now;               /* the server's system clock, nanoseconds since 1970 */
};

/* The identity; all zero before the call. Texts are UTF-8 without control characters, terminated. */
struct connect_bridge_auth_answer {
  char identity[CONNECT_BRIDGE_AUTH_NAME_BYTES]; /* must not be empty if accepted */
  char groups[CONNECT_BRIDGE_AUTH_GROUPS_MAX][CONNECT_BRIDGE_AUTH_NAME_BYTES]; /* up to the first empty one */
  int64_t expires; /* when the login ends, nanoseconds since 1970; 0: never */
  char reason[CONNECT_BRIDGE_AUTH_REASON_BYTES]; /* refused: why, for the server's log; not a secret */
};

struct connect_bridge_auth_functions {
  uint32_t abi; /* CONNECT_BRIDGE_AUTH_ABI of the header that the library was built with */

  /* Once, at the start. `options` is the server's `auth.plugin_options`. Returns what the other functions get as `self`, which may be
   * anything but null; null with a sentence in `problem` (terminated, `problem_size` bytes): the server does not start. */
  void* (*open)(const char* options, char* problem, size_t problem_size);

  /* 1: accepted, anything else: refused. Called by several threads at once. */
  int (*judge)(void* self, const struct connect_bridge_auth_attempt* attempt, struct connect_bridge_auth_answer* answer);

  /* Once, when no other function runs. */
  void (*close)(void* self);
};

/* What the library exports. Returns something that stays valid. */
const struct connect_bridge_auth_functions* connect_bridge_auth_plugin(void);

#ifdef __cplusplus
}
#endif

#endif
