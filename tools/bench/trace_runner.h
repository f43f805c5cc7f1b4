// What the trace benchmark runs: one workload of one scene, through rtc or through the device's own ray tracing,
// with the same shaders.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "../native/executor.h"
#include "comparison.h"
#include "render_job.h"
#include "rtc_compile.h"
#include "rtc_device.h"
#include "trace_variant.h"

namespace rtc::bench {

struct Workload {
    std::string name;  // "primary", "ao", "path", "recursive"
    tools::RenderSettings settings;
};

// One of workload_names() at a size. Throws tools::Error.
Workload make_workload(const std::string& name, uint32_t width, uint32_t height);
std::vector<std::string> workload_names();

class TraceRunner {
  public:
    explicit TraceRunner(std::string name_) : name(std::move(name_)) {}
    virtual ~TraceRunner() = default;
    // Records one launch of every pass, with barriers between and after.
    virtual void record(VkCommandBuffer commands, uint32_t sample) = 0;
    // After the commands have completed; throws when a launch failed.
    virtual void finish() {}
    virtual uint32_t max_batch() const { return 16; }
    virtual const tools::RenderJob& job() const = 0;
    // Launches that cover the same picture with fewer rays; {0, 0}: whole.
    virtual void set_size(uint32_t, uint32_t) {}

    const std::string name;
    std::string statistics;  // what the driver tells of the compiled pipelines, as "registers 64, ..."
};

// Whether the variant's structures are reached by device address: its modules decide where it brings some.
bool by_address(const TraceVariant& variant, const tools::RtcDevice& device);

// Compiles each pass once for all scenes.
class ModuleCache {
  public:
    explicit ModuleCache(std::string save_folder) : save_folder_(std::move(save_folder)) {}
    // File name in a folder of modules: WORKLOAD-PASS.spv.
    const std::vector<uint32_t>& get(const std::string& workload, const tools::RayTracingJob& pass,
                                     const TraceVariant& variant, const tools::RtcDevice& device);

  private:
    std::string save_folder_;
    std::map<std::string, std::vector<uint32_t>> modules_;
};

std::unique_ptr<TraceRunner> make_rtc_runner(const tools::RtcDevice& device, const tools::Scene& scene,
                                             std::shared_ptr<tools::RtcScene> structures,
                                             const Workload& workload, const TraceVariant& variant,
                                             ModuleCache& modules);
std::unique_ptr<TraceRunner> make_native_runner(const tools::Context& context, const tools::Scene& scene,
                                                const Workload& workload, native::Requirements::Kind kind);

// The picture after `samples` launches and the last one's first hits.
tools::RenderResult result_of(const tools::Context& context, const tools::RenderJob& job, uint32_t samples);

}  // namespace rtc::bench
