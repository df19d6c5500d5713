// Preloaded into a program (tools/bench/cost): counts what it allocates and copies, and how often
// it reads a clock. The counts are 64-bit numbers in the file $COST_COUNTS.<pid>: those of the
// first thread, then those of all others, each in the order of `Count`.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>

namespace {

enum Count {
  kAllocations,
  kAllocatedBytes,
  kLargeAllocations,
  kCopies,  // memcpy and memmove, of kLarge bytes or more
  kCopiedBytes,
  kFills,  // memset, of kLarge bytes or more
  kFilledBytes,
  kClockReads,           // without a system call
  kProcessorClockReads,  // with one
  kCounts,
};

constexpr std::size_t kLarge = 4096;

using Counts = std::array<std::atomic<std::uint64_t>, 2UL * kCounts>;
constinit Counts before_the_file{};
constinit Counts* counts = &before_the_file;
constinit thread_local int thread __attribute__((tls_model("initial-exec"))) = -1;

void add(Count what, std::uint64_t n) {
  if (thread < 0) thread = syscall(SYS_gettid) == getpid() ? 0 : kCounts;
  (*counts)[static_cast<std::size_t>(thread + what)].fetch_add(n, std::memory_order_relaxed);
}

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}
void* (*next_memcpy)(void*, const void*, std::size_t) = nullptr;
void* (*next_memmove)(void*, const void*, std::size_t) = nullptr;
void* (*next_memset)(void*, int, std::size_t) = nullptr;
int (*next_clock_gettime)(clockid_t, timespec*) = nullptr;

__attribute__((constructor)) void begin() {
  next_memcpy = next<void*(void*, const void*, std::size_t)>("memcpy");
  next_memmove = next<void*(void*, const void*, std::size_t)>("memmove");
  next_memset = next<void*(void*, int, std::size_t)>("memset");
  next_clock_gettime = next<int(clockid_t, timespec*)>("clock_gettime");
  const char* const name = std::getenv("COST_COUNTS");
  if (name == nullptr) return;
  const std::string path = std::string(name) + "." + std::to_string(getpid());
  const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (file < 0) return;
  void* at = MAP_FAILED;
  if (ftruncate(file, sizeof(Counts)) == 0)
    at = mmap(nullptr, sizeof(Counts), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (at != MAP_FAILED) counts = static_cast<Counts*>(at);
  close(file);
}

void allocated(std::size_t bytes) {
  add(kAllocations, 1);
  add(kAllocatedBytes, bytes);
  if (bytes >= kLarge) add(kLargeAllocations, 1);
}

// A function of its own, so that a probe of perf shows who copies (docs/lab/costs.md).
__attribute__((noinline)) void large_copy(std::size_t bytes) {
  add(kCopies, 1);
  add(kCopiedBytes, bytes);
}

}  // namespace

extern "C" {

// The functions of glibc itself: they work before dlsym does, which allocates.
void* __libc_malloc(std::size_t bytes);                           // NOLINT
void* __libc_calloc(std::size_t n, std::size_t bytes);            // NOLINT
void* __libc_realloc(void* old, std::size_t bytes);               // NOLINT
void* __libc_memalign(std::size_t alignment, std::size_t bytes);  // NOLINT

void* malloc(std::size_t bytes) noexcept {
  allocated(bytes);
  return __libc_malloc(bytes);
}
void* calloc(std::size_t n, std::size_t bytes) noexcept {
  allocated(n * bytes);
  return __libc_calloc(n, bytes);
}
void* realloc(void* old, std::size_t bytes) noexcept {
  allocated(bytes);
  return __libc_realloc(old, bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) noexcept {
  allocated(bytes);
  return __libc_memalign(alignment, bytes);
}
int posix_memalign(void** at, std::size_t alignment, std::size_t bytes) noexcept {
  allocated(bytes);
  *at = __libc_memalign(alignment, bytes);
  return *at != nullptr ? 0 : ENOMEM;
}

void* memcpy(void* __restrict to, const void* __restrict from, std::size_t bytes) noexcept {
  if (bytes >= kLarge) large_copy(bytes);
  if (next_memcpy != nullptr) return next_memcpy(to, from, bytes);
  auto* const into = static_cast<volatile char*>(to);
  for (std::size_t i = 0; i < bytes; ++i) into[i] = static_cast<const char*>(from)[i];
  return to;
}
void* memmove(void* to, const void* from, std::size_t bytes) noexcept {
  if (next_memmove == nullptr && to <= from) return memcpy(to, from, bytes);
  if (bytes >= kLarge) large_copy(bytes);
  if (next_memmove != nullptr) return next_memmove(to, from, bytes);
  auto* const into = static_cast<volatile char*>(to);
  for (std::size_t i = bytes; i > 0; --i) into[i - 1] = static_cast<const char*>(from)[i - 1];
  return to;
}
void* memset(void* to, int value, std::size_t bytes) noexcept {
  if (bytes >= kLarge) {
    add(kFills, 1);
    add(kFilledBytes, bytes);
  }
  if (next_memset != nullptr) return next_memset(to, value, bytes);
  auto* const into = static_cast<volatile char*>(to);
  for (std::size_t i = 0; i < bytes; ++i) into[i] = static_cast<char>(value);
  return to;
}

int clock_gettime(clockid_t clock, timespec* now) noexcept {
  const bool of_processor = clock == CLOCK_THREAD_CPUTIME_ID || clock == CLOCK_PROCESS_CPUTIME_ID;
  add(of_processor ? kProcessorClockReads : kClockReads, 1);
  if (next_clock_gettime != nullptr) return next_clock_gettime(clock, now);
  return static_cast<int>(syscall(SYS_clock_gettime, clock, now));
}

}  // extern "C"
