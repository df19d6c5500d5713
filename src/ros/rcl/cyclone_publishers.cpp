#include "ros/rcl/cyclone_publishers.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <type_traits>

namespace connect_bridge::ros {
namespace {

// Declarations from dds/dds.h of Cyclone DDS 0.10, repeated so that one build of the bridge serves
// all middlewares. Node checks at its start that this finds a publisher of its own.
using DdsEntity = std::int32_t;
constexpr DdsEntity kPublicationTopic = 0x7fff0000 + 3;  // DDS_BUILTIN_TOPIC_DCPSPUBLICATION
constexpr std::uint32_t kAlive = 16;                     // DDS_ALIVE_INSTANCE_STATE

struct SampleInfo {
  std::uint32_t sample_state, view_state, instance_state;
  bool valid_data;
  std::int64_t source_timestamp;
  std::uint64_t instance_handle;
  std::uint64_t publication_handle;
  std::uint32_t counts[5];
};
struct PublicationSample {  // the beginning of dds_builtintopic_endpoint_t
  std::uint8_t key[16];
};

struct Functions {
  DdsEntity (*lookup_participant)(std::uint32_t domain, DdsEntity* found,
                                  std::size_t size) = nullptr;
  DdsEntity (*create_reader)(DdsEntity participant, DdsEntity topic, const void* qos,
                             const void* listener) = nullptr;
  DdsEntity (*take)(DdsEntity reader, void** samples, SampleInfo* infos, std::size_t size,
                    std::uint32_t max) = nullptr;
  DdsEntity (*return_loan)(DdsEntity reader, void** samples, std::int32_t count) = nullptr;
  DdsEntity (*remove)(DdsEntity entity) = nullptr;
  bool complete = false;
};

Functions find_functions() {
  Functions functions;
  void* library = nullptr;
  for (const char* name : {"libddsc.so.0", "libddsc.so"})
    if (library == nullptr) library = dlopen(name, RTLD_LAZY | RTLD_NOLOAD);
  if (library == nullptr) return functions;
  bool complete = true;
  const auto find = [&](auto& function, const char* name) {
    function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(dlsym(library, name));
    complete = complete && function != nullptr;
  };
  find(functions.lookup_participant, "dds_lookup_participant");
  find(functions.create_reader, "dds_create_reader");
  find(functions.take, "dds_take");
  find(functions.return_loan, "dds_return_loan");
  find(functions.remove, "dds_delete");
  functions.complete = complete;
  dlclose(library);  // the middleware keeps it
  return functions;
}

// Call it after the middleware was loaded (rcl is initialized).
const Functions& functions() {
  static const Functions found = find_functions();
  return found;
}

// The gid that rmw_cyclonedds_cpp makes from a handle: its bytes, then zeros.
Gid gid_of_handle(std::uint64_t handle) {
  Gid gid;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(&handle);
  std::copy_n(bytes, sizeof handle, gid.bytes.begin());
  return gid;
}

}  // namespace

bool CyclonePublishers::available() {
  return functions().complete;
}

CyclonePublishers::~CyclonePublishers() {
  close();
}

// Any participant of the process will do: all see the same publishers, with the same handles.
bool CyclonePublishers::open() {
  if (reader_ > 0) return true;
  DdsEntity participant = 0;
  if (!available() || functions().lookup_participant(domain_, &participant, 1) < 1) return false;
  reader_ =
      std::max(0, functions().create_reader(participant, kPublicationTopic, nullptr, nullptr));
  return reader_ > 0;
}

void CyclonePublishers::close() {
  if (reader_ > 0) functions().remove(reader_);
  reader_ = 0;
}

std::vector<PublisherChange> CyclonePublishers::changes() {
  constexpr std::size_t kAtOnce = 64;
  std::vector<PublisherChange> changes;
  while (open()) {
    std::array<void*, kAtOnce> samples{};
    std::array<SampleInfo, kAtOnce> infos{};
    const DdsEntity count =
        functions().take(reader_, samples.data(), infos.data(), kAtOnce, kAtOnce);
    if (count < 0) close();  // gone with its participant; the next call reads all again
    if (count <= 0) break;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      PublisherChange& change = changes.emplace_back();
      change.reported = gid_of_handle(infos[i].instance_handle);
      const auto& key = static_cast<const PublicationSample*>(samples[i])->key;
      std::copy(std::begin(key), std::end(key), change.id.bytes.begin());
      change.gone = infos[i].instance_state != kAlive;
    }
    functions().return_loan(reader_, samples.data(), count);
  }
  return changes;
}

}  // namespace connect_bridge::ros
