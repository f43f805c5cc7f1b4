#include "rtc_device.h"

#include <cstdio>

#include "error.h"

namespace rtc::tools {
namespace {

VKAPI_ATTR VkBool32 VKAPI_CALL collect(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                                       VkDebugUtilsMessageTypeFlagsEXT,
                                       const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
    auto messages = static_cast<std::string*>(user);
    if (severity & VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT) {
        *messages += (messages->empty() ? "" : "\n");
        *messages += data->pMessage;
    } else {
        std::fprintf(stderr, "runtime: %s\n", data->pMessage);
    }
    return VK_FALSE;
}

}  // namespace

RtcDevice::RtcDevice(const Context& context_)
    : context(context_), messages_(std::make_unique<std::string>()) {
    tools::check(
        rtrGetPhysicalDeviceSupport(context.instance, context.physical, vkGetInstanceProcAddr, &support),
        "rtrGetPhysicalDeviceSupport");
    VkDebugUtilsMessengerCreateInfoEXT messenger{};
    messenger.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
    messenger.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    messenger.messageType =
        VK_DEBUG_UTILS_MESSAGE_TYPE_GENERAL_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
    messenger.pfnUserCallback = collect;
    messenger.pUserData = messages_.get();
    RtrDeviceCreateInfo info{};
    info.instance = context.instance;
    info.physicalDevice = context.physical;
    info.device = context.device;
    info.pfnGetInstanceProcAddr = vkGetInstanceProcAddr;
    info.pMessenger = &messenger;
    info.bufferDeviceAddress = context.device_addresses;
    check(rtrCreateDevice(&info, nullptr, &handle), "rtrCreateDevice");
}

bool RtcDevice::by_address(Addressing wanted) const {
    return tools::by_address(context, wanted, support.recommendAddresses);
}

RtcDevice::~RtcDevice() { rtrDestroyDevice(handle, nullptr); }

void RtcDevice::check(VkResult result, const char* call) const {
    if (result == VK_SUCCESS) return;
    std::string text = std::string(call) + ": " + result_name(result);
    if (!messages_->empty()) text += "\n" + *messages_;
    messages_->clear();
    throw Error(text);
}

}  // namespace rtc::tools
