#include "resources.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

#include "error.h"

namespace rtc::tools {
namespace {

VkDeviceMemory allocate(const Context& context, const VkMemoryRequirements& needed, MemoryKind kind,
                        bool addressable) {
    const VkMemoryPropertyFlags host =
        VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    uint32_t type = ~0u;
    if (kind == MemoryKind::Device)
        type = context.memory_type(needed.memoryTypeBits, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    if (kind == MemoryKind::Shared)
        type = context.memory_type(needed.memoryTypeBits, host | VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
    if (kind == MemoryKind::Readback)
        type = context.memory_type(needed.memoryTypeBits, host | VK_MEMORY_PROPERTY_HOST_CACHED_BIT);
    if (type == ~0u) type = context.memory_type(needed.memoryTypeBits, kind == MemoryKind::Device ? 0 : host);
    if (type == ~0u) throw Error("the device has no memory type for this resource");

    VkMemoryAllocateFlagsInfo flags{};
    flags.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO;
    flags.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
    VkMemoryAllocateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
    info.pNext = addressable ? &flags : nullptr;
    info.allocationSize = needed.size;
    info.memoryTypeIndex = type;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    const VkResult result = vkAllocateMemory(context.device, &info, nullptr, &memory);
    if (result != VK_SUCCESS)
        throw Error("cannot allocate " + std::to_string(needed.size >> 20) +
                    " MiB of device memory: " + result_name(result));
    return memory;
}

// Drivers may take more than they can address, and lose the device later.
void require_allocatable(const Context& context, VkDeviceSize bytes) {
    VkPhysicalDeviceMaintenance3Properties limits{};
    limits.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES;
    VkPhysicalDeviceProperties2 properties{};
    properties.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
    properties.pNext = &limits;
    vkGetPhysicalDeviceProperties2(context.physical, &properties);
    if (bytes > limits.maxMemoryAllocationSize)
        throw Error("a buffer of " + std::to_string(bytes) + " bytes: maxMemoryAllocationSize is " +
                    std::to_string(limits.maxMemoryAllocationSize));
}

constexpr VkImageAspectFlags kAspect = VK_IMAGE_ASPECT_COLOR_BIT;

void transition(VkCommandBuffer commands, const Image& image, VkImageLayout from, VkImageLayout to) {
    VkImageMemoryBarrier barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER;
    barrier.srcAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
    barrier.oldLayout = from;
    barrier.newLayout = to;
    barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = image.handle;
    barrier.subresourceRange = {kAspect, 0, 1, 0, image.desc.layers};
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0,
                         0, nullptr, 0, nullptr, 1, &barrier);
}

VkBufferImageCopy whole_image(const ImageDesc& desc) {
    VkBufferImageCopy copy{};
    copy.imageSubresource = {kAspect, 0, 0, desc.layers};
    copy.imageExtent = desc.extent;
    return copy;
}

size_t image_bytes(const ImageDesc& desc) {
    const uint32_t texel = format_texel_bytes(desc.format);
    if (texel == 0) throw Error("image format " + std::to_string(int(desc.format)) + " is not supported");
    return size_t(texel) * desc.extent.width * desc.extent.height * desc.extent.depth * desc.layers;
}

}  // namespace

Buffer::Buffer(const Context& context, VkDeviceSize size_, VkBufferUsageFlags usage, MemoryKind kind)
    : size(std::max<VkDeviceSize>(size_, 16)), device_(context.device) {
    const bool addressable = usage & VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
    VkBufferCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
    info.size = size;
    info.usage = usage;
    check(vkCreateBuffer(device_, &info, nullptr, &handle), "vkCreateBuffer");
    VkMemoryRequirements needed{};
    vkGetBufferMemoryRequirements(device_, handle, &needed);
    if (needed.size > 1u << 30) require_allocatable(context, needed.size);
    memory = allocate(context, needed, kind, addressable);
    check(vkBindBufferMemory(device_, handle, memory, 0), "vkBindBufferMemory");
    if (kind != MemoryKind::Device)
        check(vkMapMemory(device_, memory, 0, VK_WHOLE_SIZE, 0, &mapped), "vkMapMemory");
    if (addressable) {
        VkBufferDeviceAddressInfo addressInfo{};
        addressInfo.sType = VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO;
        addressInfo.buffer = handle;
        address = vkGetBufferDeviceAddress(device_, &addressInfo);
    }
}

Buffer::~Buffer() {
    if (!device_) return;
    vkDestroyBuffer(device_, handle, nullptr);
    vkFreeMemory(device_, memory, nullptr);
}

Buffer::Buffer(Buffer&& other) noexcept { *this = std::move(other); }

Buffer& Buffer::operator=(Buffer&& other) noexcept {
    std::swap(handle, other.handle);
    std::swap(memory, other.memory);
    std::swap(size, other.size);
    std::swap(mapped, other.mapped);
    std::swap(address, other.address);
    std::swap(device_, other.device_);
    return *this;
}

Buffer upload_buffer(const Context& context, const void* data, size_t bytes, VkBufferUsageFlags usage) {
    Buffer buffer(context, bytes, usage | VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryKind::Device);
    if (bytes == 0) return buffer;
    Buffer staging(context, bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MemoryKind::Host);
    std::memcpy(staging.mapped, data, bytes);
    context.run([&](VkCommandBuffer commands) {
        const VkBufferCopy copy{0, 0, bytes};
        vkCmdCopyBuffer(commands, staging.handle, buffer.handle, 1, &copy);
        full_barrier(commands);
    });
    return buffer;
}

std::vector<uint8_t> download_buffer(const Context& context, const Buffer& buffer, VkDeviceSize offset,
                                     VkDeviceSize bytes) {
    if (bytes == VK_WHOLE_SIZE) bytes = buffer.size - offset;
    std::vector<uint8_t> data(bytes);
    if (buffer.mapped) {
        std::memcpy(data.data(), static_cast<const uint8_t*>(buffer.mapped) + offset, bytes);
        return data;
    }
    Buffer staging(context, bytes, VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryKind::Readback);
    context.run([&](VkCommandBuffer commands) {
        full_barrier(commands);
        const VkBufferCopy copy{offset, 0, bytes};
        vkCmdCopyBuffer(commands, buffer.handle, staging.handle, 1, &copy);
        full_barrier(commands);
    });
    std::memcpy(data.data(), staging.mapped, bytes);
    return data;
}

Image::Image(const Context& context, const ImageDesc& desc_) : desc(desc_), device_(context.device) {
    const bool cube =
        desc.view_type == VK_IMAGE_VIEW_TYPE_CUBE || desc.view_type == VK_IMAGE_VIEW_TYPE_CUBE_ARRAY;
    VkImageCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO;
    info.flags = cube ? VK_IMAGE_CREATE_CUBE_COMPATIBLE_BIT : 0;
    switch (desc.view_type) {
        case VK_IMAGE_VIEW_TYPE_1D:
        case VK_IMAGE_VIEW_TYPE_1D_ARRAY:
            info.imageType = VK_IMAGE_TYPE_1D;
            break;
        case VK_IMAGE_VIEW_TYPE_3D:
            info.imageType = VK_IMAGE_TYPE_3D;
            break;
        default:
            info.imageType = VK_IMAGE_TYPE_2D;
    }
    info.format = desc.format;
    info.extent = desc.extent;
    info.mipLevels = 1;
    info.arrayLayers = desc.layers;
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.tiling = VK_IMAGE_TILING_OPTIMAL;
    info.usage = desc.usage | VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
    const VkPhysicalDeviceLimits& limits = context.properties.limits;
    const bool solid = info.imageType == VK_IMAGE_TYPE_3D;
    const uint32_t limit = solid ? limits.maxImageDimension3D : limits.maxImageDimension2D;
    const std::string size = std::to_string(desc.extent.width) + "x" + std::to_string(desc.extent.height) +
                             (solid ? "x" + std::to_string(desc.extent.depth) : std::string());
    if (desc.extent.width > limit || desc.extent.height > limit || desc.extent.depth > limit)
        throw Error("an image of " + size + " texels: the device's " +
                    (solid ? "maxImageDimension3D" : "maxImageDimension2D") + " is " + std::to_string(limit));
    auto check_memory = [&](VkResult result, const char* call) {
        if (result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY)
            throw Error("the device has no memory for an image of " + size + " texels (" + call + ")");
        check(result, call);
    };
    check_memory(vkCreateImage(device_, &info, nullptr, &handle), "vkCreateImage");
    VkMemoryRequirements needed{};
    vkGetImageMemoryRequirements(device_, handle, &needed);
    memory = allocate(context, needed, MemoryKind::Device, false);
    check_memory(vkBindImageMemory(device_, handle, memory, 0), "vkBindImageMemory");

    VkImageViewCreateInfo viewInfo{};
    viewInfo.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO;
    viewInfo.image = handle;
    viewInfo.viewType = desc.view_type;
    viewInfo.format = desc.format;
    viewInfo.subresourceRange = {kAspect, 0, 1, 0, desc.layers};
    check(vkCreateImageView(device_, &viewInfo, nullptr, &view), "vkCreateImageView");

    context.run([&](VkCommandBuffer commands) {
        transition(commands, *this, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_GENERAL);
        const VkClearColorValue zero{};
        vkCmdClearColorImage(commands, handle, VK_IMAGE_LAYOUT_GENERAL, &zero, 1, &viewInfo.subresourceRange);
        full_barrier(commands);
    });
}

Image::~Image() {
    if (!device_) return;
    vkDestroyImageView(device_, view, nullptr);
    vkDestroyImage(device_, handle, nullptr);
    vkFreeMemory(device_, memory, nullptr);
}

Image::Image(Image&& other) noexcept { *this = std::move(other); }

Image& Image::operator=(Image&& other) noexcept {
    std::swap(handle, other.handle);
    std::swap(memory, other.memory);
    std::swap(view, other.view);
    std::swap(desc, other.desc);
    std::swap(device_, other.device_);
    return *this;
}

BufferView::BufferView(const Context& context, const Buffer& buffer, VkFormat format)
    : device_(context.device) {
    const VkDeviceSize texels = buffer.size / std::max(1u, format_texel_bytes(format));
    if (texels > context.properties.limits.maxTexelBufferElements)
        throw Error("a table of " + std::to_string(texels) +
                    " texels exceeds the device's maxTexelBufferElements " +
                    std::to_string(context.properties.limits.maxTexelBufferElements));
    VkBufferViewCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO;
    info.buffer = buffer.handle;
    info.format = format;
    info.range = VK_WHOLE_SIZE;
    check(vkCreateBufferView(device_, &info, nullptr, &handle), "vkCreateBufferView");
}

BufferView::~BufferView() {
    if (device_) vkDestroyBufferView(device_, handle, nullptr);
}

BufferView::BufferView(BufferView&& other) noexcept { *this = std::move(other); }

BufferView& BufferView::operator=(BufferView&& other) noexcept {
    std::swap(handle, other.handle);
    std::swap(device_, other.device_);
    return *this;
}

uint32_t format_texel_bytes(VkFormat format) {
    switch (format) {
        case VK_FORMAT_R8_UNORM:
        case VK_FORMAT_R8_SNORM:
        case VK_FORMAT_R8_UINT:
        case VK_FORMAT_R8_SINT:
            return 1;
        case VK_FORMAT_R8G8_UNORM:
        case VK_FORMAT_R8G8_SNORM:
        case VK_FORMAT_R8G8_UINT:
        case VK_FORMAT_R8G8_SINT:
        case VK_FORMAT_R16_UNORM:
        case VK_FORMAT_R16_SNORM:
        case VK_FORMAT_R16_UINT:
        case VK_FORMAT_R16_SINT:
        case VK_FORMAT_R16_SFLOAT:
            return 2;
        case VK_FORMAT_R8G8B8A8_UNORM:
        case VK_FORMAT_R8G8B8A8_SNORM:
        case VK_FORMAT_R8G8B8A8_UINT:
        case VK_FORMAT_R8G8B8A8_SINT:
        case VK_FORMAT_R8G8B8A8_SRGB:
        case VK_FORMAT_B8G8R8A8_UNORM:
        case VK_FORMAT_A2B10G10R10_UNORM_PACK32:
        case VK_FORMAT_A2B10G10R10_UINT_PACK32:
        case VK_FORMAT_B10G11R11_UFLOAT_PACK32:
        case VK_FORMAT_R16G16_UNORM:
        case VK_FORMAT_R16G16_SNORM:
        case VK_FORMAT_R16G16_UINT:
        case VK_FORMAT_R16G16_SINT:
        case VK_FORMAT_R16G16_SFLOAT:
        case VK_FORMAT_R32_UINT:
        case VK_FORMAT_R32_SINT:
        case VK_FORMAT_R32_SFLOAT:
            return 4;
        case VK_FORMAT_R16G16B16A16_UNORM:
        case VK_FORMAT_R16G16B16A16_SNORM:
        case VK_FORMAT_R16G16B16A16_UINT:
        case VK_FORMAT_R16G16B16A16_SINT:
        case VK_FORMAT_R16G16B16A16_SFLOAT:
        case VK_FORMAT_R32G32_UINT:
        case VK_FORMAT_R32G32_SINT:
        case VK_FORMAT_R32G32_SFLOAT:
        case VK_FORMAT_R64_UINT:
        case VK_FORMAT_R64_SINT:
            return 8;
        case VK_FORMAT_R32G32B32A32_UINT:
        case VK_FORMAT_R32G32B32A32_SINT:
        case VK_FORMAT_R32G32B32A32_SFLOAT:
            return 16;
        default:
            return 0;
    }
}

std::vector<uint8_t> download_image(const Context& context, const Image& image) {
    Buffer staging(context, image_bytes(image.desc), VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryKind::Readback);
    context.run([&](VkCommandBuffer commands) {
        full_barrier(commands);
        const VkBufferImageCopy copy = whole_image(image.desc);
        transition(commands, image, VK_IMAGE_LAYOUT_GENERAL, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
        vkCmdCopyImageToBuffer(commands, image.handle, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, staging.handle,
                               1, &copy);
        transition(commands, image, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, VK_IMAGE_LAYOUT_GENERAL);
        full_barrier(commands);
    });
    std::vector<uint8_t> texels(image_bytes(image.desc));
    std::memcpy(texels.data(), staging.mapped, texels.size());
    return texels;
}

void upload_image(const Context& context, const Image& image, std::span<const uint8_t> texels) {
    const size_t bytes = image_bytes(image.desc);
    if (texels.size() != bytes)
        throw Error("image data has " + std::to_string(texels.size()) + " bytes, not " +
                    std::to_string(bytes));
    Buffer staging(context, bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MemoryKind::Host);
    std::memcpy(staging.mapped, texels.data(), bytes);
    context.run([&](VkCommandBuffer commands) {
        full_barrier(commands);
        const VkBufferImageCopy copy = whole_image(image.desc);
        transition(commands, image, VK_IMAGE_LAYOUT_GENERAL, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
        vkCmdCopyBufferToImage(commands, staging.handle, image.handle, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                               1, &copy);
        transition(commands, image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_IMAGE_LAYOUT_GENERAL);
        full_barrier(commands);
    });
}

void full_barrier(VkCommandBuffer commands) {
    VkMemoryBarrier barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
    barrier.srcAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
    // The host reads readback buffers after the fence.
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT,
                         VK_PIPELINE_STAGE_ALL_COMMANDS_BIT | VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &barrier, 0,
                         nullptr, 0, nullptr);
}

}  // namespace rtc::tools
