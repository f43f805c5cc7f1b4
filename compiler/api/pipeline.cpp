#include <algorithm>

#include "api/objects.h"

namespace {

template <typename Items>
bool has_name(const Items& items, const std::string& name) {
    return std::any_of(items.begin(), items.end(), [&](const auto& item) { return item.name == name; });
}

int32_t add_stage(rtcc_pipeline_t pipeline, rtcc_stage kind, const char* name, const char* file,
                  rtcc::Stage stage) {
    stage.kind = rtcc::kind_of(kind);
    stage.file = file ? file : "";
    stage.name = name && *name ? std::string(name) : stage.file;
    if (stage.name.empty() || has_name(pipeline->stages, stage.name)) return -1;
    pipeline->stages.push_back(std::move(stage));
    return static_cast<int32_t>(pipeline->stages.size() - 1);
}

bool in_range(const rtcc_pipeline& pipeline, int32_t stage) {
    return stage >= 0 && static_cast<size_t>(stage) < pipeline.stages.size();
}

int32_t add_group(rtcc_pipeline_t pipeline, const char* name, rtcc::Group group, const char* fallback) {
    group.name = name && *name ? name : fallback;
    if (group.name.empty() || has_name(pipeline->groups, group.name)) return -1;
    pipeline->groups.push_back(std::move(group));
    return static_cast<int32_t>(pipeline->groups.size() - 1);
}

template <typename F>
int32_t guarded_index(F&& body) {
    try {
        return body();
    } catch (...) {
        return -1;
    }
}

}  // namespace

extern "C" {

rtcc_pipeline_t rtcc_pipeline_create(void) { return new (std::nothrow) rtcc_pipeline; }

void rtcc_pipeline_release(rtcc_pipeline_t pipeline) { delete pipeline; }

int32_t rtcc_pipeline_add_glsl(rtcc_pipeline_t pipeline, rtcc_stage stage, const char* name, const char* file,
                               const char* source, size_t source_size) {
    if (!pipeline || (!source && source_size) || !rtcc::valid_stage(stage)) return -1;
    return guarded_index([&] {
        rtcc::Stage added;
        added.source.assign(source ? source : "", source_size);
        return add_stage(pipeline, stage, name, file, std::move(added));
    });
}

int32_t rtcc_pipeline_add_spirv(rtcc_pipeline_t pipeline, rtcc_stage stage, const char* name,
                                const char* file, const uint32_t* words, size_t word_count,
                                const char* entry) {
    if (!pipeline || (!words && word_count) || !rtcc::valid_stage(stage)) return -1;
    return guarded_index([&] {
        rtcc::Stage added;
        added.is_glsl = false;
        added.words.assign(words, words + word_count);
        if (entry) added.entry = entry;
        return add_stage(pipeline, stage, name, file, std::move(added));
    });
}

rtcc_status rtcc_pipeline_specialize(rtcc_pipeline_t pipeline, int32_t stage, uint32_t constant_id,
                                     uint64_t bits) {
    if (!pipeline || !in_range(*pipeline, stage)) return RTCC_STATUS_INVALID_ARGUMENT;
    return rtcc::guarded([&] {
        auto& values = pipeline->stages[static_cast<size_t>(stage)].specialization;
        std::erase_if(values, [&](const rtc::SpecValue& v) { return v.id == constant_id; });
        values.push_back({constant_id, bits});
        return RTCC_STATUS_SUCCESS;
    });
}

rtcc_status rtcc_pipeline_specialize_text(rtcc_pipeline_t pipeline, int32_t stage, uint32_t constant_id,
                                          const char* value) {
    if (!pipeline || !value || !in_range(*pipeline, stage)) return RTCC_STATUS_INVALID_ARGUMENT;
    return rtcc::guarded([&] {
        auto& values = pipeline->stages[static_cast<size_t>(stage)].specialization_text;
        std::erase_if(values, [&](const rtcc::SpecText& v) { return v.id == constant_id; });
        values.push_back({constant_id, value});
        return RTCC_STATUS_SUCCESS;
    });
}

int32_t rtcc_pipeline_add_general_group(rtcc_pipeline_t pipeline, const char* name, int32_t stage) {
    if (!pipeline || !in_range(*pipeline, stage)) return -1;
    return guarded_index([&] {
        rtcc::Group group;
        group.stages[0] = stage;
        return add_group(pipeline, name, std::move(group),
                         pipeline->stages[static_cast<size_t>(stage)].name.c_str());
    });
}

int32_t rtcc_pipeline_add_hit_group(rtcc_pipeline_t pipeline, const char* name, int32_t closest_hit,
                                    int32_t any_hit, int32_t intersection) {
    if (!pipeline) return -1;
    return guarded_index([&] {
        rtcc::Group group;
        group.general = false;
        const int32_t members[3] = {closest_hit, any_hit, intersection};
        const char* fallback = "";
        for (size_t i = 3; i-- > 0;) {
            if (members[i] != -1 && !in_range(*pipeline, members[i])) return -1;
            group.stages[i] = members[i];
            if (members[i] != -1) fallback = pipeline->stages[static_cast<size_t>(members[i])].name.c_str();
        }
        return add_group(pipeline, name, std::move(group), fallback);
    });
}

}  // extern "C"
