/* Host memory through the application's callbacks, and messages to its messenger. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "internal.h"

void* rtr_alloc(const VkAllocationCallbacks* allocator, size_t size) {
    void* memory;
    if (size == 0) size = 1;
    if (allocator) {
        memory = allocator->pfnAllocation(allocator->pUserData, size, 16, VK_SYSTEM_ALLOCATION_SCOPE_OBJECT);
    } else {
        memory = malloc(size);
    }
    if (memory) memset(memory, 0, size);
    return memory;
}

void rtr_free(const VkAllocationCallbacks* allocator, void* memory) {
    if (!memory) return;
    if (allocator) {
        allocator->pfnFree(allocator->pUserData, memory);
    } else {
        free(memory);
    }
}

const VkAllocationCallbacks* rtr_pick(RtrDevice device, const VkAllocationCallbacks* allocator) {
    if (allocator) return allocator;
    return device && device->has_allocator ? &device->allocator : NULL;
}

static void send(RtrDevice device, VkDebugUtilsMessageSeverityFlagBitsEXT severity, const char* id,
                 const char* format, va_list arguments) {
    char text[1024];
    VkDebugUtilsMessengerCallbackDataEXT data;
    if (!device || !device->message_callback || !(device->message_severities & severity) ||
        !(device->message_types & VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT)) {
        return;
    }
    vsnprintf(text, sizeof text, format, arguments);
    memset(&data, 0, sizeof data);
    data.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CALLBACK_DATA_EXT;
    data.pMessageIdName = id;
    data.pMessage = text;
    device->message_callback(severity, VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT, &data,
                             device->message_user_data);
}

VkResult rtr_check_chain(RtrDevice device, const char* owner, const void* next) {
    if (!next) return VK_SUCCESS;
    return rtr_error(device, VK_ERROR_VALIDATION_FAILED_EXT, "pNext",
                     "%s::pNext leads to a structure of type %d, which rtc does not know; it must be NULL",
                     owner, (int)((const VkBaseInStructure*)next)->sType);
}

VkBool32 rtrIsValidating(RtrDevice d) { return d->validation; }

VkResult rtr_check_structure(RtrDevice device, const char* owner, const void* structure, VkStructureType type) {
    const VkBaseInStructure* s = structure;
    if (s->sType != type)
        return rtr_error(device, VK_ERROR_VALIDATION_FAILED_EXT, "sType", "%s::sType is %d, not %d", owner,
                         (int)s->sType, (int)type);
    return rtr_check_chain(device, owner, s->pNext);
}

void rtrReportMessage(RtrDevice device, VkDebugUtilsMessageSeverityFlagBitsEXT severity, const char* id,
                      const char* text) {
    if (severity == VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT) {
        rtr_error(device, VK_SUCCESS, id, "%s", text);
    } else {
        rtr_warning(device, id, "%s", text);
    }
}

VkResult rtr_error(RtrDevice device, VkResult result, const char* id, const char* format, ...) {
    va_list arguments;
    va_start(arguments, format);
    send(device, VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT, id, format, arguments);
    va_end(arguments);
    return result;
}

void rtr_warning(RtrDevice device, const char* id, const char* format, ...) {
    va_list arguments;
    va_start(arguments, format);
    send(device, VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT, id, format, arguments);
    va_end(arguments);
}
