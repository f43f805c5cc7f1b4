/* Loads Vulkan by name; the runtime links no loader. */
#include "internal.h"

bool rtr_load_instance_table(VkInstance instance, PFN_vkGetInstanceProcAddr get, RtrInstanceTable* table,
                             const char** missing) {
    /* ISO C has no conversion from function pointer to function pointer through void*;
     * a cast between function pointer types is well defined. */
#define X(name)                                            \
    table->name = (PFN_vk##name)get(instance, "vk" #name); \
    if (!table->name) {                                    \
        *missing = "vk" #name;                             \
        return false;                                      \
    }
    RTR_INSTANCE_FUNCTIONS(X)
#undef X
    return true;
}

bool rtr_load_device_table(const RtrInstanceTable* instance, VkDevice device, RtrDeviceTable* table,
                           const char** missing) {
#define X(name)                                                                  \
    table->name = (PFN_vk##name)instance->GetDeviceProcAddr(device, "vk" #name); \
    if (!table->name) {                                                          \
        *missing = "vk" #name;                                                   \
        return false;                                                            \
    }
    RTR_DEVICE_FUNCTIONS(X)
#undef X
    return true;
}

RtrGetBufferDeviceAddress rtr_load_buffer_device_address(const RtrInstanceTable* instance, VkDevice device) {
    PFN_vkVoidFunction f = instance->GetDeviceProcAddr(device, "vkGetBufferDeviceAddressKHR");
    if (!f) f = instance->GetDeviceProcAddr(device, "vkGetBufferDeviceAddress");
    return (RtrGetBufferDeviceAddress)f;
}
