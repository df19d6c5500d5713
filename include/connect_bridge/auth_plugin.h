/* A login method as a shared library for the server of ROS2 Connect. The server's own methods `jwt` and `service` are such libraries; for
 * yours: `auth.method: plugin`, `auth.plugin: FILE`.
 *
 * The library exports one function, connect_bridge_auth_plugin(), which gives the server the functions below. All of them may block: the
 * server's messages move on another thread. A login that takes longer than 5 s is lost, its client dials again; while
 * `threads` logins hang, nobody else gets in.
 *
 * Threads: open() runs on the thread that starts the server. judge() runs on `threads` threads of the server at once; refresh() runs on one
 * of these, once a second, while the others may judge. With `threads` 1 no two functions run at the same time. close() runs last. The library may have threads of its own; they must have ended when close() returns.
 *
 * Memory: each side frees what it allocated. What a function gets as an argument is valid until it returns; copy what you keep.
 *
 * The library is a part of the server's process: if it crashes or leaks memory, the server does. Exceptions must not leave its functions:
 * C++ sees them as noexcept, so what throws ends the server.
 */
#ifndef CONNECT_BRIDGE_AUTH_PLUGIN_H
#define CONNECT_BRIDGE_AUTH_PLUGIN_H

#include <stddef.h>
#include <stdint.h>

#if defined(__cplusplus) && __cplusplus >= 201703L
#define CONNECT_BRIDGE_AUTH_NOEXCEPT noexcept
#else
#define CONNECT_BRIDGE_AUTH_NOEXCEPT
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Changes when libraries that were built for the former number cannot be used any more. */
#define CONNECT_BRIDGE_AUTH_ABI 2

#define CONNECT_BRIDGE_AUTH_NAME_BYTES 256
#define CONNECT_BRIDGE_AUTH_GROUPS_MAX 256
#define CONNECT_BRIDGE_AUTH_REASON_BYTES 256
#define CONNECT_BRIDGE_AUTH_THREADS_MAX 64

/* What judge() returns. */
enum connect_bridge_auth_verdict {
  CONNECT_BRIDGE_AUTH_REFUSED = 0,  /* the login is wrong: who tries wrong ones is slowed down */
  CONNECT_BRIDGE_AUTH_ACCEPTED = 1, /* `answer` says who it is */
  CONNECT_BRIDGE_AUTH_UNJUDGED = 2  /* it could not be found out: the client tries again later, and it counts against nobody */
};

enum connect_bridge_auth_level { CONNECT_BRIDGE_AUTH_INFO = 0, CONNECT_BRIDGE_AUTH_WARNING = 1, CONNECT_BRIDGE_AUTH_ERROR = 2 };

/* A parameter of the server, without "auth." before its name: `plugin_options`, `https_ca`, `jwt_keys` ... A list has blanks between. */
struct connect_bridge_auth_option {
  const char* key;
  const char* value;
};

/* What a client shows. It may come from a stranger: check everything. */
struct connect_bridge_auth_attempt {
  const uint8_t* credential; /* not terminated, any bytes */
  size_t credential_size;    /* 0 to 3900 */
  const char* peer;          /* "203.0.113.5:51234", terminated */
  int64_t now;               /* the server's system clock, nanoseconds since 1970 */
};

/* All zero before the call. Texts are UTF-8 without control characters, terminated. */
struct connect_bridge_auth_answer {
  char identity[CONNECT_BRIDGE_AUTH_NAME_BYTES]; /* accepted: not empty */
  char groups[CONNECT_BRIDGE_AUTH_GROUPS_MAX][CONNECT_BRIDGE_AUTH_NAME_BYTES]; /* up to the first empty one */
  int64_t expires; /* when the login ends, nanoseconds since 1970; 0: never */
  char proof[CONNECT_BRIDGE_AUTH_NAME_BYTES]; /* what the login rests on, for withdraw(); empty: nothing. Not a secret. */
  char reason[CONNECT_BRIDGE_AUTH_REASON_BYTES]; /* refused, unjudged: why, for the server's log; not a secret */
};

/* What the library tells the server during open() or refresh(), from that thread. `server` is the first argument of both. */
struct connect_bridge_auth_report {
  void* server;
  /* A sentence for the log. */
  void (*say)(void* server, enum connect_bridge_auth_level level, const char* text) CONNECT_BRIDGE_AUTH_NOEXCEPT;
  /* refresh() only: logins with this `proof` end. */
  void (*withdraw)(void* server, const char* proof) CONNECT_BRIDGE_AUTH_NOEXCEPT;
};

struct connect_bridge_auth_functions {
  uint32_t abi;       /* CONNECT_BRIDGE_AUTH_ABI of the header that the library was built with; first in every version */
  uint32_t threads;   /* 1 to CONNECT_BRIDGE_AUTH_THREADS_MAX: how many logins are judged at once */
  const char* method; /* the `auth.method` of the clients: "plugin", or another one of theirs. Others are refused without a call. */

  /* Once. Returns what the other functions get as `self`, which may be anything but null; null: the server does not start, and what was
   * said with CONNECT_BRIDGE_AUTH_ERROR is why. */
  void* (*open)(const struct connect_bridge_auth_option* options, size_t count, const struct connect_bridge_auth_report* report)
      CONNECT_BRIDGE_AUTH_NOEXCEPT;

  /* A connect_bridge_auth_verdict; another number is UNJUDGED. */
  int (*judge)(void* self, const struct connect_bridge_auth_attempt* attempt, struct connect_bridge_auth_answer* answer)
      CONNECT_BRIDGE_AUTH_NOEXCEPT;

  /* Null: there is nothing to refresh. What is said with CONNECT_BRIDGE_AUTH_ERROR is why a change was not taken. */
  void (*refresh)(void* self, int64_t now, const struct connect_bridge_auth_report* report) CONNECT_BRIDGE_AUTH_NOEXCEPT;

  void (*close)(void* self) CONNECT_BRIDGE_AUTH_NOEXCEPT;
};

/* What the library exports. Returns something that stays valid. */
const struct connect_bridge_auth_functions* connect_bridge_auth_plugin(void) CONNECT_BRIDGE_AUTH_NOEXCEPT;

#ifdef __cplusplus
}
#endif

#endif
