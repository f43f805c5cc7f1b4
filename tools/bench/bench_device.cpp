#include "bench_device.h"

#include <algorithm>
#include <cstring>
#include <ctime>
#include <thread>

#include "pipeline_statistics.h"

namespace rtc::bench {
namespace {

using Kind = native::Requirements::Kind;

bool device_has(const std::string& wanted, const char* extension) {
    const tools::DeviceList list;
    const tools::DeviceInfo& chosen = tools::select_device(list.devices, wanted);
    uint32_t count = 0;
    vkEnumerateDeviceExtensionProperties(chosen.physical, nullptr, &count, nullptr);
    std::vector<VkExtensionProperties> properties(count);
    vkEnumerateDeviceExtensionProperties(chosen.physical, nullptr, &count, properties.data());
    return std::any_of(properties.begin(), properties.end(), [&](const VkExtensionProperties& property) {
        return std::strcmp(property.extensionName, extension) == 0;
    });
}

}  // namespace

BenchDevice::BenchDevice(const std::string& device, const std::vector<std::string>& native, bool validate,
                         bool statistics) {
    for (const std::string& name : native) {
        if (name == "none") continue;
        if (name == "nv" || (name == "auto" && device_has(device, VK_NV_RAY_TRACING_EXTENSION_NAME)))
            kinds.push_back(Kind::Nv);
        if (name == "khr" || (name == "auto" && device_has(device, VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME)))
            kinds.push_back(Kind::Khr);
    }
    tools::ContextOptions options;
    options.device = device;
    options.validate = validate;
    if (statistics) tools::want_pipeline_statistics(options, statistics_features_);
    for (Kind kind : kinds) {
        requirements_.push_back(std::make_unique<native::Requirements>(kind));
        requirements_.back()->apply(options);
    }
    context = std::make_unique<tools::Context>(options);
    rtc = std::make_unique<tools::RtcDevice>(*context);
    timer_ = std::make_unique<tools::GpuTimer>(*context);
    description = tools::describe_device(context->properties, context->driver);
}

double BenchDevice::time(const std::function<void(VkCommandBuffer)>& record) const {
    if (is_cpu()) {
        const VkCommandBuffer commands = context->begin_commands();
        record(commands);
        const std::clock_t begin = std::clock();
        context->submit_and_wait(commands);
        return double(std::clock() - begin) / CLOCKS_PER_SEC / std::max(1u, std::thread::hardware_concurrency());
    }
    context->run([&](VkCommandBuffer commands) {
        timer_->reset(commands);
        timer_->begin(commands);
        record(commands);
        timer_->end(commands);
    });
    return timer_->seconds();
}

double median_of(std::vector<double> values) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    const size_t middle = values.size() / 2;
    return values.size() % 2 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

}  // namespace rtc::bench
