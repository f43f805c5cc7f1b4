// Operations on the device; trace.cpp compares.
#include "world.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "error.h"

namespace rtc::stress {

using tools::Buffer;
using tools::Error;
using tools::MemoryKind;

namespace {

constexpr VkAccelerationStructureTypeNV kBottom = VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_NV;
constexpr VkAccelerationStructureTypeNV kTop = VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_NV;

VkAccelerationStructureInfoNV info_of(VkAccelerationStructureTypeNV type,
                                      VkBuildAccelerationStructureFlagsNV flags) {
    VkAccelerationStructureInfoNV info{};
    info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_INFO_NV;
    info.type = type;
    info.flags = flags;
    return info;
}

VkBuildAccelerationStructureFlagsNV random_flags(Random& random) {
    VkBuildAccelerationStructureFlagsNV flags = 0;
    if (chance(random, 0.5)) flags |= VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV;
    if (chance(random, 0.5)) flags |= VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_COMPACTION_BIT_NV;
    if (chance(random, 0.2)) flags |= VK_BUILD_ACCELERATION_STRUCTURE_LOW_MEMORY_BIT_NV;
    const uint64_t preference = below(random, 3);
    if (preference == 1) flags |= VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_NV;
    if (preference == 2) flags |= VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_BUILD_BIT_NV;
    return flags;
}

std::vector<VkGeometryNV> describe(const Content& content, const std::vector<Buffer>& data,
                                   const std::vector<Buffer>& indices,
                                   const std::vector<Buffer>& transforms) {
    std::vector<VkGeometryNV> out;
    for (size_t i = 0; i < content.geometries.size(); ++i) {
        const Geometry& g = content.geometries[i];
        VkGeometryNV geometry{};
        geometry.sType = VK_STRUCTURE_TYPE_GEOMETRY_NV;
        geometry.flags = g.flags;
        VkGeometryTrianglesNV& t = geometry.geometry.triangles;
        VkGeometryAABBNV& b = geometry.geometry.aabbs;
        t.sType = VK_STRUCTURE_TYPE_GEOMETRY_TRIANGLES_NV;
        b.sType = VK_STRUCTURE_TYPE_GEOMETRY_AABB_NV;
        if (g.boxes) {
            geometry.geometryType = VK_GEOMETRY_TYPE_AABBS_NV;
            b.aabbData = data[i].handle;
            b.numAABBs = uint32_t(g.box_list.size());
            b.stride = g.stride;
            b.offset = g.offset;
        } else {
            geometry.geometryType = VK_GEOMETRY_TYPE_TRIANGLES_NV;
            t.vertexData = data[i].handle;
            t.vertexOffset = g.offset;
            t.vertexCount = g.vertex_count;
            t.vertexStride = g.stride;
            t.vertexFormat = g.format;
            t.indexType = g.index_type;
            if (g.index_type != VK_INDEX_TYPE_NONE_NV) {
                t.indexData = indices[i].handle;
                t.indexOffset = g.index_offset;
                t.indexCount = g.index_count;
            }
            if (g.transformed) {
                t.transformData = transforms[i].handle;
                t.transformOffset = g.transform_offset;
            }
        }
        out.push_back(geometry);
    }
    return out;
}

}  // namespace

struct World::Inputs {
    std::vector<Buffer> data, indices, transforms;
    std::vector<VkGeometryNV> geometries;

    Inputs(const tools::Context& context, const Content& content) {
        auto upload = [&](const void* bytes, size_t size, size_t at) {
            Buffer buffer(context, (at + size + 259) / 4 * 4, RTR_INPUT_BUFFER_USAGE, MemoryKind::Host);
            if (size) std::memcpy(static_cast<uint8_t*>(buffer.mapped) + at, bytes, size);
            return buffer;
        };
        for (const Geometry& g : content.geometries) {
            data.push_back(upload(g.data.data(), g.data.size(), 0));
            indices.push_back(upload(g.indices.data(), g.indices.size(), 0));
            transforms.push_back(upload(&g.transform, sizeof g.transform, g.transform_offset));
        }
        geometries = describe(content, data, indices, transforms);
    }
};

World::World(Device& device, const Limits& limits, uint64_t seed)
    : device_(device), limits_(limits), random_(seed), tracer_(device) {
    if (device.addresses) return;
    heap_buffer_ = Buffer(device.context, limits.heap_bytes, RTR_HEAP_BUFFER_USAGE, MemoryKind::Device);
    RtrHeapCreateInfo info{};
    info.buffer = heap_buffer_.handle;
    info.size = limits.heap_bytes;
    device.check(rtrCreateHeap(device.handle, &info, nullptr, &heap_), "rtrCreateHeap");
    record([&](RtrRecorder recorder) {
        device.check(rtrCmdInitializeHeap(recorder, heap_), "rtrCmdInitializeHeap");
    });
}

World::~World() {
    for (auto& [key, bottom] : bottoms_)
        if (bottom.structure.handle)
            rtrDestroyAccelerationStructure(device_.handle, bottom.structure.handle, nullptr);
    if (top_ && top_->structure.handle)
        rtrDestroyAccelerationStructure(device_.handle, top_->structure.handle, nullptr);
    if (heap_) rtrDestroyHeap(device_.handle, heap_, nullptr);
}

void World::finish() {
    for (auto& [key, bottom] : bottoms_) destroy(bottom.structure);
    bottoms_.clear();
    if (top_) destroy(top_->structure);
    top_.reset();
    if (!heap_) return;
    VkDeviceSize offset = 0;  // all but the null structure's 256 bytes
    device_.check(rtrAllocateHeapRange(heap_, limits_.heap_bytes - 256, 256, &offset),
                  "the heap is not whole after everything was destroyed: rtrAllocateHeapRange");
    rtrFreeHeapRange(heap_, offset);
}

uint64_t World::primitives() const {
    uint64_t count = 0;
    for (const auto& [key, bottom] : bottoms_) count += bottom.content.primitives();
    return count;
}

void World::record(const std::function<void(RtrRecorder)>& commands) {
    device_.context.run([&](VkCommandBuffer buffer) {
        device_.check(rtrBeginRecorder(tracer_.recorder(), buffer), "rtrBeginRecorder");
        commands(tracer_.recorder());
        tools::full_barrier(buffer);
    });
    device_.check(rtrRetireRecorder(tracer_.recorder()), "rtrRetireRecorder");
}

// Finds memory for it; false when there is no room.
bool World::place(Structure& s) {
    if (heap_) {
        const bool placed = rtrAllocateHeapRange(heap_, s.size, 0, &s.offset) == VK_SUCCESS;
        device_.messages.clear();
        return placed;
    }
    if (used_ + s.size > limits_.heap_bytes) return false;
    used_ += s.size;
    s.offset = 256 * below(random_, 4);
    s.buffer = std::make_shared<Buffer>(device_.context, s.offset + s.size, RTR_ADDRESS_BUFFER_USAGE,
                                        MemoryKind::Device);
    return true;
}

// A handle of null when the heap has no room even after others were destroyed.
World::Structure World::create(const VkAccelerationStructureInfoNV& info, VkDeviceSize compacted_size) {
    VkAccelerationStructureCreateInfoNV create_info{};
    create_info.sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_NV;
    create_info.compactedSize = compacted_size;
    create_info.info = info;
    Structure s;
    device_.check(rtrCreateAccelerationStructure(device_.handle, &create_info, nullptr, &s.handle),
                  "rtrCreateAccelerationStructure");
    VkMemoryRequirements2 needs{};
    needs.sType = VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2;
    rtrGetAccelerationStructureMemoryRequirements(
        device_.handle, VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_OBJECT_NV, s.handle, &needs);
    s.size = needs.memoryRequirements.size;
    while (!place(s)) {
        if (evict(in_use_)) continue;
        rtrDestroyAccelerationStructure(device_.handle, s.handle, nullptr);
        return {};
    }
    RtrBindAccelerationStructureMemoryInfo bind{};
    bind.accelerationStructure = s.handle;
    bind.heap = heap_;
    if (heap_) {
        bind.heapOffset = s.offset;
    } else {
        bind.buffer = s.buffer->handle;
        bind.bufferOffset = s.offset;
    }
    device_.check(rtrBindAccelerationStructureMemory(device_.handle, 1, &bind),
                  "rtrBindAccelerationStructureMemory");
    return s;
}

void World::destroy(Structure& s) {
    if (!s.handle) return;
    rtrDestroyAccelerationStructure(device_.handle, s.handle, nullptr);
    if (heap_) {
        rtrFreeHeapRange(heap_, s.offset);
    } else {
        used_ -= s.size;
    }
    s = {};
}

// Destroys some bottom level. `keep`: a key to spare; -2: all, they are referred to.
bool World::evict(int keep) {
    if (keep == -2 || bottoms_.empty()) return false;
    auto victim = std::next(bottoms_.begin(), long(below(random_, bottoms_.size())));
    if (victim->first == keep && bottoms_.size() == 1) return false;
    if (victim->first == keep)
        victim = std::next(victim) == bottoms_.end() ? bottoms_.begin() : std::next(victim);
    history_ += " destroy";
    ++counts_.evictions;
    destroy(victim->second.structure);
    bottoms_.erase(victim);
    return true;
}

VkDeviceSize World::scratch_size(RtrAccelerationStructure structure, bool update) {
    VkMemoryRequirements2 needs{};
    needs.sType = VK_STRUCTURE_TYPE_MEMORY_REQUIREMENTS_2;
    rtrGetAccelerationStructureMemoryRequirements(
        device_.handle,
        update ? VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_UPDATE_SCRATCH_NV
               : VK_ACCELERATION_STRUCTURE_MEMORY_REQUIREMENTS_TYPE_BUILD_SCRATCH_NV,
        structure, &needs);
    return std::max<VkDeviceSize>(needs.memoryRequirements.size, 256);
}

// `target`: an update into another structure; null: in place.
void World::build(Bottom& bottom, bool update, Structure* target) {
    const Inputs inputs(device_.context, bottom.content);
    VkAccelerationStructureInfoNV info = info_of(kBottom, bottom.flags);
    info.geometryCount = uint32_t(inputs.geometries.size());
    info.pGeometries = inputs.geometries.data();
    RtrAccelerationStructure dst = target ? target->handle : bottom.structure.handle;
    RtrAccelerationStructure src = !update ? nullptr : bottom.structure.handle;
    const Buffer scratch(device_.context, scratch_size(dst, update), RTR_SCRATCH_BUFFER_USAGE,
                         MemoryKind::Device);
    record([&](RtrRecorder recorder) {
        device_.check(rtrCmdBuildAccelerationStructure(recorder, &info, VK_NULL_HANDLE, 0, update, dst, src,
                                                       scratch.handle, 0),
                      "rtrCmdBuildAccelerationStructure");
    });
    bottom.reference = std::make_unique<BottomReference>(bottom.content);
}

VkDeviceSize World::query(RtrAccelerationStructure structure, VkQueryType type) {
    const Buffer answer(device_.context, 16, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, MemoryKind::Readback);
    record([&](RtrRecorder recorder) {
        device_.check(
            rtrCmdWriteAccelerationStructuresProperties(recorder, 1, &structure, type, answer.handle, 0),
            "rtrCmdWriteAccelerationStructuresProperties");
    });
    uint64_t size = 0;
    std::memcpy(&size, answer.mapped, sizeof size);
    return size;
}

// Replaces the structure by its copy.
void World::copy(Structure& s, const VkAccelerationStructureInfoNV& info, Copy how) {
    const bool compact = how == Copy::Compact;
    const VkDeviceSize size =
        compact ? query(s.handle, VK_QUERY_TYPE_ACCELERATION_STRUCTURE_COMPACTED_SIZE_NV) : s.size;
    if (size > s.size)
        throw Error("the compacted size " + std::to_string(size) + " is above " + std::to_string(s.size));
    Structure fresh = create(info, how == Copy::CloneOfItsKind ? 0 : size);
    if (!fresh.handle) return;
    record([&](RtrRecorder recorder) {
        device_.check(rtrCmdCopyAccelerationStructure(recorder, fresh.handle, s.handle,
                                                      compact ? VK_COPY_ACCELERATION_STRUCTURE_MODE_COMPACT_NV
                                                              : VK_COPY_ACCELERATION_STRUCTURE_MODE_CLONE_NV),
                      "rtrCmdCopyAccelerationStructure");
    });
    destroy(s);
    s = fresh;
    history_ += compact ? " compact" : " clone";
    ++(compact ? counts_.compactions : counts_.clones);
}

// To a blob and back, with the old structure gone before the new one exists.
void World::serialise(Structure& s, VkAccelerationStructureTypeNV type,
                      VkBuildAccelerationStructureFlagsNV flags, const Top* top) {
    const VkDeviceSize size = query(s.handle, VK_QUERY_TYPE_ACCELERATION_STRUCTURE_SERIALIZATION_SIZE_KHR);
    const Buffer blob(device_.context, (size + 255) / 256 * 256, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                      MemoryKind::Readback);
    record([&](RtrRecorder recorder) {
        device_.check(rtrCmdCopyAccelerationStructureToMemory(recorder, s.handle, blob.handle, 0, size),
                      "rtrCmdCopyAccelerationStructureToMemory");
    });
    RtrSerializedInfo info{};
    device_.check(rtrGetSerializedAccelerationStructureInfo(device_.handle, blob.mapped, size_t(size), &info),
                  "rtrGetSerializedAccelerationStructureInfo");
    const uint64_t expected = top ? top->instances.size() : 0;
    if (info.handleCount != expected || info.serializedSize > size)
        throw Error("the blob names " + std::to_string(info.handleCount) + " handles, " +
                    std::to_string(expected) + " instances were built");
    Structure fresh = create(info_of(type, flags), info.deserializedSize);
    if (!fresh.handle) return;
    destroy(s);
    record([&](RtrRecorder recorder) {
        device_.check(rtrCmdCopyMemoryToAccelerationStructure(recorder, fresh.handle, blob.handle, 0, size),
                      "rtrCmdCopyMemoryToAccelerationStructure");
    });
    s = fresh;
    history_ += " serialise";
    ++counts_.serialisations;
}

void World::add_bottom() {
    const uint64_t used = primitives();
    const uint64_t most = limits_.primitives > used ? limits_.primitives - used : 0;
    Bottom bottom;
    const bool large = limits_.large > 0 && chance(random_, limits_.large);
    bottom.content = make_content(random_, large ? most : log_uniform(random_, most), large);
    bottom.flags = random_flags(random_);
    const Inputs inputs(device_.context, bottom.content);
    VkAccelerationStructureInfoNV info = info_of(kBottom, bottom.flags);
    info.geometryCount = uint32_t(inputs.geometries.size());
    info.pGeometries = inputs.geometries.data();
    in_use_ = -1;
    bottom.structure = create(info, 0);
    if (!bottom.structure.handle) return;
    history_ +=
        " add(" + std::to_string(bottom.content.primitives()) + (bottom.content.boxes ? " boxes)" : ")");
    Bottom& placed = bottoms_[next_key_++] = std::move(bottom);
    build(placed, false, nullptr);
    ++counts_.builds;
}

void World::change_bottom() {
    auto chosen = std::next(bottoms_.begin(), long(below(random_, bottoms_.size())));
    Bottom& b = chosen->second;
    in_use_ = chosen->first;
    const bool updatable = b.flags & VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV;
    switch (below(random_, 8)) {
        case 0:
        case 1:
        case 6:
        case 7:
            if (!updatable) break;
            move_content(b.content, random_);
            history_ += " update";
            if (chance(random_, 0.5)) {
                build(b, true, nullptr);
            } else {
                const Inputs inputs(device_.context, b.content);
                VkAccelerationStructureInfoNV info = info_of(kBottom, b.flags);
                info.geometryCount = uint32_t(inputs.geometries.size());
                info.pGeometries = inputs.geometries.data();
                Structure target = create(info, 0);
                build(b, true, target.handle ? &target : nullptr);
                if (target.handle) {
                    destroy(b.structure);
                    b.structure = target;
                    history_ += "-to-copy";
                }
            }
            ++counts_.updates;
            break;
        case 2:
            if (b.copied) break;
            move_content(b.content, random_);
            build(b, false, nullptr);
            history_ += " rebuild";
            ++counts_.builds;
            break;
        case 3:
        case 4: {
            const bool compact =
                (b.flags & VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_COMPACTION_BIT_NV) && chance(random_, 0.7);
            // A clone created like its source can be built and updated as that.
            const Inputs inputs(device_.context, b.content);
            VkAccelerationStructureInfoNV like = info_of(kBottom, b.flags);
            like.geometryCount = uint32_t(inputs.geometries.size());
            like.pGeometries = inputs.geometries.data();
            const bool same = !compact && !b.copied && chance(random_, 0.7);
            copy(b.structure, same ? like : info_of(kBottom, b.flags),
                 compact ? Copy::Compact : (same ? Copy::CloneOfItsKind : Copy::Clone));
            b.copied = b.copied || !same;
            break;
        }
        default:
            serialise(b.structure, kBottom, b.flags, nullptr);
            b.copied = true;
            break;
    }
    in_use_ = -1;
}

void World::make_instances(Top& top, uint64_t count) {
    top.instances.assign(count, {});
    top.bottoms.assign(count, -1);
    std::vector<int> keys;
    for (const auto& [key, bottom] : bottoms_) keys.push_back(key);
    const double spread = 3.0 * std::cbrt(double(count));
    const bool pile = chance(random_, count < 1000 ? 0.3 : 0.02);
    for (uint64_t i = 0; i < count; ++i) {
        VkAccelerationStructureInstanceNV& in = top.instances[i];
        double m[3][3];
        const int shape = int(below(random_, 4));
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) m[r][c] = shape == 0 ? (r == c) : between(random_, -1, 1);
        if (shape == 1) m[0][0] += 2, m[1][1] += 2, m[2][2] += 2;                   // tame
        if (shape == 2) m[0][0] = -2 + m[0][0], m[1][1] += 2, m[2][2] += 2;         // mirrored
        if (shape == 3) m[0][0] += 3, m[1][1] = 0.3 + 0.1 * m[1][1], m[2][2] += 2;  // flat
        if (!keys.empty() && !chance(random_, 0.05)) top.bottoms[i] = keys[below(random_, keys.size())];
        // About as large as its distance to others: piles of thousands are no scene, but some are.
        const double reach = top.bottoms[i] < 0 ? 1 : bottoms_.at(top.bottoms[i]).reference->reach();
        const double fit = 1 / std::max(reach, 1e-3), wish = std::pow(10.0, between(random_, -1, 0.5));
        const double scale = count < 100 && shape == 0 ? 1 : (pile ? wish : wish * fit);
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 3; ++c) in.transform.matrix[r][c] = float(scale * m[r][c]);
            in.transform.matrix[r][3] =
                count == 1 && shape == 0 ? 0.0f : float(between(random_, -spread, spread));
        }
        in.instanceCustomIndex = uint32_t(random_()) & 0xffffffu;
        in.mask = chance(random_, 0.7) ? 0xffu : uint32_t(random_()) & 0xffu;
        in.flags = chance(random_, 0.5) ? 0 : uint32_t(random_()) & 3u;
        if (chance(random_, 0.2)) in.flags |= chance(random_, 0.5) ? 4u : 8u;
    }
}

void World::build_top(bool update) {
    Top& top = *top_;
    uint32_t record = 0;
    for (auto& [key, bottom] : bottoms_) {
        bottom.first_record = record;
        record += 2 * uint32_t(bottom.content.geometries.size());
    }
    for (size_t i = 0; i < top.instances.size(); ++i) {
        VkAccelerationStructureInstanceNV& in = top.instances[i];
        in.accelerationStructureReference = 0;
        if (top.bottoms[i] < 0) continue;
        const Bottom& b = bottoms_.at(top.bottoms[i]);
        in.instanceShaderBindingTableRecordOffset = b.first_record & 0xffffffu;
        uint64_t handle = 0;
        device_.check(
            rtrGetAccelerationStructureHandle(device_.handle, b.structure.handle, sizeof handle, &handle),
            "rtrGetAccelerationStructureHandle");
        in.accelerationStructureReference = handle;
    }
    const VkDeviceSize offset = 16 * below(random_, 4),
                       bytes = top.instances.size() * sizeof top.instances[0];
    Buffer instances(device_.context, offset + bytes + 64, RTR_INPUT_BUFFER_USAGE, MemoryKind::Host);
    if (bytes) std::memcpy(static_cast<uint8_t*>(instances.mapped) + offset, top.instances.data(), bytes);
    VkAccelerationStructureInfoNV info = info_of(kTop, top.flags);
    info.instanceCount = uint32_t(top.instances.size());
    RtrAccelerationStructure dst = top.structure.handle;
    const Buffer scratch(device_.context, scratch_size(dst, update), RTR_SCRATCH_BUFFER_USAGE,
                         MemoryKind::Device);
    record_top(info, instances, offset, update, scratch);
    ++(update ? counts_.top_updates : counts_.top_builds);
}

void World::record_top(const VkAccelerationStructureInfoNV& info, const Buffer& instances,
                       VkDeviceSize offset, bool update, const Buffer& scratch) {
    RtrAccelerationStructure dst = top_->structure.handle;
    record([&](RtrRecorder recorder) {
        device_.check(rtrCmdBuildAccelerationStructure(recorder, &info, instances.handle, offset, update, dst,
                                                       update ? dst : nullptr, scratch.handle, 0),
                      "rtrCmdBuildAccelerationStructure (top level)");
    });
}

// May the present top level be updated? Its instances must stay active or inactive as they are.
bool World::top_updatable() const {
    if (!top_ || !(top_->flags & VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_NV))
        return false;
    for (size_t i = 0; i < top_->bottoms.size(); ++i) {
        if (top_->bottoms[i] < 0) continue;
        const auto found = bottoms_.find(top_->bottoms[i]);
        if (found == bottoms_.end() || found->second.reference->empty() != top_->empty[i]) return false;
    }
    return true;
}

void World::make_top() {
    if (top_updatable() && chance(random_, 0.5)) {
        const std::vector<int> same = top_->bottoms;
        make_instances(*top_, top_->instances.size());
        top_->bottoms = same;
        history_ += " top-update";
        build_top(true);
    } else {
        if (top_) destroy(top_->structure);
        top_ = std::make_unique<Top>();
        top_->flags = random_flags(random_);
        const uint64_t count = log_uniform(random_, limits_.instances);
        VkAccelerationStructureInfoNV info = info_of(kTop, top_->flags);
        info.instanceCount = uint32_t(count);
        top_->structure = create(info, 0);
        if (!top_->structure.handle) throw Error("the heap has no room for the top level alone");
        make_instances(*top_, count);
        history_ += " top(" + std::to_string(count) + ")";
        build_top(false);
    }
    top_->empty.clear();
    for (int key : top_->bottoms) top_->empty.push_back(key < 0 || bottoms_.at(key).reference->empty());
    in_use_ = -2;  // what it refers to stays
    if (chance(random_, 0.3)) {
        const bool compact = (top_->flags & VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_COMPACTION_BIT_NV) != 0;
        copy(top_->structure, info_of(kTop, top_->flags), compact ? Copy::Compact : Copy::Clone);
        top_->copied = true;
    } else if (chance(random_, 0.2)) {
        serialise(top_->structure, kTop, top_->flags, top_.get());
        top_->copied = true;
    }
    in_use_ = -1;
}

void World::step() {
    history_ = "step " + std::to_string(counts_.steps) + ":";
    try {
        take_step();
    } catch (const std::exception& e) {
        const std::string text = e.what();
        if (text.rfind(history_, 0) == 0) throw;
        throw Error(history_ + "\n" + text);
    }
}

std::string World::describe_step() const {
    char seconds[100];
    std::snprintf(seconds, sizeof seconds, " (device %.2f s, reference %.2f s)", trace_seconds_, reference_seconds_);
    return history_ + seconds;
}

void World::take_step() {
    const uint64_t operations = 1 + below(random_, 3);
    for (uint64_t i = 0; i < operations; ++i) {
        if (bottoms_.empty() || (bottoms_.size() < 8 && chance(random_, 0.4))) {
            add_bottom();
        } else if (chance(random_, 0.15) || primitives() > limits_.primitives * 9 / 10) {
            evict(-1);
        } else {
            change_bottom();
        }
    }
    make_top();
    history_ += " trace";
    trace();
    ++counts_.steps;
    counts_.most_primitives = std::max(counts_.most_primitives, primitives());
    counts_.most_instances = std::max<uint64_t>(counts_.most_instances, top_->instances.size());
    if (device_.context.validating() && !device_.context.validation_messages().empty())
        throw Error(history_ + "\nvalidation: " + device_.context.validation_messages().front());
}

}  // namespace rtc::stress
