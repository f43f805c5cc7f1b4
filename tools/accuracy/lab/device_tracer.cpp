#include "device_tracer.h"

#include <array>
#include <cstring>
#include <string>

#include "error.h"
#include "resources.h"
#include "rtc/abi.h"
#include "scene_knobs.h"
#include "spirv_edit.h"

namespace rtc::lab {
namespace {

constexpr uint32_t kWatertight[] = {
#include "lab_watertight.inc"
};
constexpr uint32_t kFast[] = {
#include "lab_fast.inc"
};
constexpr uint32_t kExact[] = {
#include "lab_exact.inc"
};
constexpr uint32_t kExact64[] = {
#include "lab_exact64.inc"
};
constexpr uint32_t kBox16[] = {
#include "lab_box16.inc"
};
constexpr uint32_t kBox8[] = {
#include "lab_box8.inc"
};
constexpr uint32_t kT64[] = {
#include "lab_t64.inc"
};
constexpr uint32_t kProbe[] = {
#include "lab_probe.inc"
};

std::vector<uint32_t> module_words(Variant variant) {
    std::vector<uint32_t> words;
    if (variant == Variant::Watertight || variant == Variant::Contracted || variant == Variant::FloatInverse)
        words.assign(std::begin(kWatertight), std::end(kWatertight));
    if (variant == Variant::Fast) words.assign(std::begin(kFast), std::end(kFast));
    if (variant == Variant::Exact) words.assign(std::begin(kExact), std::end(kExact));
    if (variant == Variant::Exact64) words.assign(std::begin(kExact64), std::end(kExact64));
    if (variant == Variant::Box16) words.assign(std::begin(kBox16), std::end(kBox16));
    if (variant == Variant::Box8) words.assign(std::begin(kBox8), std::end(kBox8));
    if (variant == Variant::T64) words.assign(std::begin(kT64), std::end(kT64));
    if (variant == Variant::Probe) words.assign(std::begin(kProbe), std::end(kProbe));
    if (variant == Variant::Contracted) {
        contract(words);
    } else {
        decorate_no_contraction(words);
    }
    return words;
}

constexpr uint32_t kControlWords = RTC_CTRL_HEADER_WORDS + 64;
constexpr uint32_t kSaveWords = 96;
constexpr uint32_t kResultWords = 16;

}  // namespace

Variant parse_variant(std::string_view name) {
    for (Variant v : {Variant::Watertight, Variant::Fast, Variant::Exact, Variant::Exact64, Variant::Contracted, Variant::Box16,
                      Variant::Box8, Variant::FloatInverse, Variant::T64})
        if (name == variant_name(v)) return v;
    throw tools::Error("unknown tier \"" + std::string(name) +
                       "\": fast, watertight, exact, exact64, contracted, box16, box8, float-inverse or t64");
}

const char* variant_name(Variant variant) {
    switch (variant) {
        case Variant::Watertight: return "watertight";
        case Variant::Fast: return "fast";
        case Variant::Exact: return "exact";
        case Variant::Exact64: return "exact64";
        case Variant::Contracted: return "contracted";
        case Variant::Box16: return "box16";
        case Variant::Box8: return "box8";
        case Variant::FloatInverse: return "float-inverse";
        case Variant::T64: return "t64";
        case Variant::Probe: return "probe";
    }
    return "";
}

struct DeviceTracer::State {
    const tools::Context& context;
    TracerOptions options;
    std::array<VkDescriptorSetLayout, 2> layouts{};
    VkPipelineLayout layout = VK_NULL_HANDLE;
    VkShaderModule module = VK_NULL_HANDLE;
    VkPipeline pipeline = VK_NULL_HANDLE;
    VkDescriptorPool pool = VK_NULL_HANDLE;
    std::array<VkDescriptorSet, 2> sets{};
    VkBufferView view = VK_NULL_HANDLE;
    tools::Buffer heap, params, empty, sbt, control, scratch;
    tools::Buffer rays, results;            // on the device, so that no bus is timed
    tools::Buffer rays_here, results_here;  // on the host
    uint32_t root = 0;
    size_t capacity = 0;

    void write(uint32_t set, uint32_t binding, VkDescriptorType type, const tools::Buffer& buffer) {
        const VkDescriptorBufferInfo info{buffer.handle, 0, VK_WHOLE_SIZE};
        VkWriteDescriptorSet write{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
        write.dstSet = sets[set];
        write.dstBinding = binding;
        write.descriptorCount = 1;
        write.descriptorType = type;
        write.pBufferInfo = &info;
        vkUpdateDescriptorSets(context.device, 1, &write, 0, nullptr);
    }
};

DeviceTracer::DeviceTracer(const tools::Context& context, const TracerOptions& options)
    : state_(new State{.context = context, .options = options}) {
    State& s = *state_;
    using tools::check;
    std::vector<VkDescriptorSetLayoutBinding> bindings;
    for (uint32_t b = 0; b < RTC_BINDING_COUNT; ++b) {
        VkDescriptorType type = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        if (b == RTC_BINDING_PARAMS) type = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
        if (b == RTC_BINDING_HEAP_TEXELS) type = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
        bindings.push_back({b, type, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
    }
    VkDescriptorSetLayoutCreateInfo set_info{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO};
    set_info.bindingCount = uint32_t(bindings.size());
    set_info.pBindings = bindings.data();
    check(vkCreateDescriptorSetLayout(context.device, &set_info, nullptr, &s.layouts[0]),
          "vkCreateDescriptorSetLayout");
    const VkDescriptorSetLayoutBinding io[2] = {
        {0, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr},
        {1, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr}};
    set_info.bindingCount = 2;
    set_info.pBindings = io;
    check(vkCreateDescriptorSetLayout(context.device, &set_info, nullptr, &s.layouts[1]),
          "vkCreateDescriptorSetLayout");
    VkPipelineLayoutCreateInfo layout_info{VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
    layout_info.setLayoutCount = 2;
    layout_info.pSetLayouts = s.layouts.data();
    check(vkCreatePipelineLayout(context.device, &layout_info, nullptr, &s.layout), "vkCreatePipelineLayout");

    const std::vector<uint32_t> words = module_words(options.variant);
    VkShaderModuleCreateInfo module_info{VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
    module_info.codeSize = words.size() * 4;
    module_info.pCode = words.data();
    check(vkCreateShaderModule(context.device, &module_info, nullptr, &s.module), "vkCreateShaderModule");
    const uint32_t ids[] = {RTC_SPEC_FETCH,        RTC_SPEC_WHILE_WHILE,  RTC_SPEC_STEP_BUDGET,
                            RTC_SPEC_SHARED_STACK, RTC_SPEC_BASE + 0x100, RTC_SPEC_BASE + 0x101,
                            RTC_SPEC_BASE + 0x102, RTC_SPEC_BASE + 0x103};
    const uint32_t values[] = {options.storage_fetch ? RTC_FETCH_STORAGE : RTC_FETCH_TEXEL,
                               options.while_while,
                               options.step_budget,
                               options.shared_stack,
                               options.any_hit,
                               options.aabbs,
                               options.triangles,
                               options.resumable};
    std::array<VkSpecializationMapEntry, std::size(ids)> entries;
    // The workgroup size stays at its default of 64.
    for (uint32_t i = 0; i < entries.size(); ++i) entries[i] = {ids[i], i * 4, 4};
    const VkSpecializationInfo specialization{uint32_t(entries.size()), entries.data(), sizeof values,
                                              values};
    VkComputePipelineCreateInfo info{VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO};
    info.stage = {VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                  nullptr,
                  0,
                  VK_SHADER_STAGE_COMPUTE_BIT,
                  s.module,
                  "main",
                  &specialization};
    info.layout = s.layout;
    check(vkCreateComputePipelines(context.device, VK_NULL_HANDLE, 1, &info, nullptr, &s.pipeline),
          "vkCreateComputePipelines");

    const VkDescriptorPoolSize sizes[] = {{VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, 1},
                                          {VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, 1},
                                          {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, RTC_BINDING_COUNT}};
    VkDescriptorPoolCreateInfo pool_info{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
    pool_info.maxSets = 2;
    pool_info.poolSizeCount = 3;
    pool_info.pPoolSizes = sizes;
    check(vkCreateDescriptorPool(context.device, &pool_info, nullptr, &s.pool), "vkCreateDescriptorPool");
    VkDescriptorSetAllocateInfo allocate{VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO};
    allocate.descriptorPool = s.pool;
    allocate.descriptorSetCount = 2;
    allocate.pSetLayouts = s.layouts.data();
    check(vkAllocateDescriptorSets(context.device, &allocate, s.sets.data()), "vkAllocateDescriptorSets");

    const VkBufferUsageFlags storage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
    s.params = tools::Buffer(context, RTC_PARAM_QUADS * 16, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT,
                             tools::MemoryKind::Host);
    s.empty = tools::Buffer(context, 16, storage, tools::MemoryKind::Host);
    s.control = tools::Buffer(context, kControlWords * 4, storage, tools::MemoryKind::Readback);
    s.write(0, RTC_BINDING_PARAMS, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, s.params);
    for (uint32_t b = RTC_BINDING_SBT_RAYGEN; b <= RTC_BINDING_SBT_CALLABLE; ++b) {
        s.write(0, b, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, s.empty);
    }
    s.write(0, RTC_BINDING_CONTROL, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, s.control);
}

DeviceTracer::~DeviceTracer() {
    State& s = *state_;
    VkDevice device = s.context.device;
    vkDestroyBufferView(device, s.view, nullptr);
    vkDestroyDescriptorPool(device, s.pool, nullptr);
    vkDestroyPipeline(device, s.pipeline, nullptr);
    vkDestroyShaderModule(device, s.module, nullptr);
    vkDestroyPipelineLayout(device, s.layout, nullptr);
    for (VkDescriptorSetLayout layout : s.layouts) vkDestroyDescriptorSetLayout(device, layout, nullptr);
}

void DeviceTracer::set_scene(const HostScene& given) {
    State& s = *state_;
    const Variant variant = s.options.variant;
    HostScene changed;
    if (variant == Variant::Box16 || variant == Variant::Box8) changed = with_small_boxes(given, variant == Variant::Box16 ? 16 : 8);
    if (variant == Variant::FloatInverse) changed = with_float_inverse(given);
    const HostScene& scene = changed.heap.empty() ? given : changed;
    vkDestroyBufferView(s.context.device, s.view, nullptr);
    s.view = VK_NULL_HANDLE;
    s.heap = tools::upload_vector(
        s.context, scene.heap, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT);
    VkBufferViewCreateInfo view_info{VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO};
    view_info.buffer = s.heap.handle;
    view_info.format = VK_FORMAT_R32G32B32A32_UINT;
    view_info.range = VK_WHOLE_SIZE;
    tools::check(vkCreateBufferView(s.context.device, &view_info, nullptr, &s.view), "vkCreateBufferView");
    VkWriteDescriptorSet write{VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
    write.dstSet = s.sets[0];
    write.dstBinding = RTC_BINDING_HEAP_TEXELS;
    write.descriptorCount = 1;
    write.descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
    write.pTexelBufferView = &s.view;
    vkUpdateDescriptorSets(s.context.device, 1, &write, 0, nullptr);
    s.write(0, RTC_BINDING_HEAP, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, s.heap);
    s.root = scene.root;
}

uint64_t DeviceTracer::scene_bytes() const { return state_->heap.size; }

std::vector<RayResult> DeviceTracer::trace(const std::vector<Ray>& rays) {
    const uint32_t lanes = (uint32_t(rays.size()) + 63) / 64 * 64;
    std::vector<uint32_t> params(RTC_PARAM_QUADS * 4);
    params[RTC_PARAM_RAYGEN_OFFSET] = state_->root;
    params[RTC_PARAM_WIDTH] = uint32_t(rays.size());
    params[RTC_PARAM_HEIGHT] = 1;
    params[RTC_PARAM_DEPTH] = 1;
    params[RTC_PARAM_LANE_COUNT] = lanes;
    static_assert(sizeof(RayResult) == kResultWords * 4);
    if (state_->options.pause) {
        std::vector<Ray> paused = rays;
        for (Ray& ray : paused) ray.sbt |= kPause;
        double total = 0;
        uint32_t errors = 0;
        for (uint32_t round = 0; round == 0 || control()[RTC_CTRL_SUSPENDED] != 0; ++round) {
            if (round == 10000) throw tools::Error("rays do not end");
            params[RTC_PARAM_ROUND] = round == 0 ? 0 : 1;
            dispatch(params, paused.data(), paused.size() * sizeof(Ray), lanes, lanes / 64, 1);
            total += seconds;
            errors += error_count;
        }
        seconds = total;
        error_count = errors;
    } else {
        dispatch(params, rays.data(), rays.size() * sizeof(Ray), lanes, lanes / 64, 1);
    }
    std::vector<RayResult> results(rays.size());
    std::memcpy(results.data(), state_->results_here.mapped, results.size() * sizeof(RayResult));
    return results;
}

std::vector<uint32_t> DeviceTracer::probe(const std::vector<uint32_t>& params,
                                          const std::vector<uint32_t>& sbt,
                                          const std::vector<uint32_t>& indices, uint32_t groups_x,
                                          uint32_t groups_y) {
    State& s = *state_;
    set_scene({.heap = std::vector<uint32_t>(64), .root = 0, .world_to_object = {}, .max_depth = 0});
    s.sbt =
        tools::Buffer(s.context, sbt.size() * 4, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, tools::MemoryKind::Host);
    std::memcpy(s.sbt.mapped, sbt.data(), sbt.size() * 4);
    for (uint32_t b = RTC_BINDING_SBT_RAYGEN; b <= RTC_BINDING_SBT_CALLABLE; ++b) {
        s.write(0, b, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, s.sbt);
    }
    dispatch(params, indices.data(), indices.size() * 4, uint32_t(indices.size()), groups_x, groups_y);
    std::vector<uint32_t> results(indices.size() * kResultWords);
    std::memcpy(results.data(), s.results_here.mapped, results.size() * 4);
    return results;
}

std::vector<uint32_t> DeviceTracer::control() const {
    const uint32_t* words = static_cast<const uint32_t*>(state_->control.mapped);
    return {words, words + kControlWords};
}

void DeviceTracer::dispatch(const std::vector<uint32_t>& params, const void* input, size_t input_bytes,
                            uint32_t lanes, uint32_t groups_x, uint32_t groups_y) {
    State& s = *state_;
    if (lanes > s.capacity) {
        const VkBufferUsageFlags storage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
        const bool saves = s.options.resumable && s.options.step_budget != 0xffffffffu;
        const uint32_t save_words = s.options.variant == Variant::Probe ? 4 : (saves ? kSaveWords : 0);
        const VkBufferUsageFlags in = VK_BUFFER_USAGE_TRANSFER_DST_BIT, out = VK_BUFFER_USAGE_TRANSFER_SRC_BIT;
        s.rays = tools::Buffer(s.context, lanes * sizeof(Ray), storage | in, tools::MemoryKind::Device);
        s.rays_here = tools::Buffer(s.context, lanes * sizeof(Ray), out, tools::MemoryKind::Host);
        s.results = tools::Buffer(s.context, lanes * kResultWords * 4, storage | out, tools::MemoryKind::Device);
        s.results_here = tools::Buffer(s.context, lanes * kResultWords * 4, in, tools::MemoryKind::Readback);
        s.scratch = tools::Buffer(s.context, VkDeviceSize(lanes) * save_words * 4, storage,
                                  tools::MemoryKind::Device);
        s.write(1, 0, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, s.rays);
        s.write(1, 1, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, s.results);
        s.write(0, RTC_BINDING_SCRATCH, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, s.scratch);
        s.capacity = lanes;
    }
    std::memcpy(s.rays_here.mapped, input, input_bytes);
    std::memset(s.control.mapped, 0, kControlWords * 4);
    std::memcpy(s.params.mapped, params.data(), params.size() * 4);
    tools::GpuTimer timer(s.context);
    s.context.run([&](VkCommandBuffer commands) {
        timer.reset(commands);
        vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, s.pipeline);
        vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, s.layout, 0, 2, s.sets.data(), 0,
                                nullptr);
        const VkBufferCopy in{0, 0, input_bytes};
        vkCmdCopyBuffer(commands, s.rays_here.handle, s.rays.handle, 1, &in);
        tools::full_barrier(commands);
        timer.begin(commands);
        vkCmdDispatch(commands, groups_x, groups_y, 1);
        timer.end(commands);
        tools::full_barrier(commands);
        const VkBufferCopy out{0, 0, VkDeviceSize(lanes) * kResultWords * 4};
        vkCmdCopyBuffer(commands, s.results.handle, s.results_here.handle, 1, &out);
        tools::full_barrier(commands);
    });
    seconds = timer.seconds();
    const uint32_t* control = static_cast<const uint32_t*>(s.control.mapped);
    error = control[RTC_CTRL_ERROR];
    error_count = control[RTC_CTRL_ERROR_COUNT];
    error_detail = control[RTC_CTRL_ERROR_DETAIL];
}

}  // namespace rtc::lab
