#include "session.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <deque>

#include "../common/resources.h"
#include "files.h"

namespace rtc::run {

using native::Executor;
using tools::Buffer;
using tools::check;
using tools::Context;
using tools::Error;
using tools::Image;
using tools::MemoryKind;

namespace {

const char* type_name(const Resource& resource) {
    if (resource.acceleration_structure) return "an acceleration structure";
    switch (resource.type) {
        case VK_DESCRIPTOR_TYPE_SAMPLER:
            return "a sampler";
        case VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER:
            return "a combined image sampler";
        case VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE:
            return "a sampled image";
        case VK_DESCRIPTOR_TYPE_STORAGE_IMAGE:
            return "a storage image";
        case VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER:
            return "a uniform texel buffer";
        case VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER:
            return "a storage texel buffer";
        case VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER:
            return "a uniform buffer";
        case VK_DESCRIPTOR_TYPE_STORAGE_BUFFER:
            return "a storage buffer";
        default:
            return "another descriptor";
    }
}

VkImageViewType view_type(const ImageShape& shape) {
    switch (shape.dim) {
        case 0:
            return shape.arrayed ? VK_IMAGE_VIEW_TYPE_1D_ARRAY : VK_IMAGE_VIEW_TYPE_1D;
        case 2:
            return VK_IMAGE_VIEW_TYPE_3D;
        case 3:
            return shape.arrayed ? VK_IMAGE_VIEW_TYPE_CUBE_ARRAY : VK_IMAGE_VIEW_TYPE_CUBE;
        default:
            return shape.arrayed ? VK_IMAGE_VIEW_TYPE_2D_ARRAY : VK_IMAGE_VIEW_TYPE_2D;
    }
}

struct Bound {  // an array element of a slot
    Slot slot;
    uint32_t element = 0;
    const Resource* resource = nullptr;
    std::unique_ptr<Buffer> buffer;
    std::unique_ptr<Image> image;
    TexelFormat format{};
    VkSampler sampler = VK_NULL_HANDLE;
    VkBufferView view = VK_NULL_HANDLE;
    uint32_t top = 0;
};

class Session {
  public:
    Session(const Context& context, Executor& executor, const Job& job)
        : context_(context), executor_(executor), job_(job), resources_(merge_resources(job)) {}

    ~Session() {
        for (Bound& bound : bound_) {
            vkDestroySampler(context_.device, bound.sampler, nullptr);
            vkDestroyBufferView(context_.device, bound.view, nullptr);
        }
        vkDestroyDescriptorPool(context_.device, pool_, nullptr);
        for (VkDescriptorSetLayout layout : layouts_)
            vkDestroyDescriptorSetLayout(context_.device, layout, nullptr);
    }

    RunResult run(unsigned repeats) {
        for (const auto& [key, value] : job_.bindings.items())
            if (!resources_.count(parse_slot(key)))
                throw Error("a value is given for binding " + key + ", which no shader uses");
        executor_.build(job_.world);
        for (const auto& [slot, resource] : resources_) create(slot, resource);
        for (Bound& bound : bound_) fill_buffer(bound);
        make_sets();
        RunResult result;
        auto before = std::chrono::steady_clock::now();
        Bytes push = push_constants();
        executor_.create_pipeline(job_.pipeline, layouts_, uint32_t(push.size()));
        result.create_seconds =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
        AddressOf address = [this](const std::string& slot) { return address_of(slot); };
        executor_.set_tables(make_tables(job_, address));
        for (const Bound& bound : bound_)
            if (bound.resource->acceleration_structure)
                executor_.write_top(sets_.at(bound.slot.set), bound.slot.binding, bound.element, bound.top);
        native::Launch launch{job_.width, job_.height, job_.depth, sets_, push};
        tools::GpuTimer timer(context_);
        for (unsigned r = 0; r < std::max(1u, repeats); ++r) {
            context_.run([&](VkCommandBuffer commands) {
                tools::full_barrier(commands);
                timer.reset(commands);
                timer.begin(commands);
                executor_.trace(commands, launch);
                timer.end(commands);
                tools::full_barrier(commands);
            });
            result.launch_error = executor_.finish();
            double seconds = timer.seconds();
            if (r == 0 || seconds < result.device_seconds) result.device_seconds = seconds;
        }
        for (Bound& bound : bound_) read_back(bound, result);
        return result;
    }

  private:
    Json spec_of(Slot slot, uint32_t element) const {
        auto found = job_.bindings.find(slot_name(slot));
        if (found == job_.bindings.end()) return Json::object();
        if (found->is_object() && found->contains("elements")) {
            const Json& elements = (*found)["elements"];
            return element < elements.size() ? elements[element] : Json::object();
        }
        return *found;
    }

    void create(Slot slot, const Resource& resource) {
        uint32_t count = resource.count;
        auto found = job_.bindings.find(slot_name(slot));
        if (!count)  // a run-time array is as long as its values, or four
            count = found != job_.bindings.end() && found->is_object() && found->contains("elements")
                        ? uint32_t((*found)["elements"].size())
                        : 4;
        counts_[slot] = count;
        for (uint32_t element = 0; element < count; ++element) {
            Bound bound;
            bound.slot = slot;
            bound.element = element;
            bound.resource = &resource;
            Json spec = spec_of(slot, element);
            try {
                if (resource.acceleration_structure)
                    bound.top = top_of(spec, element);
                else
                    create_one(bound, spec);
            } catch (const Json::exception& e) {
                throw Error("binding " + slot_name(slot) + ": " + problem_of(e));
            } catch (const Error& e) {
                throw Error("binding " + slot_name(slot) + ": " + e.what());
            }
            bound_.push_back(std::move(bound));
        }
    }

    uint32_t top_of(const Json& spec, uint32_t) const {
        const auto& tops = job_.world.tops;
        if (!spec.is_object() || !spec.contains("scene")) {
            if (tops.empty()) throw Error("the scene has no top level");
            return 0;
        }
        const Json& scene = spec["scene"];
        if (scene.is_null()) return kNullTop;
        if (scene.is_number() && scene.get<size_t>() < tops.size()) return scene.get<uint32_t>();
        for (size_t i = 0; i < tops.size(); ++i)
            if (scene.is_string() && tops[i].name == scene.get<std::string>()) return uint32_t(i);
        throw Error("there is no scene " + scene.dump());
    }

    size_t default_buffer_size(const Resource& resource) const {
        size_t size = resource.block ? resource.block->size() : 0;
        if (!resource.block || resource.block->members.empty()) return std::max<size_t>(size, 16);
        const auto& last = resource.block->members.back();
        if (last.type->kind == Type::Kind::Array &&
            last.type->count == 0)  // one element an invocation, and some more
            size = last.offset + size_t(last.type->stride) *
                                     std::max<size_t>(64, size_t(job_.width) * job_.height * job_.depth);
        return std::max<size_t>(size, 16);
    }

    void create_one(Bound& bound, const Json& spec) {
        const Resource& resource = *bound.resource;
        switch (resource.type) {
            case VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER:
            case VK_DESCRIPTOR_TYPE_STORAGE_BUFFER: {
                size_t size = default_buffer_size(resource);
                if (spec.is_object() && spec.contains("size"))
                    size = std::max<size_t>(16, spec["size"].get<size_t>());
                if (is_sequence(spec)) {
                    // Addresses may name buffers that do not exist yet: only the length matters here.
                    AddressOf none = [](const std::string&) { return uint64_t(0); };
                    size = std::max(size, sequence(spec, none).size());
                }
                if (spec.is_object() && spec.contains("file"))
                    size = std::max(size, native::read_text(spec["file"].get<std::string>()).size());
                VkBufferUsageFlags usage = resource.type == VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER
                                               ? VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT
                                               : VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
                if (context_.device_addresses) usage |= VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
                bound.buffer =
                    std::make_unique<Buffer>(context_, (size + 15) / 16 * 16, usage, MemoryKind::Readback);
                return;
            }
            case VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER:
            case VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER: {
                bool uniform = resource.type == VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
                bound.format = format_of(resource, spec);
                size_t texel = size_t(bound.format.channels) * bound.format.channel_bytes;
                size_t size = spec.is_object() ? spec.value("size", texel * 256) : texel * 256;
                bound.buffer = std::make_unique<Buffer>(context_, size,
                                                        uniform ? VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT
                                                                : VK_BUFFER_USAGE_STORAGE_TEXEL_BUFFER_BIT,
                                                        MemoryKind::Readback);
                VkBufferViewCreateInfo view{VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO};
                view.buffer = bound.buffer->handle;
                view.format = bound.format.format;
                view.range = VK_WHOLE_SIZE;
                check(vkCreateBufferView(context_.device, &view, nullptr, &bound.view), "vkCreateBufferView");
                return;
            }
            case VK_DESCRIPTOR_TYPE_SAMPLER:
                make_sampler(bound, spec, true);
                return;
            case VK_DESCRIPTOR_TYPE_STORAGE_IMAGE:
            case VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE:
                make_image(bound, spec);
                return;
            case VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER:
                make_image(bound, spec);
                make_sampler(bound, spec, bound.format.component == Type::Kind::Float);
                return;
            default:
                throw Error("this kind of descriptor is not supported by rtc-run");
        }
    }

    TexelFormat format_of(const Resource& resource, const Json& spec) const {
        if (spec.is_object() && spec.contains("format"))
            return texel_format(spec["format"].get<std::string>());
        return texel_format_of(resource.image.format, resource.image.component);
    }

    void make_sampler(Bound& bound, const Json& spec, bool filterable) {
        std::string filter = spec.is_object() ? spec.value("filter", "linear") : "linear";
        std::string mode = spec.is_object() ? spec.value("address", "repeat") : "repeat";
        VkSamplerCreateInfo info{VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO};
        info.magFilter = info.minFilter =
            filter == "linear" && filterable ? VK_FILTER_LINEAR : VK_FILTER_NEAREST;
        if (filter != "linear" && filter != "nearest") throw Error("filter is linear or nearest");
        VkSamplerAddressMode address = mode == "repeat"   ? VK_SAMPLER_ADDRESS_MODE_REPEAT
                                       : mode == "clamp"  ? VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE
                                       : mode == "mirror" ? VK_SAMPLER_ADDRESS_MODE_MIRRORED_REPEAT
                                       : mode == "border" ? VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_BORDER
                                                          : VK_SAMPLER_ADDRESS_MODE_MAX_ENUM;
        if (address == VK_SAMPLER_ADDRESS_MODE_MAX_ENUM)
            throw Error("address is repeat, clamp, mirror or border");
        info.addressModeU = info.addressModeV = info.addressModeW = address;
        info.borderColor =
            filterable ? VK_BORDER_COLOR_FLOAT_TRANSPARENT_BLACK : VK_BORDER_COLOR_INT_TRANSPARENT_BLACK;
        check(vkCreateSampler(context_.device, &info, nullptr, &bound.sampler), "vkCreateSampler");
    }

    void make_image(Bound& bound, const Json& spec) {
        const Resource& resource = *bound.resource;
        bool storage = resource.type == VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
        bound.format =
            storage                                         ? format_of(resource, spec)
            : spec.is_object() && spec.contains("format")   ? texel_format(spec["format"].get<std::string>())
            : resource.image.component == Type::Kind::Float ? texel_format("rgba8")
                                                            : texel_format_of(0, resource.image.component);
        tools::ImageDesc desc;
        desc.view_type = view_type(resource.image);
        desc.format = bound.format.format;
        desc.extent = storage ? VkExtent3D{job_.width, job_.height, job_.depth} : VkExtent3D{64, 64, 8};
        if (resource.image.dim == 3) desc.extent = {64, 64, 1};
        desc.layers = resource.image.arrayed ? 4 : 1;
        const bool cube = resource.image.dim == 3;
        uint32_t pictures = 0;  // when there are several
        Bytes texels;
        const bool from_file =
            file_texels(spec, bound.format, resource.image.dim == 2, desc.extent, pictures, texels);
        if (pictures && !cube && !resource.image.arrayed)
            throw Error(std::to_string(pictures) + " pictures for an image of one layer");
        if (pictures && cube && pictures % 6)
            throw Error(std::to_string(pictures) + " pictures for the six faces of cubes");
        if (pictures) desc.layers = cube ? pictures / 6 : pictures;
        if (spec.is_object() && spec.contains("size")) {
            const Json& size = spec["size"];
            desc.extent = {size.at(0).get<uint32_t>(), size.size() > 1 ? size[1].get<uint32_t>() : 1,
                           size.size() > 2 ? size[2].get<uint32_t>() : 1};
        }
        if (spec.is_object()) desc.layers = spec.value("layers", desc.layers);
        if (cube) desc.layers *= resource.image.arrayed && spec.contains("layers") ? 1 : 6;
        if (resource.image.dim == 0) desc.extent.height = desc.extent.depth = 1;
        if (resource.image.dim == 1 || resource.image.dim == 3) desc.extent.depth = 1;
        desc.usage = storage ? VK_IMAGE_USAGE_STORAGE_BIT : VK_IMAGE_USAGE_SAMPLED_BIT;
        bound.image = std::make_unique<Image>(context_, desc);
        std::string pattern = spec.is_object() ? spec.value("pattern", storage ? "" : "checker") : "";
        if (from_file) {
            // texels has them
        } else if (spec.is_object() && spec.contains("values")) {
            std::vector<double> values;
            for (const Json& value : spec["values"]) values.push_back(value.get<double>());
            texels = encode_texels(values, bound.format);
        } else if (!pattern.empty()) {
            texels = image_pattern(pattern, bound.format, desc.extent, desc.layers);
        }
        size_t needed = size_t(desc.extent.width) * desc.extent.height * desc.extent.depth * desc.layers *
                        bound.format.channels * bound.format.channel_bytes;
        if (texels.empty() && !from_file) return;
        if (from_file && !pictures && !spec.contains("size"))  // the same picture in every layer
            while (texels.size() < needed)
                texels.insert(texels.end(), texels.begin(),
                              texels.begin() + long(std::min(texels.size(), needed - texels.size())));
        if (texels.size() != needed)
            throw Error("the image takes " + std::to_string(needed) + " bytes, " +
                        std::to_string(texels.size()) + " were given");
        tools::upload_image(context_, *bound.image, texels);
    }

    uint64_t address_of(const std::string& text) const {
        Slot slot = parse_slot(text);
        for (const Bound& bound : bound_)
            if (bound.slot == slot) {
                if (bound.resource->acceleration_structure) return executor_.top_address(bound.top);
                if (bound.buffer && bound.buffer->address) return bound.buffer->address;
            }
        throw Error("the address of binding " + text +
                    " is not to be had: no buffer of that name, or the device has "
                    "no bufferDeviceAddress");
    }

    void fill_buffer(Bound& bound) {
        if (!bound.buffer) return;
        Json spec = spec_of(bound.slot, bound.element);
        auto* mapped = static_cast<uint8_t*>(bound.buffer->mapped);
        size_t size = size_t(bound.buffer->size);
        AddressOf address = [this](const std::string& slot) { return address_of(slot); };
        std::memset(mapped, 0, size);
        if (!spec.is_null() && !(spec.is_object() && spec.empty())) try {
                Bytes bytes;
                if (raw_bytes(spec, size, address, bytes)) {
                    // bytes has them
                } else if (spec.is_object() && spec.contains("fill")) {
                    uint32_t word = uint32_t(number_bits(spec["fill"], Type::Kind::Uint, 32));
                    for (size_t at = 0; at + 4 <= size; at += 4) std::memcpy(mapped + at, &word, 4);
                } else if (spec.is_object() && spec.contains("pattern")) {
                    bytes = buffer_pattern(spec["pattern"].get<std::string>(), size);
                } else if (spec.is_object() && spec.contains("file")) {
                    std::string text = native::read_text(spec["file"].get<std::string>());
                    bytes.assign(text.begin(), text.end());
                } else if (spec.is_object() && spec.contains("values") && bound.format.channels) {
                    std::vector<double> values;
                    for (const Json& value : spec["values"]) values.push_back(value.get<double>());
                    bytes = encode_texels(values, bound.format);
                } else if (bound.resource->block &&
                           !(spec.is_object() && spec.contains("size") && spec.size() == 1)) {
                    Json members = spec;
                    if (members.is_object() && bound.resource->block->members.size() &&
                        std::none_of(bound.resource->block->members.begin(),
                                     bound.resource->block->members.end(),
                                     [](const auto& m) { return m.name == "size"; }))
                        members.erase("size");
                    bytes.resize(size);
                    write_typed(*bound.resource->block, members, bytes, 0, address);
                }
                if (bytes.size() > size)
                    throw Error(std::to_string(bytes.size()) + " bytes for a buffer of " +
                                std::to_string(size));
                if (!bytes.empty()) std::memcpy(mapped, bytes.data(), bytes.size());
            } catch (const Json::exception& e) {
                throw Error("binding " + slot_name(bound.slot) + ": " + problem_of(e));
            } catch (const Error& e) {
                throw Error("binding " + slot_name(bound.slot) + ": " + e.what());
            }
    }

    Bytes push_constants() const {
        Bytes bytes;
        uint32_t size = 0;
        TypeRef block;
        for (const Module& module : job_.modules)
            if (module.push_constants && module.push_constants->size() > size) {
                size = module.push_constants->size();
                block = module.push_constants;
            }
        if (!block) {
            if (!job_.push.is_null()) throw Error("push constants are given, but no shader declares any");
            return bytes;
        }
        bytes.resize((size + 3) / 4 * 4);
        AddressOf address = [this](const std::string& slot) { return address_of(slot); };
        if (Bytes raw; raw_bytes(job_.push, bytes.size(), address, raw)) {
            if (raw.size() > bytes.size()) throw Error("push constants: more bytes than the shaders declare");
            std::copy(raw.begin(), raw.end(), bytes.begin());
        } else if (!job_.push.is_null()) {
            write_typed(*block, job_.push, bytes, 0, address);
        }
        return bytes;
    }

    void make_sets() {
        uint32_t set_count = 0;
        std::map<VkDescriptorType, uint32_t> totals;
        for (const auto& [slot, resource] : resources_) set_count = std::max(set_count, slot.set + 1);
        for (uint32_t set = 0; set < set_count; ++set) {
            std::vector<VkDescriptorSetLayoutBinding> bindings;
            for (const auto& [slot, resource] : resources_) {
                if (slot.set != set) continue;
                VkDescriptorSetLayoutBinding binding{};
                binding.binding = slot.binding;
                binding.descriptorType = type_of(resource);
                binding.descriptorCount = counts_.at(slot);
                binding.stageFlags = executor_.stages();
                totals[binding.descriptorType] += binding.descriptorCount;
                bindings.push_back(binding);
            }
            VkDescriptorSetLayoutCreateInfo info{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
            info.bindingCount = uint32_t(bindings.size());
            info.pBindings = bindings.data();
            VkDescriptorSetLayout layout;
            check(vkCreateDescriptorSetLayout(context_.device, &info, nullptr, &layout),
                  "vkCreateDescriptorSetLayout");
            layouts_.push_back(layout);
        }
        if (!set_count) return;
        std::vector<VkDescriptorPoolSize> sizes;
        for (const auto& [type, count] : totals) sizes.push_back({type, std::max(1u, count)});
        if (sizes.empty()) sizes.push_back({VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1});
        VkDescriptorPoolCreateInfo pool{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
        pool.maxSets = set_count;
        pool.poolSizeCount = uint32_t(sizes.size());
        pool.pPoolSizes = sizes.data();
        check(vkCreateDescriptorPool(context_.device, &pool, nullptr, &pool_), "vkCreateDescriptorPool");
        sets_.resize(set_count);
        VkDescriptorSetAllocateInfo allocate{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
        allocate.descriptorPool = pool_;
        allocate.descriptorSetCount = set_count;
        allocate.pSetLayouts = layouts_.data();
        check(vkAllocateDescriptorSets(context_.device, &allocate, sets_.data()), "vkAllocateDescriptorSets");
        for (const Bound& bound : bound_) write(bound);
    }

    VkDescriptorType type_of(const Resource& resource) const {
        return resource.acceleration_structure ? executor_.top_descriptor() : resource.type;
    }

    void write(const Bound& bound) {
        if (bound.resource->acceleration_structure) return;  // the executor's own, after the pipeline
        VkWriteDescriptorSet write{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
        write.dstSet = sets_.at(bound.slot.set);
        write.dstBinding = bound.slot.binding;
        write.dstArrayElement = bound.element;
        write.descriptorCount = 1;
        write.descriptorType = bound.resource->type;
        VkDescriptorBufferInfo buffer{};
        VkDescriptorImageInfo image{};
        if (bound.view) {
            write.pTexelBufferView = &bound.view;
        } else if (bound.buffer) {
            buffer = {bound.buffer->handle, 0, VK_WHOLE_SIZE};
            write.pBufferInfo = &buffer;
        } else {
            image = {bound.sampler, bound.image ? bound.image->view : VK_NULL_HANDLE,
                     VK_IMAGE_LAYOUT_GENERAL};
            write.pImageInfo = &image;
        }
        vkUpdateDescriptorSets(context_.device, 1, &write, 0, nullptr);
    }

    void read_back(const Bound& bound, RunResult& result) {
        if (!bound.resource->writable) return;
        Output out;
        out.slot = bound.slot;
        out.element = bound.element;
        out.name = bound.resource->name;
        out.format = bound.format;
        if (bound.buffer) {
            auto* mapped = static_cast<const uint8_t*>(bound.buffer->mapped);
            out.bytes.assign(mapped, mapped + bound.buffer->size);
            out.block = bound.resource->block;
        } else if (bound.image) {
            out.is_image = true;
            out.extent = bound.image->desc.extent;
            out.layers = bound.image->desc.layers;
            out.bytes = tools::download_image(context_, *bound.image);
        }
        result.outputs.push_back(std::move(out));
    }

    const Context& context_;
    Executor& executor_;
    const Job& job_;
    std::map<Slot, Resource> resources_;
    std::map<Slot, uint32_t> counts_;
    std::deque<Bound> bound_;
    std::vector<VkDescriptorSetLayout> layouts_;
    std::vector<VkDescriptorSet> sets_;
    VkDescriptorPool pool_ = VK_NULL_HANDLE;
};

}  // namespace

std::map<Slot, Resource> merge_resources(const Job& job) {
    std::map<Slot, Resource> merged;
    std::map<Slot, std::string> owner;
    for (size_t i = 0; i < job.modules.size(); ++i)
        for (const Resource& resource : job.modules[i].resources) {
            Slot slot{resource.set, resource.binding};
            auto [at, fresh] = merged.try_emplace(slot, resource);
            if (fresh) {
                owner[slot] = job.sources[i].name;
                continue;
            }
            Resource& known = at->second;
            if (known.acceleration_structure != resource.acceleration_structure ||
                known.type != resource.type)
                throw Error("binding " + slot_name(slot) + " is " + type_name(known) + " in " + owner[slot] +
                            " and " + type_name(resource) + " in " + job.sources[i].name);
            known.writable |= resource.writable;
            known.count = known.count && resource.count ? std::max(known.count, resource.count) : 0;
            if (resource.block && known.block && resource.block->size() > known.block->size())
                known.block = resource.block;
            if (!known.image.format) known.image.format = resource.image.format;
        }
    return merged;
}

RunResult run_job(const Context& context, Executor& executor, const Job& job, unsigned repeats) {
    Session session(context, executor, job);
    return session.run(repeats);
}

}  // namespace rtc::run
