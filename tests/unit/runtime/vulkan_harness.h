// A small Vulkan for the runtime's tests: loads the loader itself (the runtime must not),
// switches validation and synchronisation validation on, and keeps their messages.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "rtc/abi.h"
#include "rtc/runtime.h"

#define HARNESS_FUNCTIONS(X)                                                                                 \
    X(EnumeratePhysicalDevices)                                                                              \
    X(GetPhysicalDeviceProperties) X(GetPhysicalDeviceQueueFamilyProperties)                                 \
        X(GetPhysicalDeviceMemoryProperties) X(CreateDevice) X(DestroyDevice) X(GetDeviceQueue)              \
            X(CreateBuffer) X(DestroyBuffer) X(GetBufferMemoryRequirements) X(AllocateMemory) X(FreeMemory)  \
                X(BindBufferMemory) X(MapMemory) X(CreateCommandPool) X(DestroyCommandPool) X(               \
                    AllocateCommandBuffers) X(BeginCommandBuffer) X(EndCommandBuffer) X(ResetCommandPool)    \
                    X(QueueSubmit) X(QueueWaitIdle) X(DeviceWaitIdle) X(CmdPipelineBarrier) X(CmdCopyBuffer) \
                        X(CmdFillBuffer) X(CreateDescriptorSetLayout) X(DestroyDescriptorSetLayout)          \
                            X(CreateDescriptorPool) X(DestroyDescriptorPool) X(AllocateDescriptorSets)       \
                                X(UpdateDescriptorSets) X(CreatePipelineLayout) X(DestroyPipelineLayout)     \
                                    X(CreateShaderModule) X(DestroyShaderModule) X(CreateComputePipelines)   \
                                        X(DestroyPipeline) X(CmdBindPipeline) X(CmdBindDescriptorSets)       \
                                            X(CmdDispatch) X(DestroyInstance) X(CmdPushConstants)            \
                                                X(CreateBufferView) X(DestroyBufferView)                     \
                                                    X(CreateDebugUtilsMessengerEXT)                          \
                                                        X(DestroyDebugUtilsMessengerEXT)

struct Buffer {
    VkBuffer handle = VK_NULL_HANDLE;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    VkDeviceSize size = 0;
    void* data = nullptr;
    template <typename T>
    T* as(VkDeviceSize offset = 0) const {
        return reinterpret_cast<T*>(static_cast<char*>(data) + offset);
    }
};

class Vulkan {
  public:
    // Null when there is no Vulkan device at all; `why` says so.
    static std::unique_ptr<Vulkan> create(std::string& why);
    ~Vulkan();

#define X(name) PFN_vk##name name = nullptr;
    HARNESS_FUNCTIONS(X)
#undef X
    PFN_vkGetInstanceProcAddr get_instance_proc_addr = nullptr;
    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical_device = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;
    uint32_t queue_family = 0;
    VkCommandPool pool = VK_NULL_HANDLE;
    VkCommandBuffer cmd = VK_NULL_HANDLE;
    bool validation = false;
    PFN_vkGetBufferDeviceAddress GetBufferDeviceAddress = nullptr;  // null: no address mode here
    bool update_after_bind = false;  // storage buffers can be
    std::vector<std::string> layer_messages;    // from the validation layers
    std::vector<std::string> runtime_messages;  // from the runtime: "id: text"

    Buffer buffer(VkDeviceSize size, VkBufferUsageFlags usage);
    void destroy(Buffer& buffer);
    void begin();
    void submit();  // ends, submits, waits
    void barrier(VkPipelineStageFlags src, VkAccessFlags src_access, VkPipelineStageFlags dst,
                 VkAccessFlags dst_access);
    void compute_barrier();
    void host_barrier();
    VkDebugUtilsMessengerCreateInfoEXT messenger_info(bool runtime);

  private:
    void* library_ = nullptr;
    VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
    std::vector<Buffer> buffers_;
};

// One device for all tests of the process; each test starts and ends without messages.
class RuntimeTest : public ::testing::Test {
  protected:
    void SetUp() override;
    void TearDown() override;
    static void TearDownTestSuite();

    // The runtime reported this id, and only then may runtime_messages be non-empty.
    void expect_runtime_error(const std::string& id);

    Vulkan* vk = nullptr;
    RtrDevice rtr = nullptr;
};
