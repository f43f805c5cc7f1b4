// The executor on rtc itself: stages linked by the compiler library, scene, table
// and launch through the runtime.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "../native/executor.h"
#include "addressing.h"

struct RtrDevice_T;

namespace rtc::run {

struct RtcOptions {
    bool optimize = false;
    int resumable = -1;        // -1: what the device needs
    uint32_t step_budget = 0;  // loop turns before a lane suspends; 0: the device's default
    uint32_t rounds = 0;       // launches in which suspended lanes go on; 0: 64, the runtime's default
    int fetch = -1;            // 0 texels, 1 storage buffer; -1: as the device recommends
    tools::Addressing addressing = tools::Addressing::Recommended;
    std::string accuracy = "watertight";  // tier of the traversal
    std::string assume;        // promises about the scene, by name
    bool specialize = true;    // false: nothing is removed for what is known
    bool statistics = false;   // print what the driver tells of the pipeline
    std::string save_module;   // writes the linked module there
    bool print_warnings = true;
};

// The runtime on a device. Its build kernels are compiled once, so many executors share one.
class RtcDevice {
  public:
    // Throws when this program was built without compiler or runtime.
    explicit RtcDevice(const native::Context& context);
    ~RtcDevice();
    RtcDevice(const RtcDevice&) = delete;
    RtcDevice& operator=(const RtcDevice&) = delete;

    const native::Context& context;
    RtrDevice_T* handle = nullptr;
    std::string said;  // what the runtime's messenger said since the last clear()
};

std::unique_ptr<native::Executor> make_rtc(RtcDevice& device, const RtcOptions& options);
bool has_rtc();

}  // namespace rtc::run
