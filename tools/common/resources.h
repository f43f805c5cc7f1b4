// Buffers and images with their memory, freed when they go out of scope.
#pragma once

#include <vulkan/vulkan.h>

#include <cstdint>
#include <span>
#include <vector>

#include "vulkan_context.h"

namespace rtc::tools {

enum class MemoryKind {
    Device,   // device local
    Host,     // host visible and coherent, for writing
    Shared,   // host visible and coherent, on the device where it has such memory
    Readback  // host visible and coherent, cached where the device has it
};

class Buffer {
  public:
    Buffer() = default;
    // Host and Readback buffers stay mapped. `size` 0 becomes 16: Vulkan has no empty buffers.
    Buffer(const Context& context, VkDeviceSize size, VkBufferUsageFlags usage, MemoryKind kind);
    ~Buffer();
    Buffer(Buffer&& other) noexcept;
    Buffer& operator=(Buffer&& other) noexcept;

    VkBuffer handle = VK_NULL_HANDLE;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    VkDeviceSize size = 0;
    void* mapped = nullptr;
    VkDeviceAddress address = 0;  // when usage asks for it

  private:
    VkDevice device_ = VK_NULL_HANDLE;
};

// A device-local buffer filled with `data` (through a staging buffer, waits).
Buffer upload_buffer(const Context& context, const void* data, size_t bytes, VkBufferUsageFlags usage);
template <typename T>
Buffer upload_vector(const Context& context, const std::vector<T>& data, VkBufferUsageFlags usage) {
    return upload_buffer(context, data.data(), data.size() * sizeof(T), usage);
}
// The buffer's bytes on the host (waits). The buffer needs TRANSFER_SRC unless it is mapped.
std::vector<uint8_t> download_buffer(const Context& context, const Buffer& buffer, VkDeviceSize offset = 0,
                                     VkDeviceSize bytes = VK_WHOLE_SIZE);

struct ImageDesc {
    VkImageViewType view_type = VK_IMAGE_VIEW_TYPE_2D;
    VkFormat format = VK_FORMAT_R32G32B32A32_SFLOAT;
    VkExtent3D extent{1, 1, 1};
    uint32_t layers = 1;
    VkImageUsageFlags usage = VK_IMAGE_USAGE_STORAGE_BIT;  // transfer source and destination are added
};

class Image {
  public:
    Image() = default;
    // The image starts in VK_IMAGE_LAYOUT_GENERAL, contents zero.
    Image(const Context& context, const ImageDesc& desc);
    ~Image();
    Image(Image&& other) noexcept;
    Image& operator=(Image&& other) noexcept;

    VkImage handle = VK_NULL_HANDLE;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    VkImageView view = VK_NULL_HANDLE;
    ImageDesc desc;

  private:
    VkDevice device_ = VK_NULL_HANDLE;
};

// A buffer seen as texels; the buffer must outlive it.
class BufferView {
  public:
    BufferView() = default;
    // Throws Error when the buffer has more texels than the device's maxTexelBufferElements.
    BufferView(const Context& context, const Buffer& buffer, VkFormat format);
    ~BufferView();
    BufferView(BufferView&& other) noexcept;
    BufferView& operator=(BufferView&& other) noexcept;

    VkBufferView handle = VK_NULL_HANDLE;

  private:
    VkDevice device_ = VK_NULL_HANDLE;
};

uint32_t format_texel_bytes(VkFormat format);  // 0 for formats the tools do not know
// Texels of all layers, tightly packed; the image stays in VK_IMAGE_LAYOUT_GENERAL (waits).
std::vector<uint8_t> download_image(const Context& context, const Image& image);
void upload_image(const Context& context, const Image& image, std::span<const uint8_t> texels);

// A full memory barrier between everything; tools measure kernels, not barriers.
void full_barrier(VkCommandBuffer commands);

}  // namespace rtc::tools
