// Who runs a job: a device with an executor and a dialect.
#pragma once

#include <memory>
#include <set>
#include <string>

#include "pipeline_statistics.h"
#include "rtc_executor.h"
#include "session.h"

namespace rtc::run {

enum class Backend { Rtc, Khr, Nv };

// A backend with a dialect: "rtc-nv", "rtc-ext", "khr", "nv".
struct Variant {
    std::string name;
    Backend backend;
    Dialect dialect;
    std::set<std::string> attributes;  // what a case's "only" and "skip" may name
};
Variant variant_of(const std::string& name);

// A device on which some backends run; made once, used for many jobs.
class Host {
  public:
    struct Options {
        std::string device;
        bool validate = false, print_device = true, statistics = false;
    };
    Host(std::set<Backend> backends, const Options& options);
    RunResult run(Backend backend, const Job& job, const RtcOptions& options, unsigned repeats = 1);
    const native::Context& context() const { return *context_; }

  private:
    native::Requirements khr_{native::Requirements::Kind::Khr}, nv_{native::Requirements::Kind::Nv};
    VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR statistics_{};
    std::unique_ptr<native::Context> context_;
    std::unique_ptr<RtcDevice> rtc_;
};

struct SuiteOptions {
    std::string folder, filter, json;
    std::vector<std::string> variants = {"rtc-nv", "rtc-ext"};
    Host::Options host;
    RtcOptions rtc;
    bool list = false, verbose = false, compare = false;  // compare: with native KHR, whole outputs
    unsigned timeout_seconds = 120;                       // for one case
    double limit_seconds = 0;                             // for all; cases behind it are skipped. 0: none
    size_t shard = 0, shards = 1;                         // only every shards-th case, from `shard` on
    std::string save_oracle, oracle;                      // folders of outputs of the native run
};
// Case files under a folder whose path below it holds `filter`, or fits it as a pattern of * and ?; sorted.
std::vector<std::string> suite_files(const std::string& folder, const std::string& filter);
// Exit status: 0 all passed.
int run_suite(const SuiteOptions& options);

}  // namespace rtc::run
