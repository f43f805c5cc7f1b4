// One run of a job on one executor: resources made and filled, traced, read back.
#pragma once

#include <string>
#include <vector>

#include "job.h"

namespace rtc::run {

struct Output {  // a buffer or image that a shader may have written
    Slot slot;
    uint32_t element = 0;  // of an array
    std::string name;
    bool is_image = false;
    Bytes bytes;
    TypeRef block;  // buffers
    TexelFormat format{};
    VkExtent3D extent{};
    uint32_t layers = 1;
};

struct RunResult {
    std::vector<Output> outputs;
    std::string launch_error;   // "" or "NAME: text", from rtc's launch error record
    double device_seconds = 0;  // of the trace alone; the best of all repetitions
    double create_seconds = 0;  // pipeline creation on the host
};

constexpr uint32_t kNullTop = ~0u;  // for Executor::write_top: a null acceleration structure

// The compiled job (see compile()) on a fresh executor.
RunResult run_job(const native::Context& context, native::Executor& executor, const Job& job,
                  unsigned repeats = 1);

// All resources of all stages by slot; throws where two stages disagree about a descriptor's type.
std::map<Slot, Resource> merge_resources(const Job& job);

}  // namespace rtc::run
