#include "error.h"

#include <cstdio>
#include <exception>

namespace rtc::tools {

const char* result_name(VkResult result) {
    switch (result) {
#define RTC_NAME(name) \
    case name:         \
        return #name;
        RTC_NAME(VK_SUCCESS)
        RTC_NAME(VK_NOT_READY)
        RTC_NAME(VK_TIMEOUT)
        RTC_NAME(VK_INCOMPLETE)
        RTC_NAME(VK_ERROR_OUT_OF_HOST_MEMORY)
        RTC_NAME(VK_ERROR_OUT_OF_DEVICE_MEMORY)
        RTC_NAME(VK_ERROR_INITIALIZATION_FAILED)
        RTC_NAME(VK_ERROR_DEVICE_LOST)
        RTC_NAME(VK_ERROR_MEMORY_MAP_FAILED)
        RTC_NAME(VK_ERROR_LAYER_NOT_PRESENT)
        RTC_NAME(VK_ERROR_EXTENSION_NOT_PRESENT)
        RTC_NAME(VK_ERROR_FEATURE_NOT_PRESENT)
        RTC_NAME(VK_ERROR_INCOMPATIBLE_DRIVER)
        RTC_NAME(VK_ERROR_TOO_MANY_OBJECTS)
        RTC_NAME(VK_ERROR_FORMAT_NOT_SUPPORTED)
        RTC_NAME(VK_ERROR_FRAGMENTED_POOL)
        RTC_NAME(VK_ERROR_OUT_OF_POOL_MEMORY)
        RTC_NAME(VK_ERROR_UNKNOWN)
        RTC_NAME(VK_ERROR_VALIDATION_FAILED_EXT)
        RTC_NAME(VK_ERROR_INVALID_SHADER_NV)
#undef RTC_NAME
        default:
            return "VkResult";
    }
}

void check(VkResult result, const char* call) {
    if (result == VK_SUCCESS) return;
    throw Error(std::string(call) + ": " + result_name(result) + " (" + std::to_string(int(result)) + ")");
}

int run_program(const char* program, const std::function<int()>& body) {
    try {
        return body();
    } catch (const std::exception& problem) {
        std::fflush(stdout);
        std::fprintf(stderr, "%s: error: %s\n", program, problem.what());
        return 1;
    }
}

}  // namespace rtc::tools
