// The compiled pipeline, its table and its launches.
#pragma once

#include <rtc/runtime.h>

#include <string>
#include <vector>

#include "reference.h"
#include "resources.h"
#include "vulkan_context.h"

namespace rtc::stress {

// The runtime with host allocations counted and its messages kept.
class Device {
  public:
    // `addresses`: address mode, for a context with device addresses. `budget`: RtrTraceOptions::stepBudget, RTR_DEFAULT:
    // what the device recommends, and kStepBudget where it recommends none.
    Device(const tools::Context& context, bool addresses, uint32_t budget);
    ~Device();
    Device(const Device&) = delete;
    Device& operator=(const Device&) = delete;

    const tools::Context& context;
    const bool addresses;
    uint32_t step_budget;
    RtrDevice handle = nullptr;
    RtrPhysicalDeviceSupport support{};
    void check(VkResult result, const char* call);  // throws tools::Error with the runtime's words
    std::string messages;                           // errors since the last check
    // Destroys the runtime's device; what it has allocated and not freed.
    long long close();

  private:
    static void* VKAPI_CALL allocate(void*, size_t, size_t, VkSystemAllocationScope);
    static void* VKAPI_CALL reallocate(void*, void*, size_t, size_t, VkSystemAllocationScope);
    static void VKAPI_CALL release(void*, void*);
    VkAllocationCallbacks callbacks_{};
    long long live_ = 0;
};

// A dispatch of turns that took seconds would lose a GPU to its watchdog, and one ray through a pile can do that.
constexpr uint32_t kStepBudget = 1u << 17;

struct Hit {  // as the shader writes it
    float t;
    uint32_t instance, custom, geometry, primitive, kind, record;
    float b1, b2;
    uint32_t candidates, hash, pad;
};
constexpr uint32_t kMissed = 0xffffffffu;

struct HitRecord {
    bool boxes = false;
    uint32_t id = 0, first_box = 0;
};

class Tracer {
  public:
    explicit Tracer(Device& device);
    ~Tracer();
    Tracer(const Tracer&) = delete;
    Tracer& operator=(const Tracer&) = delete;

    RtrRecorder recorder() const { return recorder_; }  // for builds too
    // `heap`: null in address mode.
    std::vector<Hit> trace(RtrHeap heap, RtrAccelerationStructure top, const std::vector<HitRecord>& records,
                           const std::vector<float>& boxes, const std::vector<Ray>& rays);

  private:
    void make_recorder(uint32_t rounds);
    Device& device_;
    uint32_t rounds_ = 0;
    RtrPipeline pipeline_ = nullptr;
    RtrRecorder recorder_ = nullptr;
    VkDescriptorSetLayout layout_ = VK_NULL_HANDLE;
    VkDescriptorPool pool_ = VK_NULL_HANDLE;
    VkDescriptorSet set_ = VK_NULL_HANDLE;
    tools::Buffer control_, scratch_;
};

constexpr uint32_t kMostRays = 4096;  // of a launch

}  // namespace rtc::stress
