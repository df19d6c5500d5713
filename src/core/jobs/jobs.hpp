// Work for the workers: the result goes back to the owner that asked for it.
#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>

#include "core/base/budget.hpp"
#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

struct JobOptions {
  std::uint32_t compress_job_bytes = 16384;  // from this size on a worker does it, else the loop
};

// Receives the result of a job: none as in JobDone.
class JobOwner {
 public:
  virtual void on_job(std::optional<Payload> result, const Now& now) = 0;

 protected:
  ~JobOwner() = default;
};

// The jobs under way. Single-threaded; outlives the jobs it gives out.
class Jobs {
 public:
  // One job under way. If this is destroyed before the job is done, the job is cancelled and a
  // result is ignored.
  class Job {
   public:
    Job() = default;
    Job(Job&& other) noexcept : jobs_(std::exchange(other.jobs_, nullptr)), id_(other.id_) {}
    Job& operator=(Job&& other) noexcept {
      if (this == &other) return *this;
      cancel();
      jobs_ = std::exchange(other.jobs_, nullptr);
      id_ = other.id_;
      return *this;
    }
    ~Job() { cancel(); }

    void cancel() {
      if (jobs_ && jobs_->owners_.erase(id_) > 0) jobs_->outputs_.push(CancelJob{id_});
      jobs_ = nullptr;
    }
    // Under way; its owner resets it when the result has come.
    explicit operator bool() const { return jobs_ != nullptr; }

   private:
    friend class Jobs;
    Job(Jobs* jobs, JobId id) : jobs_(jobs), id_(id) {}

    Jobs* jobs_ = nullptr;
    JobId id_;
  };

  Jobs(JobOptions options, Outputs& outputs) : options_(options), outputs_(outputs) {}
  Jobs(const Jobs&) = delete;
  Jobs& operator=(const Jobs&) = delete;

  // Whether a message of this size (uncompressed) is work for a worker.
  [[nodiscard]] bool is_large(std::uint64_t bytes) const {
    return bytes >= options_.compress_job_bytes;
  }

  // `turn`: of the link that the work is for.
  [[nodiscard]] Job compress(JobOwner& owner, const Compression& how, Payload raw,
                             JobTurn turn = {}) {
    const JobId id = begin(owner);
    outputs_.push(CompressJob{id, how, std::move(raw), turn});
    return Job(this, id);
  }
  [[nodiscard]] Job decompress(JobOwner& owner, Codec codec, std::uint32_t raw_bytes, Payload body,
                               JobTurn turn) {
    const JobId id = begin(owner);
    outputs_.push(DecompressJob{id, codec, raw_bytes, std::move(body), turn});
    return Job(this, id);
  }
  // Pictures of one origin, which refer to each other. The worker forgets them with this.
  class Pictures {
   public:
    // `memory` is what the codec counts against; it outlives this object.
    Pictures(Jobs& jobs, Budget& memory)
        : jobs_(&jobs),
          memory_(&memory),
          hold_(memory.hold(0)),
          id_(jobs.outputs_.new_id<PictureId>()) {}
    Pictures(Pictures&& other) noexcept
        : jobs_(std::exchange(other.jobs_, nullptr)),
          memory_(other.memory_),
          hold_(std::move(other.hold_)),
          id_(other.id_) {}
    Pictures& operator=(Pictures&&) = delete;
    ~Pictures() {
      if (jobs_) jobs_->outputs_.push(EndPicture{id_});
    }
    // False: there is no memory for a codec that takes so many bytes. A codec that has been larger
    // keeps its buffers, so it counts as it was.
    [[nodiscard]] bool make_room(std::uint64_t bytes) {
      if (bytes <= hold_.amount()) return true;
      if (bytes - hold_.amount() > memory_->room()) return false;
      hold_.resize(bytes);
      return true;
    }
    // The job before must be done.
    [[nodiscard]] Job encode(JobOwner& owner, EncodePicture job) {
      job.job = jobs_->begin(owner);
      job.picture = id_;
      const JobId id = job.job;
      jobs_->outputs_.push(std::move(job));
      return Job(jobs_, id);
    }
    [[nodiscard]] Job decode(JobOwner& owner, std::uint32_t raw_bytes, Payload body, JobTurn turn) {
      const JobId id = jobs_->begin(owner);
      jobs_->outputs_.push(DecodePicture{id, id_, raw_bytes, std::move(body), turn});
      return Job(jobs_, id);
    }

   private:
    Jobs* jobs_;
    Budget* memory_;
    Budget::Hold hold_;
    PictureId id_;
  };
  // A worker is done: gives the result to the owner, if it still waits for it.
  void on_done(JobDone& done, const Now& now) {
    const auto it = owners_.find(done.job);
    if (it == owners_.end()) return;
    const Owner owner = std::move(it->second);
    owners_.erase(it);
    const Outputs::Paying paying(outputs_, owner.payer);
    owner.owner->on_job(std::move(done.result), now);
  }

 private:
  struct Owner {
    JobOwner* owner = nullptr;
    Payer payer;  // for whom the job was begun, and what follows from it
  };
  JobId begin(JobOwner& owner) {
    const JobId id = outputs_.new_id<JobId>();
    owners_[id] = {&owner, outputs_.payer()};
    return id;
  }

  JobOptions options_;
  Outputs& outputs_;
  std::unordered_map<JobId, Owner> owners_;
};

}  // namespace connect_bridge
